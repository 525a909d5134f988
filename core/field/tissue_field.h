#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <Eigen/Core>

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

  /// Makes `positions` (n, at rest, mm) the landmark set and factors its system K; displacements and field stay as they
  /// were. `cores`: the landmarks' core radii, mm, 0 where the rung's own rule holds; empty: 0 for all. Only `elastic` and
  /// `fem` look at them; there other cores are another set. The same set again costs a comparison. Unless it returns kOk,
  /// no set is placed. Threads: the caller's. Real-time: does not allocate.
  virtual FactorStatus place(std::span<const Vec3> positions,
                             std::span<const double> cores = {}) noexcept = 0;

  /// Places the set, solves u(p_i) = d_i for `displacements` (n, mm) and evaluates u at the tissue's points. Unless it
  /// returns kOk, the last field stands.
  virtual FactorStatus update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                              std::span<const double> cores = {}) noexcept = 0;

  /// The forces on the placed landmarks that displace them by `displacements`: f = K⁻¹ d, N (both n). What the field shows
  /// does not change. On rungs whose K is no compliance it is scaled so that a lone landmark has the stiffness that the
  /// rung was made with (landmark_stiffness.h). Threads: the caller's. Real-time: does not allocate; 2 solves' time.
  virtual void reactions(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept = 0;

  /// H_ij = axes_i · (K⁻¹)_ij axes_j, N/mm (H m × m, symmetric), of the placed landmarks first … first + m − 1, each with
  /// its unit axis (`axes` m): the forces along their axes that displacements along their axes take while they are held
  /// across them, and the other landmarks altogether. Scaled as reactions. Threads: the caller's. Real-time: does not
  /// allocate; m³/3 multiply-adds on the ψ rungs, 3 m³ on the matrix ones.
  virtual void axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                               Eigen::Ref<Eigen::MatrixXd> H) noexcept = 0;

  /// Multiplies the last update's field by `scale`, everywhere.
  virtual void rescale(double scale) noexcept = 0;

  virtual Evaluation evaluation() const = 0;  ///< of the last update

  /// Condition number of the placed landmarks' system, 1-norm, estimated each time that the set changes; 1 for no
  /// landmarks. Above FactorStatus::kMaxCondition place and update refuse, and the last one's stands.
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

  /// Size of the force on all landmarks of the field together, N; scaled as reactions.
  virtual double total_force_n() const = 0;

  virtual SimdTarget target() const = 0;
};

}  // namespace brachy
