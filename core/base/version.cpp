#include "core/base/version.h"

namespace brachy {

std::string version() {
  return BRACHY_VERSION;
}

}  // namespace brachy
