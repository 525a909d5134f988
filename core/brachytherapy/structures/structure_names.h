#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/brachytherapy/structures/structure_role.h"

namespace brachy {

/// The words by which structures are known, each in one piece as joined_words writes it.
struct StructureNames {
  struct Organ {
    StructureRole role;
    std::vector<std::string> names;
  };
  std::vector<Organ> organs;                        ///< the gland first
  std::array<std::vector<std::string>, 4> targets;  ///< CTV, target, PTV, GTV
  std::vector<std::string> aids;                    ///< what only helps planning, and implants: no organ
  std::vector<std::string> others;                  ///< other organs whose names contain those of `organs`
  std::vector<std::string> parts;                   ///< a name with one of these is a part of its organ
  std::vector<std::string> left, right;
};
const StructureNames& name_table();

}  // namespace brachy
