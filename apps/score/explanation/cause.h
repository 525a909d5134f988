#pragma once

#include <cstddef>
#include <vector>

#include "apps/score/explanation/robust.h"
#include "core/base/rigid_transform.h"

namespace brachy {

/// A part of a session's deviation from its plan that has one reason.
struct Cause {
  enum class Kind {
    // of the template or of a group of needles; `needles` are all of the plan's with seeds where `is_of_all`
    kAside,   ///< `shift`, x and y
    kTurned,  ///< `angle` about `centre`, and `shift` there
    kMirrored,
    kDepth,  ///< `shift`, z: > 0 too deep
    // of needles
    kElsewhere,  ///< one needle, `shift` x and y, off by half a hole or more
    kExchanged,  ///< two or more, each where the next one was planned, the last where the first was
    kSpacing,    ///< the train is longer (`slope` > 0) or shorter than planned, by this share
    // of seeds
    kFront,
    kBack,   ///< the first or last seeds of the trains of several needles, `shift`, z
    kSeeds,  ///< some of one needle's, `shift`, z
    // of everything
    kScatterAcross,
    kScatterAlong,  ///< standard deviation: shift.norm()
    // of the tissue, from where seeds fell to where they rest
    kGland,     ///< its motion under the needles: `shift` is that of the foremost seeds
    kSwelling,  ///< `slope`: share by which it was larger when the seeds fell
    kPushed,    ///< while these needles were placed it lay elsewhere than for the others: −`shift`, x and y
    kDragged,   ///< seeds of these needles moved along them after they fell, unlike the others'; `shift`, z
    kUnpunctured,  ///< needles that indented the gland and never went into it; `shift`: mean motion of their seeds
  };
  /// Of so many seeds, none of which has a part yet.
  Cause(Kind of_kind, std::size_t seed_count) : kind(of_kind), part(seed_count, Vec3::Zero()) {}

  Kind kind;
  std::vector<std::size_t> needles;  ///< indices in Plan::needles, rising
  std::vector<double> mm;            ///< how far each of `needles` is off, where it differs; signed along z
  bool is_of_all = false;
  /// What would be gone without it: of each Deviations::seeds, mm; zero for seeds that it does not touch.
  std::vector<Vec3> part;
  Vec3 shift = Vec3::Zero();
  double angle = 0;  ///< rad
  Vec2 centre = Vec2::Zero();
  double slope = 0;
  std::vector<std::size_t> seeds;  ///< Deviations::seeds with a part

  bool is_of_tissue() const { return kind >= Kind::kGland; }
};

}  // namespace brachy
