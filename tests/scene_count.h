#pragma once

#include <cstdlib>

namespace brachy::test {

/// Number of cases of a generator: `usual`, or BRACHY_SCENES (scripts/campaigns/campaign.sh).
inline int scene_count(int usual) {
  const char* asked = std::getenv("BRACHY_SCENES");
  return asked ? std::atoi(asked) : usual;
}

/// Whether a campaign runs a generator whole.
inline bool is_campaign() {
  return std::getenv("BRACHY_SCENES") != nullptr;
}

}  // namespace brachy::test
