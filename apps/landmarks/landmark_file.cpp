#include "apps/landmarks/landmark_file.h"

#include <fmt/format.h>

#include <array>
#include <iostream>

#include "apps/landmarks/landmark_field.h"
#include "core/base/number_csv.h"
#include "core/solve/landmark_repair.h"

namespace brachy {
namespace {

constexpr std::array<std::string_view, 2> kOwnLengths = {"core_mm", "support"};

Vec3 vec3(std::span<const double> row, std::size_t first) {
  return {row[first], row[first + 1], row[first + 2]};
}

}  // namespace

Landmarks load_landmarks(const LandmarkFieldOptions& options) {
  const NumberTable table = load_number_csv(options.landmarks, "x,y,z,dx,dy,dz",
                                            {.max_rows = 20'000, .optional_columns = kOwnLengths});
  Landmarks landmarks;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto refuse = [&](const std::string& what) {
      refuse_line(options.landmarks.string(), table.lines[i], what);
    };
    const double core = table.optional(i, "core_mm").value_or(0);
    if (core < 0) refuse("core_mm is negative; use 0 for the kernel's default");
    if (const auto support = table.optional(i, "support")) {
      if (*support < 0 || (*support == 0 && !options.support_mm))
        refuse("support is not positive; write a radius in mm, or 0 for that of --support");
      landmarks.supports.push_back(*support > 0 ? *support : *options.support_mm);
    }
    landmarks.positions.push_back(vec3(table.row(i), 0));
    landmarks.displacements.push_back(vec3(table.row(i), 3));
    landmarks.cores.push_back(core > 0 ? core : options.core_radius_mm.value_or(0));
    landmarks.lines.push_back(table.lines[i]);
  }
  return landmarks;
}

void merge_duplicates(Landmarks& landmarks, double distance, const std::string& name) {
  const auto remove = [](auto& list, std::size_t i) {
    if (!list.empty()) list.erase(list.begin() + static_cast<std::ptrdiff_t>(i));
  };
  std::size_t from = 0;
  while (const auto duplicates =
             find_duplicates(landmarks.positions, landmarks.displacements, distance, from)) {
    const auto [first, second, agree] = *duplicates;
    const std::size_t line = landmarks.lines[second], other = landmarks.lines[first];
    if (!agree)
      throw Refused(fmt::format(
          "{}:{}: contradicts line {}: displacements of the same point differ by {:g} mm; remove one of them",
          name, line, other, (landmarks.displacements[first] - landmarks.displacements[second]).norm()));
    if (landmarks.cores[first] != landmarks.cores[second] ||
        (!landmarks.supports.empty() && landmarks.supports[first] != landmarks.supports[second]))
      throw Refused(fmt::format(
          "{}:{}: contradicts line {}: the same point has another core or support; remove one of them", name,
          line, other));
    std::cerr << fmt::format("brachy: {}:{}: merged with line {}, a duplicate\n", name, line, other);
    remove(landmarks.positions, second);
    remove(landmarks.displacements, second);
    remove(landmarks.cores, second);
    remove(landmarks.supports, second);
    remove(landmarks.lines, second);
    from = second;
  }
}

}  // namespace brachy
