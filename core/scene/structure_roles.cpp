#include "core/scene/structure_roles.h"

#include <algorithm>

#include "core/base/error.h"

namespace brachy {
namespace {

[[noreturn]] void refuse_two(const Scene& scene, StructureRole role,
                             const std::vector<std::size_t>& candidates) {
  std::string names;
  for (const std::size_t n : candidates)
    names.append(names.empty() ? "\"" : ", \"").append(scene.structures[n].name).append("\"");
  const StructureSettings& second = scene.structures[candidates[1]];
  throw UserError((second.place.empty() ? "[[structure]]" : second.place) + ": " + names +
                  " may each be the " + role_word(role) + "; give one role = \"" + role_word(role) +
                  "\", and the other role = \"other\"");
}

}  // namespace

std::vector<StructureRole> structure_roles(const Scene& scene) {
  using enum StructureRole;
  std::vector<StructureRole> roles(scene.structures.size(), kOther);
  std::vector<NamedRole> named(scene.structures.size());
  for (std::size_t n = 0; n < roles.size(); ++n) {
    const StructureSettings& s = scene.structures[n];
    named[n] = role_of_name(s.name);
    const auto given = role_of_word(s.role);
    roles[n] = given.value_or(is_unique(named[n].role) ? kOther : named[n].role);
    if (given) named[n] = {};
  }
  for (const StructureRole role : {kGland, kUrethra, kRectum, kBladder, kPubicArch}) {
    std::vector<std::size_t> best;
    for (std::size_t n = 0; n < roles.size(); ++n)
      if (roles[n] == role) best.push_back(n);
    if (best.size() > 1) refuse_two(scene, role, best);
    if (!best.empty()) continue;
    std::uint8_t least = role == kGland ? NamedRole::kExact : NamedRole::kPart;
    for (std::size_t n = 0; n < roles.size(); ++n) {
      if (named[n].role != role || named[n].fit > least) continue;
      if (named[n].fit < least) best.clear();
      least = named[n].fit;
      best.push_back(n);
    }
    // Two parts of an organ are not the organ.
    if (best.size() > 1 && least == NamedRole::kPart) continue;
    if (best.size() > 1) refuse_two(scene, role, best);
    if (!best.empty()) roles[best.front()] = role;
  }
  return roles;
}

std::vector<std::string> structure_names(const Scene& scene) {
  const std::vector<StructureRole> roles = structure_roles(scene);
  std::vector<std::string> names;
  for (std::size_t n = 0; n < roles.size(); ++n) {
    const std::string& own = scene.structures[n].name;
    const auto as_role = role_of_word(own);
    // "rectum" whose role is another must not be taken for the rectum.
    const bool is_taken = as_role && is_unique(*as_role);
    names.push_back(is_unique(roles[n]) ? role_word(roles[n]) : is_taken ? own + "_other" : own);
  }
  return names;
}

}  // namespace brachy
