#include "core/brachytherapy/dose/source.h"

#include <cassert>

#include "core/brachytherapy/dose/loaded_source.h"

namespace brachy {
namespace {

// clang-format off
constexpr double k6711RadialR[] = {0.1, 0.15, 0.25, 0.5, 0.75, 1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9, 10};
constexpr double k6711Radial[] = {
    1.055, 1.078, 1.082, 1.071, 1.042, 1, 0.908, 0.814, 0.632, 0.496,
    0.364, 0.27, 0.199, 0.148, 0.109, 0.0803,
};
constexpr double k6711AnisotropyR[] = {0.5, 1, 2, 3, 4, 5};
constexpr double k6711AnisotropyTheta[] = {0, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90};
// F: a row for each θ, a column for each r.
constexpr double k6711Anisotropy[] = {
    0.333, 0.37, 0.442, 0.488, 0.52, 0.55,
    0.4, 0.429, 0.497, 0.535, 0.561, 0.587,
    0.519, 0.537, 0.58, 0.609, 0.63, 0.645,
    0.716, 0.705, 0.727, 0.743, 0.752, 0.76,
    0.846, 0.834, 0.842, 0.846, 0.848, 0.852,
    0.926, 0.925, 0.926, 0.926, 0.928, 0.928,
    0.972, 0.972, 0.97, 0.969, 0.969, 0.969,
    0.991, 0.991, 0.987, 0.987, 0.987, 0.987,
    0.996, 0.996, 0.996, 0.995, 0.995, 0.995,
    1, 1, 1, 0.999, 0.999, 0.999,
    1, 1, 1, 1, 1, 1,
};

constexpr double k200RadialR[] = {
    0.1, 0.15, 0.25, 0.3, 0.4, 0.5, 0.75, 1, 1.5, 2,
    2.5, 3, 3.5, 4, 5, 6, 7, 10,
};
constexpr double k200Radial[] = {
    0.911, 1.21, 1.37, 1.38, 1.36, 1.3, 1.15, 1, 0.749, 0.555,
    0.41, 0.302, 0.223, 0.163, 0.0887, 0.0482, 0.0262, 0.00615,
};
constexpr double k200AnisotropyR[] = {0.25, 0.5, 0.75, 1, 2, 3, 4, 5, 7.5};
constexpr double k200AnisotropyTheta[] = {
    0, 1, 2, 3, 5, 7, 10, 12, 15, 20,
    25, 30, 40, 50, 60, 70, 75, 80, 85, 90,
};
// F: a row for each θ, a column for each r.
constexpr double k200Anisotropy[] = {
    0.619, 0.694, 0.601, 0.541, 0.526, 0.504, 0.497, 0.513, 0.547,
    0.617, 0.689, 0.597, 0.549, 0.492, 0.505, 0.513, 0.533, 0.58,
    0.618, 0.674, 0.574, 0.534, 0.514, 0.517, 0.524, 0.538, 0.568,
    0.62, 0.642, 0.577, 0.538, 0.506, 0.509, 0.519, 0.532, 0.57,
    0.617, 0.6, 0.54, 0.51, 0.499, 0.508, 0.514, 0.531, 0.571,
    0.579, 0.553, 0.519, 0.498, 0.498, 0.509, 0.521, 0.532, 0.568,
    0.284, 0.496, 0.495, 0.487, 0.504, 0.519, 0.53, 0.544, 0.59,
    0.191, 0.466, 0.486, 0.487, 0.512, 0.529, 0.544, 0.555, 0.614,
    0.289, 0.446, 0.482, 0.49, 0.523, 0.54, 0.556, 0.567, 0.614,
    0.496, 0.442, 0.486, 0.501, 0.547, 0.568, 0.585, 0.605, 0.642,
    0.655, 0.497, 0.524, 0.537, 0.582, 0.603, 0.621, 0.64, 0.684,
    0.775, 0.586, 0.585, 0.593, 0.633, 0.654, 0.667, 0.683, 0.719,
    0.917, 0.734, 0.726, 0.727, 0.75, 0.766, 0.778, 0.784, 0.82,
    0.945, 0.837, 0.831, 0.834, 0.853, 0.869, 0.881, 0.886, 0.912,
    0.976, 0.906, 0.907, 0.912, 0.931, 0.942, 0.96, 0.964, 0.974,
    0.981, 0.929, 0.954, 0.964, 0.989, 1.001, 1.008, 1.004, 1.011,
    0.947, 0.938, 0.961, 0.978, 1.006, 1.021, 1.029, 1.024, 1.033,
    0.992, 0.955, 0.959, 0.972, 1.017, 1.035, 1.046, 1.037, 1.043,
    1.007, 0.973, 0.96, 0.982, 0.998, 1.03, 1.041, 1.036, 1.043,
    1, 1, 1, 1, 1, 1, 1, 1, 1,
};

// clang-format on

constexpr Tg43Source kSources[] = {
    {.model = SourceModel::kAmersham6711,
     .name = "6711",
     .description = "I-125, Amersham/GE OncoSeed 6711",
     .half_life_days = 59.40,
     .active_length_cm = 0.3,
     .dose_rate_constant = 0.965,
     .g_r_cm = k6711RadialR,
     .g = k6711Radial,
     .F_r_cm = k6711AnisotropyR,
     .F_theta_deg = k6711AnisotropyTheta,
     .F = k6711Anisotropy,
     .number = 6711,
     .u_per_mci = 1.27},
    {.model = SourceModel::kTheraSeed200,
     .name = "200",
     .description = "Pd-103, Theragenics TheraSeed 200",
     .half_life_days = 16.991,
     .active_length_cm = 0.423,
     .dose_rate_constant = 0.686,
     .g_r_cm = k200RadialR,
     .g = k200Radial,
     .F_r_cm = k200AnisotropyR,
     .F_theta_deg = k200AnisotropyTheta,
     .F = k200Anisotropy,
     .number = 200,
     .u_per_mci = 1.293},
};

constexpr bool is_complete(const Tg43Source& s) {
  return s.g_r_cm.size() == s.g.size() && s.F.size() == s.F_r_cm.size() * s.F_theta_deg.size();
}
static_assert(is_complete(kSources[0]) && is_complete(kSources[1]));

}  // namespace

const Tg43Source& tg43_source(SourceModel model) {
  for (const Tg43Source& source : kSources)
    if (source.model == model) return source;
  const LoadedSource* loaded = find_loaded(model);
  assert(loaded && "unknown source model");
  return loaded ? loaded->data() : kSources[0];
}

std::string_view to_string(SourceModel model) {
  return tg43_source(model).name;
}

std::optional<SourceModel> find_source(std::string_view name_or_number) {
  const auto is_it = [&](const Tg43Source& source) {
    return source.name == name_or_number || std::to_string(source.number) == name_or_number;
  };
  for (const Tg43Source& source : kSources)
    if (is_it(source)) return source.model;
  for (const LoadedSource* loaded : loaded_sources())
    if (is_it(loaded->data())) return loaded->data().model;
  return std::nullopt;
}

std::optional<SourceModel> find_seed_source(std::string_view name_or_number) {
  const auto model = find_source(name_or_number);
  return model && tg43_source(*model).is_permanent ? model : std::nullopt;
}

std::string source_names(bool permanent) {
  std::string names;
  const auto add = [&](const Tg43Source& source) {
    if (source.is_permanent == permanent) names += (names.empty() ? "" : ", ") + std::string(source.name);
  };
  for (const Tg43Source& source : kSources) add(source);
  for (const LoadedSource* loaded : loaded_sources()) add(loaded->data());
  return names;
}

std::vector<SourceModel> temporary_sources() {
  std::vector<SourceModel> models;
  for (const LoadedSource* loaded : loaded_sources())
    if (!loaded->data().is_permanent) models.push_back(loaded->data().model);
  return models;
}

}  // namespace brachy
