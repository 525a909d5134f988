#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "core/conditioning/factor_status.h"
#include "core/kernels/kernels.h"
#include "core/math/rigid_transform.h"

namespace brachy {

// Why landmarks are refused, and what would do instead, found by trying: the condition number is estimated for each try,
// which is a factorisation each. For people and files, not for ticks. Threads: any. They allocate.

/// The largest support radius up to `support_radius` (mm) with which `kernel` solves landmarks at `positions` (n, mm), within
/// 1 % below; 0 where two are the same place.
double largest_stable_support(const Kernel& kernel, std::span<const Vec3> positions, double support_radius);

/// Condition number of the landmarks `chosen` (ascending indices); infinity where they cannot be factored.
using ConditionOf = std::function<double(std::span<const std::size_t> chosen)>;

/// The least spacing, mm, to which landmarks at `positions` must be thinned so that they can be solved, within 1 % above:
/// each landmark nearer than that to one that stays, in their order, goes.
double least_stable_spacing(std::span<const Vec3> positions, const ConditionOf& condition_of);

/// One sentence that says why landmarks at `positions` (n, mm) with `displacements` (n, mm) were refused with `why`, which
/// supports and which spacing would do.
std::string explain_refusal(const FactorStatus& why, std::span<const Vec3> positions,
                            std::span<const Vec3> displacements, const Kernel& kernel, double support_radius);

/// The same for a matrix rung, whose landmarks `condition_of` tries.
std::string explain_refusal(const FactorStatus& why, std::span<const Vec3> positions, std::string_view rung,
                            const ConditionOf& condition_of);

}  // namespace brachy
