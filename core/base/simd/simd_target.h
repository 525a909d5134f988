#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace brachy {

/// The instruction sets that the field evaluation is compiled for; a program contains all and selects one at start-up.
/// Targets with FMA round differently: results are the same bit for bit for one target on any machine, so golden
/// hashes are taken with the target pinned.
enum class SimdTarget {
  kGeneric,  ///< the compiler's baseline (SSE2 on x86-64)
  kSse4,
  kAvx2,    ///< with FMA
  kAvx512,  ///< F, BW, DQ, VL
};

/// The widest target this processor runs.
SimdTarget best_simd_target();

/// Whether this processor (and this build) runs `target`.
bool is_supported(SimdTarget target);

std::string_view to_string(SimdTarget target);  ///< "generic", "sse4", "avx2", "avx512"
std::optional<SimdTarget> find_simd_target(std::string_view name);

/// The target named by a scene's `engine.simd`; "auto" is the widest one.
/// Throws UserError where this processor lacks it.
SimdTarget resolve_simd_target(const std::string& name);

}  // namespace brachy
