#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/brachytherapy/structures/organ_contact.h"
#include "core/brachytherapy/structures/tested_organs.h"
#include "core/needle/cut_path.h"

namespace brachy {

/// Where a needle is in a tick: outside the tissue in the world, within it by the material points of its cut.
struct NeedleCourse {
  std::span<const Vec3> points = {};    ///< from the hub to the tip, mm, world W; at least two
  Vec3 axis = Vec3::UnitZ();            ///< of its pose, unit, W
  const CutPath* path = nullptr;        ///< in the tissue: its cut, at rest; null: it is not in the tissue
  double tip_s = 0;                     ///< arc length of the tip's material point on it
  bool is_through = false;              ///< the tip has left the tissue at the end of the path
  std::optional<Vec3> pressed_at = {};  ///< the tip presses on the intact capsule: where, at rest
  /// Where tissue at rest begins on the needle and, where it is through, ends; mm, W.
  Vec3 entry = Vec3::Zero(), exit = Vec3::Zero();
  bool is_stopped = false;  ///< by bone (bone_stop.h)
};

/// Tests a needle against organs in the deformed state, in every tick.
///
/// A point of the needle in the tissue is in an organ if its material point is in the organ at rest: exact where
/// the field is injective, and free of its evaluation. A point outside the tissue is in an organ if it is there in the
/// world: what does not deform is where it rests. Material points of the shaft are those of the cut, which the tip has
/// been at; so the shaft is in the organ from the arc length on at which the tip came in.
/// Depths are sampled every kSampleMm of the tip's way, and in the middle of a free shaft's way through the organ.
/// Limits: a shaft that is dragged into an organ sidewise within tissue, more than its cut follows, is not seen.
/// Threads: one. Real-time: no allocation after construction; a box test an organ, within its box some microseconds.
class OrganContacts {
 public:
  static constexpr double kSampleMm = 0.25;
  static constexpr std::size_t kMaxSamples = 8;  ///< a tick; 400 mm/s at 200 Hz

  /// `organs` must outlive this.
  explicit OrganContacts(const std::vector<TestedOrgan>& organs);

  /// One tick: brings `contacts`, one an organ, up to date. Null: the needle is not there, and its passes end.
  void update(std::uint64_t tick, double period_s, const NeedleCourse* course,
              std::span<OrganContact> contacts) noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(last_s_, is_scanned_, last_free_tip_, came_in_s_, pass_s_);
  }

 private:
  struct Touch {
    bool is_in = false;
    double depth_mm = 0;
  };
  struct Sample {
    Vec3 at = Vec3::Zero();
    double s = 0;
  };
  void take_samples(const NeedleCourse& course) noexcept;
  Touch within_tissue(std::size_t organ, const NeedleCourse& course) noexcept;
  Touch outside_tissue(const TestedOrgan& organ, const NeedleCourse& course) const noexcept;
  void scan_path(std::size_t organ, const NeedleCourse& course) noexcept;
  void begin_or_end(std::size_t organ, std::uint64_t tick, const NeedleCourse& course, const Touch& touch,
                    OrganContact& contact) noexcept;

  const std::vector<TestedOrgan>& organs_;
  std::array<Sample, kMaxSamples> material_, free_;
  std::size_t material_count_ = 0, free_count_ = 0;
  double last_s_ = 0;
  bool is_scanned_ = true;  // the tip has passed all of the path under this object's eyes
  std::optional<Vec3> last_free_tip_;
  static constexpr double kNowhere = std::numeric_limits<double>::infinity();
  std::vector<double> came_in_s_;  // by organ: the least arc length at which the tip was in it; kNowhere
  std::vector<double> pass_s_;     // the same when the pass began
};

}  // namespace brachy
