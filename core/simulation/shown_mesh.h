#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/tissue/tissue.h"
#include "core/models/displacement_field.h"
#include "core/needle/body_frame.h"
#include "core/simulation/mesh_state.h"

namespace brachy {

/// The tissue's points where the last tick has put them, and what each of the last ticks changed: a slot that is some
/// publishes behind gets those blocks alone.
/// Threads: one. Real-time: no allocation after construction.
class ShownMesh {
 public:
  /// `tissue` must outlive this. At rest, in tick 0.
  explicit ShownMesh(const Tissue& tissue);

  /// Begins tick `tick`, the one after the last, with the mesh as it was.
  void begin(std::uint64_t tick) noexcept;
  /// Puts the points where `field`, in the body's frame, and `frame` have them: blocks in reach get their displacement,
  /// those that were displaced and are out of reach return to rest, and no other block is visited; all are where the
  /// body has moved as a whole or swollen.
  void show(const DisplacementField& field, const BodyFrame& frame) noexcept;
  /// Whether the last frame shown is this one.
  bool is_in(const BodyFrame& frame) const { return frame == frame_; }
  /// Brings a slot up to date that has the mesh of tick `since`.
  void write(std::uint64_t since, DeformedMesh& slot) const noexcept;

  const std::vector<float>& rest() const { return rest_; }          ///< 3N, mm: x0 y0 z0 x1 …
  double max_displacement_mm() const { return max_displacement_; }  ///< of a point from where it rests
  std::uint32_t moved_vertices() const { return moved_vertices_; }  ///< points that are not where they rest
  Vec3 mean_displacement() const noexcept;                          ///< of all points, mm

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(tick_, frame_, deformed_, block_ticks_, block_evaluated_, displaced_, was_displaced_, changed_,
            max_displacement_, moved_vertices_);
  }

 private:
  void show_everywhere(const DisplacementField& field, const BodyFrame& frame) noexcept;
  void show_touched(const DisplacementField& field) noexcept;
  bool show_block(std::uint32_t b, const BlockDisplacement<float>& u) noexcept;
  bool move_block(std::uint32_t b, const BlockDisplacement<float>* u, const BodyFrame& frame) noexcept;
  std::vector<std::uint32_t>& changed() { return changed_[tick_ % kChangeHistory]; }

  // Ticks whose changed blocks are known: a slot of the triple buffer is seldom more behind.
  static constexpr std::size_t kChangeHistory = 8;

  const Tissue& tissue_;
  std::uint64_t tick_ = 0;
  BodyFrame frame_;                                           // in which deformed_ is
  std::vector<float> rest_, deformed_;                        // 3N
  std::vector<std::uint64_t> block_ticks_, block_evaluated_;  // in which it changed last; was in reach last
  std::vector<std::uint32_t> displaced_, was_displaced_;      // blocks not at rest now; after the show before
  std::array<std::vector<std::uint32_t>, kChangeHistory> changed_;  // blocks, by tick
  double max_displacement_ = 0;
  std::uint32_t moved_vertices_ = 0;
};

}  // namespace brachy
