#include "core/brachytherapy/structures/tested_organs.h"

namespace brachy {

std::vector<TestedOrgan> tested_organs(const std::vector<Structure>& structures) {
  std::vector<TestedOrgan> organs;
  for (const Structure& structure : structures)
    if (structure.name != "prostate")
      organs.push_back({structure.name, std::make_shared<const SurfaceBvh>(structure.mesh),
                        structure.name == TestedOrgan::kBone});
  return organs;
}

std::vector<std::string> names_of(const std::vector<TestedOrgan>& organs) {
  std::vector<std::string> names;
  for (const TestedOrgan& organ : organs) names.push_back(organ.name);
  return names;
}

}  // namespace brachy
