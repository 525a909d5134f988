#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/injectivity/scalar_cells.h"
#include "core/models/blocks/block_kernels.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"

namespace brachy {

/// Sub-steps of a ψ kernel composed: φ = φ_m ∘ … ∘ φ_1, φ_k = id + s_k u_k. The landmarks go along straight lines
/// from rest to where they are now: with t_k = s_1 + … + s_k, u_k is the field that displaces p + t_{k−1} d by d,
/// scaled to the step. If every step is injective so is φ, and its inverse is that of the steps; φ(p_i) = p_i + t_m
/// d_i. Nothing is carried over from tick to tick: the same landmarks give the same bits.
/// Threads: one. Real-time: no allocation after construction.
class Composition {
 public:
  /// The tissue must outlive this.
  Composition(const Tissue& tissue, const Kernel& kernel, double support_radius, SimdTarget target,
              std::size_t max_landmarks, std::size_t max_steps);

  /// Starts again: no steps, landmarks at rest. Both must stay put until evaluate is done.
  void begin(std::span<const Vec3> positions, std::span<const Vec3> displacements) noexcept;
  /// Solves for the field of the next step. Unless it returns kOk there is none.
  FactorStatus solve() noexcept;
  /// That field, unscaled: for the certificate.
  const CellField& cells() const { return cells_; }
  /// Adds a step: the share `scale` of the whole displacement.
  void accept(double scale) noexcept;
  double reached() const { return reached_; }  ///< t, 0 … 1
  std::size_t steps() const { return count_; }

  /// φ at the tissue's points, and the least det ∇φ among them (at most 1).
  void evaluate() noexcept;
  std::span<const std::uint32_t> touched() const { return touched_; }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const { return displacements_[block]; }
  double least_determinant() const { return least_determinant_; }
  const Vec3& least_place() const { return least_place_; }  ///< rest position of that point

  /// φ(X) − X, mm, in double.
  Vec3 displacement_at(const Vec3& X) const noexcept;

 private:
  struct Step {
    double scale = 0;
    std::vector<Vec3> positions, weights;
  };
  void move_landmarks() noexcept;
  RbfField field(const Step& step) const { return {kernel_, support_radius_, step.positions, step.weights}; }
  void apply(const Step& step, std::uint32_t b) noexcept;
  void multiply_determinants(const Step& step, std::uint32_t b, const Cell& cell,
                             std::span<const std::uint32_t> sources, float* product) noexcept;
  void add_displacement(const Step& step, std::uint32_t b, const Cell& cell,
                        std::span<const std::uint32_t> sources) noexcept;
  void add_in_double(const Step& step, std::uint32_t b, const Cell& cell,
                     std::span<const std::uint32_t> sources) noexcept;
  template <class T>
  BlockPoints<T> moved_points(std::uint32_t b, const Vec3& centre) const noexcept;
  const Tissue& tissue_;
  Kernel kernel_;
  double support_radius_;
  const BlockKernels& loops_;
  RbfSystem system_;
  ScalarCells cells_;

  std::span<const Vec3> landmarks_, displacements_of_landmarks_;  // at rest, and from there
  std::vector<Step> steps_;  // of which count_ are accepted; the next is a trial
  std::size_t count_ = 0;
  double reached_ = 0;

  std::vector<std::uint32_t> touched_;
  std::vector<std::uint8_t> is_touched_;
  std::vector<BlockDisplacement<float>> displacements_;
  std::vector<float> determinants_;  // of each point, the product over steps
  double least_determinant_ = 1;
  Vec3 least_place_ = Vec3::Zero();
  std::vector<std::uint32_t> all_, near_;  // landmarks
  std::vector<LocalLandmark<double>> double_;
  std::vector<LocalLandmark<float>> single_;
  std::vector<std::uint32_t> chosen_;
  std::vector<float> x_, y_, z_;
};

}  // namespace brachy
