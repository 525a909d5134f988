#include "core/base/simd/simd_target.h"

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr SimdTarget kAll[] = {SimdTarget::kAvx512, SimdTarget::kAvx2, SimdTarget::kSse4,
                               SimdTarget::kGeneric};

}  // namespace

bool is_supported(SimdTarget target) {
  if (target == SimdTarget::kGeneric) return true;
#if defined(__x86_64__)
  switch (target) {
    case SimdTarget::kSse4:
      return __builtin_cpu_supports("sse4.2");
    case SimdTarget::kAvx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case SimdTarget::kAvx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
             __builtin_cpu_supports("fma");
    default:
      break;
  }
#endif
  return false;
}

SimdTarget best_simd_target() {
  for (SimdTarget target : kAll)
    if (is_supported(target)) return target;
  return SimdTarget::kGeneric;
}

std::string_view to_string(SimdTarget target) {
  switch (target) {
    case SimdTarget::kGeneric:
      return "generic";
    case SimdTarget::kSse4:
      return "sse4";
    case SimdTarget::kAvx2:
      return "avx2";
    case SimdTarget::kAvx512:
      return "avx512";
  }
  return "unknown";
}

std::optional<SimdTarget> find_simd_target(std::string_view name) {
  for (SimdTarget target : kAll)
    if (to_string(target) == name) return target;
  return std::nullopt;
}

SimdTarget resolve_simd_target(const std::string& name) {
  if (name == "auto") return best_simd_target();
  const auto target = find_simd_target(name);
  if (!target)
    throw UserError("engine.simd: no target '" + name + "'; use auto, generic, sse4, avx2 or avx512");
  if (!is_supported(*target))
    throw UserError("engine.simd: this processor has no " + name + "; use auto, or at most " +
                    std::string(to_string(best_simd_target())));
  return *target;
}

}  // namespace brachy
