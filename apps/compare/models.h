#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/comparators/compared_model.h"

namespace brachy {

/// A model by name, and how to make it.
struct ModelEntry {
  std::string name;  ///< psi31_a12, psi31_a12_anchors, thin_plate, elastic, …
  std::string
      family;  ///< psi, ladder, exact (ladder, unrounded), or another's: spline, springs, chainmail, paper
  std::function<std::unique_ptr<ComparedModel>()> make;
  bool listed =
      true;  ///< in the table and the charts by name; the others are there for the sweep over supports
  std::string kernel = {};  ///< of psi and paper
  double support_mm = 0;
  bool has_anchors = false;
  std::size_t every_landmark = 1;  ///< of the scene's, whose spacing is 1.5 needle radii
  bool is_surface = false;         ///< ticks move as many points as a surface has, not a volume's
};

/// Every model `brachy compare` knows, in the order of its table: psi rungs, ladder, comparators. `quick`: only listed
/// ones. To add one: an adapter of ComparedModel, and a line in models.cpp.
std::vector<ModelEntry> all_models(bool quick);

}  // namespace brachy
