#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace brachy {

/// The instruction sets the field evaluation is compiled for; the program holds all and picks one at start-up.
/// Targets with FMA round differently: results are the same bit for bit for one target on any machine, so golden
/// hashes are taken with the target pinned.
enum class SimdTarget {
  kGeneric,  ///< what the compiler's baseline has (SSE2 on x86-64)
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

/// The target a scene's `engine.simd` asks for: "auto" is the best one. Throws UserError where this processor lacks it.
SimdTarget resolve_simd_target(const std::string& name);

}  // namespace brachy
