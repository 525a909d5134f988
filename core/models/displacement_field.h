#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/rigid_transform.h"
#include "core/models/blocks/block_kernels.h"

namespace brachy {

/// A displacement field u of a tissue, evaluated: at the tissue's points, block by block, and at any single point.
/// Threads: one caller; const functions from any while nobody changes the field. Real-time: they do not
/// allocate or throw.
class DisplacementField {
 public:
  virtual ~DisplacementField() = default;

  /// Blocks that the field reaches, ascending; the others are at rest.
  virtual std::span<const std::uint32_t> touched() const = 0;
  /// u at the points of a touched block, mm.
  virtual const BlockDisplacement<float>& displacement(std::uint32_t block) const = 0;
  /// u at a single rest position X, mm.
  virtual Vec3 displacement_at(const Vec3& X) const noexcept = 0;
  /// The same at the rest positions `X` (mm) into `u` (as many, mm), which models may evaluate as they do the tissue's
  /// points: in float, far landmarks together. Fast where each kBlockSize points lie close together. It uses working
  /// memory of the field: one caller, and none that changes the field meanwhile.
  virtual void displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept {
    for (std::size_t i = 0; i < X.size(); ++i) u[i] = displacement_at(X[i]);
  }
};

}  // namespace brachy
