#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/injectivity/scalar_cells.h"
#include "core/models/blocks/block_kernels.h"
#include "core/models/composition.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"

namespace brachy {

/// Sub-steps of a ψ kernel. With t_k = s_1 + … + s_k, u_k is the field that displaces p + t_{k−1} d by d, scaled to the
/// step; φ(p_i) = p_i + t_m d_i.
/// Threads, real-time: as Composition.
class ScalarComposition : public Composition {
 public:
  /// The tissue must outlive this.
  ScalarComposition(const Tissue& tissue, const Kernel& kernel, double support_radius, SimdTarget target,
                    std::size_t max_landmarks, std::size_t max_steps);

  bool is_always_used() const override { return false; }
  double reach() const override { return kReach; }
  double begin(std::span<const Vec3> positions, std::span<const Vec3> displacements) noexcept override;
  bool next() noexcept override;
  const CellField& cells() const override { return cells_; }
  bool is_like_last() const override { return false; }
  double rest() const override { return 1 - reached(); }
  void accept(double scale, const Vec3* weakest) noexcept override;
  double missed_mm() const override { return 0; }

  void evaluate(std::uint64_t work) noexcept override;
  std::span<const std::uint32_t> touched() const override { return touched_; }
  Vec3 displacement_at(const Vec3& X) const noexcept override;

 private:
  // Leaves a margin for a bound that is found quickly.
  static constexpr double kReach = 0.6;

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

  std::vector<Step> steps_;  // of which count_ are accepted; the next is a trial
  std::size_t count_ = 0;

  std::vector<std::uint32_t> touched_;
  std::vector<std::uint8_t> is_touched_;
  std::vector<float> determinants_;  // of each point, the product over steps
  /// Of the block in work.
  struct Scratch {
    std::vector<std::uint32_t> all, near;  // landmarks
    std::vector<LocalLandmark<double>> in_double;
    std::vector<LocalLandmark<float>> in_single;
    std::vector<std::uint32_t> chosen;
    std::vector<float> x, y, z;
  };
  Scratch scratch_;
};

}  // namespace brachy
