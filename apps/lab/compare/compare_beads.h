#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

class Progress;

/// Beads measured in a block at rest and under loads, on a lattice of indices i, j, k.
struct Beads {
  struct Load {
    int number = 1;                   ///< N of the columns xN, yN, zN
    std::vector<Vec3> displacements;  ///< n, mm
  };
  std::vector<Vec3> rest;                       ///< n, mm
  std::vector<std::size_t> boundary, interior;  ///< boundary: an index is the least or greatest of its kind
  std::vector<Load> loads;                      ///< by ascending number; the first one is for choosing
};

/// Reads a CSV with columns i,j,k (whole numbers), x0,y0,z0 (at rest, mm) and xN,yN,zN for any loads N ≥ 1, found by
/// name, in any order; other columns are ignored. UserError where a column or a bead is missing.
Beads load_beads(const std::filesystem::path& file);

/// The result of one model on one load.
struct BeadRow {
  std::string model;
  int load = 1;
  double rms_mm = 0, max_mm = 0;                           ///< interior beads: distance to the measurement
  std::vector<std::pair<std::string, double>> parameters;  ///< the same for all loads
};

/// Boundary beads as landmarks predict the interior ones. A model's parameters (bead_model.h: its lengths, the
/// smoothing, an affine map or none) are those with the least leave-one-out error over the *boundary* beads of the
/// *first* load; they are applied unchanged to every load. Row "affine": no kernel, the least-squares map.
/// Deterministic, one thread, ten seconds of it: `progress`, if any, is shown.
std::vector<BeadRow> compare_beads(const Beads& beads, Progress* progress = nullptr);

/// Implements `brachy compare --beads FILE`: prints the table; `json`: also writes {"rows": […]} there. Returns an
/// ExitCode.
int compare_beads(const std::filesystem::path& file, const std::optional<std::filesystem::path>& json,
                  std::ostream& out);

}  // namespace brachy
