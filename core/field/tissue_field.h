#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "core/field/block_kernels.h"
#include "core/rbf/rbf_system.h"
#include "core/simd/simd_target.h"
#include "core/stability/cell_field.h"

namespace brachy {

/// How a tick was evaluated.
enum class Evaluation : std::uint8_t {
  kIdle,       ///< landmarks and displacements as in the last tick: nothing to do
  kDirect,     ///< every block summed over its landmarks
  kMixed,      ///< some blocks condensed already, the others directly
  kCondensed,  ///< every block by its condensed columns
};

/// From landmarks to displaced points: what the simulation asks of a model, whatever rung it is. Deformation has the
/// scalar kernels, LadderDeformation the matrix-valued ones.
/// Threads: one caller. Real-time: no allocation after construction with one thread, no exceptions.
class TissueField {
 public:
  virtual ~TissueField() = default;

  /// Solves u(p_i) = d_i for landmarks at rest `positions` (n, mm) with `displacements` (n, mm) and evaluates u at the
  /// tissue's points. Unless it returns kOk, the last field stands.
  virtual FactorStatus update(std::span<const Vec3> positions,
                              std::span<const Vec3> displacements) noexcept = 0;

  /// Multiplies the last update's field by `scale`, everywhere.
  virtual void rescale(double scale) noexcept = 0;

  virtual Evaluation evaluation() const = 0;  ///< of the last update

  /// Condition number of the landmark system, 1-norm, estimated each time that the set changes; 1 for no landmarks. Above
  /// FactorStatus::kMaxCondition update refuses, and the last field's stands.
  virtual double condition() const = 0;

  /// Blocks that the field reaches, ascending; the others are at rest.
  virtual std::span<const std::uint32_t> touched() const = 0;
  /// u at the points of a touched block, mm.
  virtual const BlockDisplacement<float>& displacement(std::uint32_t block) const = 0;

  /// u at a single rest position X, mm.
  virtual Vec3 displacement_at(const Vec3& X) const noexcept = 0;

  /// The field as the certificate looks at it; until the next update.
  virtual const CellField& cells() noexcept = 0;

  /// The most sources that cells() can have.
  virtual std::size_t max_sources() const = 0;

  /// The force on all landmarks together, N; NaN on rungs whose weights are no forces.
  virtual double total_force_n() const { return std::numeric_limits<double>::quiet_NaN(); }

  virtual SimdTarget target() const = 0;
};

}  // namespace brachy
