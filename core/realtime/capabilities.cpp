#include "core/realtime/capabilities.h"

#include <sys/capability.h>
#include <sys/prctl.h>

#include <cerrno>
#include <memory>
#include <system_error>

namespace brachy {

void drop_capabilities() {
  const std::unique_ptr<void, int (*)(void*)> none(cap_init(), cap_free);
  if (!none || cap_set_proc(static_cast<cap_t>(none.get())) != 0 ||
      prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0)
    throw std::system_error(errno, std::generic_category(), "capabilities cannot be dropped");
}

}  // namespace brachy
