#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "core/base/number_csv.h"
#include "core/base/rigid_transform.h"
#include "test_paths.h"

namespace brachy::test {

inline const std::filesystem::path kReferences = std::filesystem::path(BRACHY_SOURCE_DIR) / "tests/reference";
inline const std::filesystem::path kLargeMotions = kReferences / "large_motion";

/// Three numbers of a row, from column `first` on.
inline Vec3 vector_at(std::span<const double> row, std::size_t first) {
  return {row[first], row[first + 1], row[first + 2]};
}

/// landmarks.csv, field.csv or targets.csv of a reference scene, mm.
struct ReferenceVectors {
  std::vector<Vec3> positions, displacements;
};

inline ReferenceVectors load_vectors(const std::filesystem::path& file) {
  const NumberTable table = load_number_csv(file, "x,y,z,dx,dy,dz");
  ReferenceVectors vectors;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    vectors.positions.push_back(vector_at(table.row(i), 0));
    vectors.displacements.push_back(vector_at(table.row(i), 3));
  }
  return vectors;
}

}  // namespace brachy::test
