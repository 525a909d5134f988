#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/lab/comparators/compared_model.h"

namespace brachy {

/// A model's name and the function that creates it.
struct ModelEntry {
  std::string name;  ///< psi31_a12, psi31_a12_anchors, thin_plate, elastic, …
  /// psi, matrix, exact (matrix, unrounded), or a comparator: spline, springs, chainmail, paper
  std::string family;
  std::function<std::unique_ptr<ComparedModel>()> make;
  /// in the table and the charts by name; the others are there for the sweep over supports
  bool listed = true;
  std::string kernel = {};  ///< of psi and paper
  double support_mm = 0;
  bool has_anchors = false;
  std::size_t every_landmark = 1;  ///< of the scene's, whose spacing is 1.5 needle radii
  bool is_surface = false;         ///< ticks move as many points as a surface has, not a volume's
};

/// Every model `brachy compare` knows, in the order of its table: psi models, matrix models, comparators. `quick`:
/// only listed ones. To add one: an adapter of ComparedModel, and a line in models.cpp.
std::vector<ModelEntry> all_models(bool quick);

}  // namespace brachy
