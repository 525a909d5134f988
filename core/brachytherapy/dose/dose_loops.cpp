// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/brachytherapy/dose/dose_loops.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/base/simd/simd_attributes.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/loaded_source.h"

namespace brachy {
namespace {

constexpr int kRun = 64;  // points for each pass: the data between its two loops stay in the L1 cache
constexpr int kLanes = DoseScatter::kLanes;  // counts are rounded up to it
constexpr float kPi = std::numbers::pi_v<float>;
// Points nearer to the axis, mm, are moved there: outside the capsule G then changes by less than rounding.
constexpr float kOnAxis = 1e-4f;

// atan2(y, x), y > 0: atan(t)/t on [0, 1] by a polynomial in t² of least relative error, 1e-7 (fitted by reweighted
// least squares).
BRACHY_INLINE float angle(float y, float x) {
  const float ax = std::abs(x);
  const float t = std::min(y, ax) / std::max(y, ax), w = t * t;
  float p = -0.00469327472f;
  p = p * w + 0.0242523986f;
  p = p * w - 0.059486387f;
  p = p * w + 0.0991429242f;
  p = p * w - 0.140194808f;
  p = p * w + 0.199697239f;
  p = p * w - 0.333319907f;
  p = p * w + 0.999999901f;
  float a = p * t;
  a = y > ax ? kPi / 2 - a : a;
  return x < 0 ? kPi - a : a;
}

// Position v in a table of `count` values at whole numbers: the interval, and the fraction along it. The end where v is
// beyond it or NaN.
BRACHY_INLINE void locate(float v, int count, std::int32_t& interval, float& share) {
  const float last = static_cast<float>(count - 1);
  const float inside = v < last ? v : last;
  interval = std::min(static_cast<std::int32_t>(inside), count - 2);
  share = inside - static_cast<float>(interval);
}

// Where a point is: along the seed's axis, and away from it.
struct DosePlace {
  float along, away[3];
};

BRACHY_INLINE DosePlace place_of(const DoseRow& row, int number) {
  const float i = static_cast<float>(number);
  return {row.along + i * row.along_step,
          {row.away[0] + i * row.away_step[0], row.away[1] + i * row.away_step[1],
           row.away[2] + i * row.away_step[2]}};
}

BRACHY_INLINE DosePlace place_of(const DoseScatter& points, int i) {
  const float x = points.x[i] - points.seed[0], y = points.y[i] - points.seed[1],
              z = points.z[i] - points.seed[2];
  const float a = points.axis[0], b = points.axis[1], c = points.axis[2];
  return {a * x + b * y + c * z, {b * z - c * y, c * x - a * z, a * y - b * x}};
}

// `kIsFolded`: the grid of F is kFolded, and a point behind the seed's middle is as one before it.
template <bool kIsFolded, class Places>
BRACHY_INLINE void add_dose(const DoseTables& tables, const Places& places, float strength_u,
                            std::size_t count, float* __restrict dose) {
  constexpr AnisotropyGrid kGrid = kIsFolded ? DoseTables::kFolded : DoseTables::kFull;
  constexpr int kColumns = static_cast<int>(kGrid.radii);
  const float half_length = tables.half_length_mm, radius = tables.radius_mm;
  const float* __restrict f = tables.anisotropy.data();
  const float L = tables.active_length_mm, scale = strength_u * tables.scale;
  const int total = static_cast<int>(count);
  alignas(64) float r[kRun], theta[kRun], value[kRun];
  for (int first = 0; first < total; first += kRun) {
    const int n = std::min(kRun, total - first), padded = (n + kLanes - 1) / kLanes * kLanes;
    for (int k = 0; k < padded; ++k) {
      const DosePlace place = place_of(places, first + k);
      const float x = place.away[0], y = place.away[1], w = place.away[2], along = place.along;
      float z = std::abs(along), rho = std::sqrt(x * x + y * y + w * w);
      const float outwards = std::max(std::min(radius - rho, half_length - z), 0.0f);  // dose_rate.h
      z += outwards;
      rho = std::max(rho + outwards, kOnAxis);
      const float q = rho * rho + (z - L / 2) * (z + L / 2);
      value[k] = scale * angle(L * rho, q) / (L * rho);
      r[k] = std::sqrt(rho * rho + z * z);
      theta[k] = (180 / kPi) * angle(rho, kIsFolded ? z : std::copysign(z, along));
    }
    for (int k = 0; k < padded; ++k) {
      std::int32_t i, j, l;
      float s, t, u;
      locate(r[k] * (1 / DoseTables::kRadialStepMm), DoseTables::kRadialCount, i, s);
      locate(r[k] * (1 / kGrid.step_mm), kColumns, j, t);
      locate(theta[k], static_cast<int>(kGrid.angles), l, u);
      const float g = tables.radial[i] + s * (tables.radial[i + 1] - tables.radial[i]);
      const std::int32_t at = l * kColumns + j;
      const float lower = f[at] + t * (f[at + 1] - f[at]);
      const float upper = f[at + kColumns] + t * (f[at + kColumns + 1] - f[at + kColumns]);
      value[k] *= g * (lower + u * (upper - lower));
    }
    for (int k = 0; k < n; ++k) dose[first + k] += value[k];
  }
}

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute)                                                          \
  struct name {                                                                                 \
    template <class Places>                                                                     \
    attribute static void run(const DoseTables& tables, const Places& places, float strength_u, \
                              std::size_t count, float* dose) {                                 \
      if (tables.is_folded)                                                                     \
        add_dose<true>(tables, places, strength_u, count, dose);                                \
      else                                                                                      \
        add_dose<false>(tables, places, strength_u, count, dose);                               \
    }                                                                                           \
    static constexpr DoseLoops kLoops{run<DoseRow>, run<DoseScatter>};                          \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(Generic, );
BRACHY_TARGET(Sse4, BRACHY_SSE4);
BRACHY_TARGET(Avx2, BRACHY_AVX2);
BRACHY_TARGET(Avx512, BRACHY_AVX512);

// Is every node of the source's F one of the grid's?
bool includes_nodes(const AnisotropyGrid& grid, const Tg43Source& source) {
  const auto is_whole = [](double v) { return std::abs(v - std::round(v)) < 1e-9; };
  return source.F_r_cm.back() <= grid.step_mm * static_cast<double>(grid.radii - 1) / 10 &&
         std::ranges::all_of(source.F_r_cm, [&](double r) { return is_whole(10 * r / grid.step_mm); }) &&
         std::ranges::all_of(source.F_theta_deg, is_whole);
}

}  // namespace

DoseTables make_dose_tables(const Tg43Source& source) {
  DoseTables tables;
  tables.is_folded = source.is_symmetric() && includes_nodes(DoseTables::kFolded, source);
  tables.active_length_mm = static_cast<float>(10 * source.active_length_cm);
  tables.half_length_mm = static_cast<float>(source.capsule_length_mm / 2);
  tables.radius_mm = static_cast<float>(source.capsule_diameter_mm / 2);
  // G in 1/mm² is 1/100 of that in 1/cm²: both here and at the reference point the table's lengths are mm.
  tables.scale =
      static_cast<float>(100 * (0.01 * source.half_life_h() / std::numbers::ln2) * source.dose_rate_constant /
                         geometry_function(source.active_length_cm, 1, 0));
  for (std::size_t i = 0; i < DoseTables::kRadialCount; ++i)
    tables.radial[i] = static_cast<float>(radial_dose_function(source, static_cast<double>(i) / 100));
  const AnisotropyGrid grid = tables.is_folded ? DoseTables::kFolded : DoseTables::kFull;
  tables.anisotropy.resize(grid.radii * grid.angles);
  for (std::size_t l = 0; l < grid.angles; ++l) {
    // Of a symmetric source both halves are the table's one.
    const auto theta = static_cast<double>(source.is_symmetric() && l > 90 ? 180 - l : l);
    for (std::size_t j = 0; j < grid.radii; ++j)
      tables.anisotropy[l * grid.radii + j] = static_cast<float>(
          anisotropy_function(source, grid.step_mm / 10.0 * static_cast<double>(j), theta));
  }
  return tables;
}

const DoseTables& dose_tables(SourceModel model) {
  static const DoseTables iodine = make_dose_tables(tg43_source(SourceModel::kAmersham6711));
  static const DoseTables palladium = make_dose_tables(tg43_source(SourceModel::kTheraSeed200));
  if (model == SourceModel::kAmersham6711) return iodine;
  if (model == SourceModel::kTheraSeed200) return palladium;
  const bool is_loaded = find_loaded(model) != nullptr;
  assert(is_loaded && "unknown source model");
  return is_loaded ? loaded_dose_tables(model) : iodine;
}

const DoseLoops& dose_loops(SimdTarget target) {
  return loops_for(target, Generic::kLoops, Sse4::kLoops, Avx2::kLoops, Avx512::kLoops);
}

}  // namespace brachy
