#pragma once

#include <vector>

#include "tests/sanitized.h"

namespace brachy::test {

/// The models that know forces; under a sanitizer without `fem`, which takes long to set up.
inline std::vector<const char*> accurate_models() {
  std::vector<const char*> models = {"elastic"};
  if (!kIsSanitized) models.push_back("fem");
  return models;
}

}  // namespace brachy::test
