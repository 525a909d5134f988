// Speckle, resolution cell and attenuation in homogeneous tissue.
#include <gtest/gtest.h>

#include <numeric>

#include "tests/core/ultrasound/ultrasound_testing.h"

namespace brachy {
namespace {

using test::FunctionField;
using test::plain_options;
using test::pressure_at;

const auto kAtRest = [](const Vec3&) { return Vec3(Vec3::Zero()); };

std::size_t sample_of(const UltrasoundImager& imager, double depth_mm) {
  return static_cast<std::size_t>(depth_mm / imager.sample_mm());
}

struct Patch {
  std::size_t lines_from, lines_to, from, to;
};

// Autocovariance of the envelope at a lag.
double covariance(const UltrasoundImager& imager, const Patch& p, std::size_t by_lines,
                  std::size_t by_samples) {
  double sum = 0, sum_a = 0, sum_b = 0, n = 0;
  for (std::size_t l = p.lines_from; l + by_lines < p.lines_to; ++l)
    for (std::size_t s = p.from; s + by_samples < p.to; ++s) {
      const double a = pressure_at(imager, l, s), b = pressure_at(imager, l + by_lines, s + by_samples);
      sum += a * b;
      sum_a += a;
      sum_b += b;
      n += 1;
    }
  return sum / n - sum_a / n * sum_b / n;
}

// Full width at half maximum in samples or lines.
double width(const UltrasoundImager& imager, const Patch& p, bool across) {
  const double peak = covariance(imager, p, 0, 0);
  double last = 1;
  for (std::size_t lag = 1; lag < 40; ++lag) {
    const double c = covariance(imager, p, across ? lag : 0, across ? 0 : lag) / peak;
    if (c < 0.5) return 2 * (static_cast<double>(lag - 1) + (last - 0.5) / (last - c));
    last = c;
  }
  return 80;
}

TEST(Speckle, EnvelopeIsRayleighWithTheLevelOfTheTissue) {
  for (const char* array : {"transverse", "sagittal"})
    for (const int planes : {1, 3, 5}) {
      UltrasoundImager::Options options = plain_options(array);
      options.settings.planes = planes;
      UltrasoundImager imager(options, std::make_shared<EchoMap>());
      FunctionField field(kAtRest);
      ASSERT_EQ(test::render(imager, field), ImageResult::kNew);
      for (const double depth : {12.0, 30.0, 50.0}) {
        double sum = 0, squares = 0, n = 0;
        for (std::size_t l = 60; l < 450; ++l)
          for (std::size_t s = sample_of(imager, depth - 5); s < sample_of(imager, depth + 5); ++s) {
            const double p = pressure_at(imager, l, s);
            sum += p;
            squares += p * p;
            n += 1;
          }
        const double mean = sum / n, deviation = std::sqrt(squares / n - mean * mean);
        EXPECT_NEAR(mean / deviation, 1.913, 0.1913)
            << array << " " << planes << " planes, " << depth << " mm";
        EXPECT_NEAR(10 * std::log10(squares / n), 0, 1)
            << array << " " << planes << " planes, " << depth << " mm";
      }
    }
}

TEST(Speckle, CellIsTheStatedResolution) {
  UltrasoundImager::Options options = plain_options();
  options.settings.planes = 1;
  UltrasoundImager imager(options, std::make_shared<EchoMap>());
  FunctionField field(kAtRest);
  ASSERT_EQ(test::render(imager, field), ImageResult::kNew);
  const double line_mm = imager.plane().line_spacing_mm(0);
  for (const double depth : {20.0, 30.0, 45.0}) {
    const Patch patch{20, 490, sample_of(imager, depth - 4), sample_of(imager, depth + 4)};
    const PointSpread& spread = imager.point_spread();
    EXPECT_NEAR(width(imager, patch, false) * imager.sample_mm(), spread.axial_mm(), 0.15 * spread.axial_mm())
        << depth;
    const double lateral = spread.lateral_mm(depth);
    EXPECT_NEAR(width(imager, patch, true) * line_mm, lateral, 0.15 * lateral) << depth;
  }
}

TEST(Speckle, LevelFallsWithDepthAsTissueAttenuates) {
  UltrasoundImager::Options options = plain_options();
  options.settings.attenuation_db_per_cm_mhz = 0.5;
  const double there_and_back = 2 * 0.5 * options.settings.frequency_mhz;
  options.settings.tgc_extra_db_per_cm = -there_and_back;  // none
  options.settings.gain_db = 20;
  UltrasoundImager imager(options, std::make_shared<EchoMap>());
  FunctionField field(kAtRest);
  ASSERT_EQ(test::render(imager, field), ImageResult::kNew);
  double n = 0, z = 0, db = 0, zz = 0, z_db = 0;
  for (std::size_t s = sample_of(imager, 5); s < sample_of(imager, 55); ++s) {
    double power = 0;
    for (std::size_t l = 0; l < imager.plane().lines(); ++l) power += std::pow(pressure_at(imager, l, s), 2);
    const double cm = 0.1 * imager.sample_mm() * static_cast<double>(s);
    const double level = 10 * std::log10(power / static_cast<double>(imager.plane().lines()));
    n += 1;
    z += cm;
    db += level;
    zz += cm * cm;
    z_db += cm * level;
  }
  EXPECT_NEAR((n * z_db - z * db) / (n * zz - z * z), -there_and_back, 0.05 * there_and_back);
}

// The pattern around a sample of a line, without its mean, of length 1.
std::vector<double> pattern_at(const UltrasoundImager& imager, std::size_t line, std::size_t sample) {
  constexpr std::size_t kLines = 10;
  const std::size_t samples = sample_of(imager, 1.12);
  std::vector<double> values;
  for (std::size_t l = line - kLines; l <= line + kLines; ++l)
    for (std::size_t s = sample - samples; s <= sample + samples; ++s)
      values.push_back(pressure_at(imager, l, s));
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  double square = 0;
  for (double& v : values) {
    v -= mean;
    square += v * v;
  }
  for (double& v : values) v /= std::sqrt(square);
  return values;
}

TEST(Speckle, MovesWithTheTissue) {
  // Shear, stretch and bending, up to 1.3 mm; the sagittal plane has −z across and y away from the probe.
  const auto u = [](const Vec3& X) {
    return Vec3(0, 0.7 * std::sin(0.06 * X.z()) + 0.02 * X.y(), 0.9 * std::cos(0.05 * X.y()) + 0.01 * X.z());
  };
  UltrasoundImager imager(plain_options(), std::make_shared<EchoMap>());
  FunctionField rest(kAtRest);
  FunctionField moved(u);
  ASSERT_EQ(test::render(imager, rest), ImageResult::kNew);
  const ImagePlane& plane = imager.plane();
  const RigidTransform X_WI = test::probe_below() * plane.in_probe();
  struct Tracked {
    std::vector<double> pattern;
    std::size_t line, sample;
  };
  std::vector<Tracked> tracked;
  for (std::size_t line = 60; line < 450; line += 65)
    for (double depth = 12; depth < 50; depth += 9)
      tracked.push_back({pattern_at(imager, line, sample_of(imager, depth)), line, sample_of(imager, depth)});
  ASSERT_EQ(test::render(imager, moved), ImageResult::kNew);
  double squares = 0;
  for (const Tracked& t : tracked) {
    double best = -1;
    std::ptrdiff_t best_line = 0, best_sample = 0;
    const auto reach = static_cast<std::ptrdiff_t>(sample_of(imager, 1.92));
    for (std::ptrdiff_t dl = -16; dl <= 16; ++dl)
      for (std::ptrdiff_t ds = -reach; ds <= reach; ++ds) {
        const std::vector<double> there =
            pattern_at(imager, static_cast<std::size_t>(static_cast<std::ptrdiff_t>(t.line) + dl),
                       static_cast<std::size_t>(static_cast<std::ptrdiff_t>(t.sample) + ds));
        const double c = std::inner_product(there.begin(), there.end(), t.pattern.begin(), 0.0);
        if (c <= best) continue;
        best = c;
        best_line = dl;
        best_sample = ds;
      }
    const PlanePoint p =
        plane.at(static_cast<double>(t.line), imager.sample_mm() * static_cast<double>(t.sample));
    const Vec3 truth = X_WI.R.transpose() * u(X_WI * Vec3(p.a, p.b, 0));
    squares += std::pow(static_cast<double>(best_line) * plane.line_spacing_mm(0) - truth.x(), 2) +
               std::pow(static_cast<double>(best_sample) * imager.sample_mm() - truth.y(), 2);
  }
  EXPECT_GE(tracked.size(), 25u);
  EXPECT_LE(std::sqrt(squares / static_cast<double>(tracked.size())), 0.3);
}

}  // namespace
}  // namespace brachy
