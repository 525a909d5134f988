#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/rigid_transform.h"
#include "core/kernels/kernels.h"
#include "core/solve/factor_status.h"

namespace brachy {

// The reason why landmarks are refused, and settings that would work, found by trying: each try estimates the condition
// number and so takes a factorization. For messages, not for ticks. Threads: any. They allocate.

/// The largest support radius up to `support_radius` (mm) with which `kernel` solves landmarks at `positions` (n,
/// mm), within 1 % below; 0 where two coincide.
double largest_stable_support(const Kernel& kernel, std::span<const Vec3> positions, double support_radius);

/// Condition number of the landmarks `chosen` (ascending indices); infinity where they cannot be factored.
using ConditionOf = std::function<double(std::span<const std::size_t> chosen)>;

/// The least spacing, mm, to which landmarks at `positions` must be thinned so that they can be solved, within 1 %
/// above: in their order, each landmark nearer than that to one that is kept is removed.
double least_stable_spacing(std::span<const Vec3> positions, const ConditionOf& condition_of);

/// One sentence on why landmarks at `positions` (n, mm) with `displacements` (n, mm) were refused with `why`,
/// and which supports and which spacing can be solved.
std::string explain_refusal(const FactorStatus& why, std::span<const Vec3> positions,
                            std::span<const Vec3> displacements, const Kernel& kernel, double support_radius);

/// The same for a matrix model, whose landmarks `condition_of` tries.
std::string explain_refusal(const FactorStatus& why, std::span<const Vec3> positions,
                            std::string_view model_name, const ConditionOf& condition_of);

}  // namespace brachy
