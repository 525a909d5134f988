// What needles, seeds, spacers and missing contact take from and add to an image: the same speckle with and without.
#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "tests/core/ultrasound/ultrasound_testing.h"

namespace brachy {
namespace {

using test::FunctionField;
using test::plain_options;
using test::pressure_at;

const auto kStill = [](const Vec3&) { return Vec3(Vec3::Zero()); };

struct Image {
  explicit Image(const UltrasoundImager::Options& options) : imager(options, std::make_shared<EchoMap>()) {}
  void render(std::span<const NeedleState> needles, std::span<const Seed> seeds) {
    FunctionField field(kStill);
    ASSERT_EQ(test::render(imager, field, needles, seeds), ImageResult::kNew);
  }
  Vec3 at(double a, double b) const {
    return test::probe_below() * imager.plane().in_probe() * Vec3(a, b, 0);
  }
  /// Of the power within 0.3 mm of `line` (by angle), from one depth to another.
  double level_db(double line, double from_mm, double to_mm) const {
    double sum = 0, count = 0;
    for (std::size_t l = 0; l < imager.plane().lines(); ++l)
      for (double depth = from_mm; depth < to_mm; depth += imager.sample_mm()) {
        if (std::abs(static_cast<double>(l) - line) * imager.plane().line_spacing_mm(depth) > 0.3) continue;
        sum += std::pow(pressure_at(imager, l, static_cast<std::size_t>(depth / imager.sample_mm())), 2);
        count += 1;
      }
    return 10 * std::log10(sum / count);
  }
  UltrasoundImager imager;
};

NeedleState needle_through(const Vec3& p) {
  NeedleState needle;
  needle.present = true;
  needle.X_WN.p = p + Vec3(0, 0, 40);
  return needle;
}

Seed seed_at(const Vec3& p) {
  Seed seed;
  seed.position = p;
  return seed;
}

TEST(UltrasoundShadow, BehindNeedlesAndSeedsIsAsDeepAsStated) {
  Image image(plain_options("transverse"));
  const double shadow_db = UltrasoundSettings().shadow_db;
  for (const double depth : {15.0, 25.0, 35.0}) {
    const PlanePoint p{0, 10 + depth};
    const double line = image.imager.plane().find(p).line;
    image.render({}, {});
    const double without = image.level_db(line, depth + 8, depth + 20);
    const NeedleState needle = needle_through(image.at(p.a, p.b));
    image.render({&needle, 1}, {});
    const double behind_needle = without - image.level_db(line, depth + 8, depth + 20);
    const Seed seed = seed_at(image.at(p.a, p.b));
    image.render({}, {&seed, 1});
    const double behind_seed = without - image.level_db(line, depth + 8, depth + 20);
    // By the share of the beam's width that they cover.
    const double sigma = image.imager.point_spread().lateral_mm(depth) / 2.355;
    const double beam = std::sqrt(sigma * sigma + 0.635 * 0.635 / 3) * std::sqrt(2 * std::numbers::pi);
    RecordProperty("needle_db_at_" + std::to_string(std::lround(depth)) + "_mm",
                   std::to_string(behind_needle));
    RecordProperty("seed_db_at_" + std::to_string(std::lround(depth)) + "_mm", std::to_string(behind_seed));
    EXPECT_NEAR(behind_needle, shadow_db * 1.27 / beam, 0.2 * behind_needle) << depth;
    const double in_slice =  // of the seed's length
        std::erf(2.25 / (std::numbers::sqrt2 * image.imager.point_spread().elevation_sigma_mm()));
    EXPECT_NEAR(behind_seed, shadow_db * in_slice * 0.8 / beam, 0.2 * behind_seed) << depth;
  }
}

TEST(UltrasoundShadow, LiesBehindTheSeedAndNotBeside) {
  Image image(plain_options("transverse"));
  const Seed seed = seed_at(image.at(0, 35));
  const double beside = image.imager.plane().find({8, 35}).line;
  image.render({}, {});
  const double without = image.level_db(beside, 30, 45);
  image.render({}, {&seed, 1});
  EXPECT_NEAR(image.level_db(beside, 30, 45), without, 1e-3);
}

// Two seeds of a train in the sagittal plane, `apart` between their middles and `aside` out of line.
double brighter_between(double apart_mm, double aside_mm) {
  double level[2];
  for (const bool has_spacers : {false, true}) {
    UltrasoundImager::Options options = plain_options("sagittal");
    options.settings.spacer_echo_db = has_spacers ? 20 : -60;
    Image image(options);
    const std::vector<Seed> seeds = {seed_at(image.at(-0.5 * apart_mm, 35)),
                                     seed_at(image.at(0.5 * apart_mm, 35 + aside_mm))};
    image.render({}, seeds);
    level[has_spacers] = image.level_db(image.imager.plane().find({0, 35}).line, 24.2, 25);
  }
  return level[1] - level[0];
}

TEST(UltrasoundShadow, SpacersLieBetweenTheSeedsOfATrain) {
  EXPECT_GT(brighter_between(10, 0), 6);
  EXPECT_GT(brighter_between(15.5, 0.5), 6);
  EXPECT_EQ(brighter_between(7, 0), 0);   // no space for one
  EXPECT_EQ(brighter_between(10, 5), 0);  // not of one train
}

TEST(UltrasoundShadow, LinesWithoutContactAreDarkAndOthersAsBefore) {
  const auto levels = [](double coupling) {
    UltrasoundImager::Options options = plain_options("transverse");
    options.settings.coupling = coupling;
    options.settings.aperture_mm = 2;
    Image image(options);
    image.render({}, {});
    std::vector<double> of_lines;
    for (std::size_t l = 0; l < image.imager.plane().lines(); ++l) {
      double sum = 0;
      for (std::size_t s = 0; s < image.imager.samples_per_line(); ++s)
        sum += std::pow(pressure_at(image.imager, l, s), 2);
      of_lines.push_back(10 * std::log10(sum));
    }
    return of_lines;
  };
  const std::vector<double> all = levels(1), half = levels(0.5);
  std::size_t dark = 0, same = 0;
  for (std::size_t l = 0; l < all.size(); ++l) {
    if (half[l] < all[l] - 30) ++dark;
    if (half[l] > all[l] - 0.5) ++same;
  }
  EXPECT_GT(dark, all.size() / 10);
  EXPECT_GT(same, all.size() / 10);
}

}  // namespace
}  // namespace brachy
