#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/daemon/io/work_turns.h"
#include "apps/daemon/loops/frozen_gland.h"
#include "apps/session/volume_study_file.h"
#include "core/geometry/surface/surface_mesh.h"
#include "net/requests/request.h"

namespace brachy {

/// Volume studies (CONTOUR in net/PROTOCOL.md): outlines of the gland on frozen ultrasound images, scored against the
/// gland as the field had deformed it in the tick of each.
/// Threads: the io thread; scores are computed, and stored, on `worker`, which is ended before this is destroyed.
class VolumeStudies {
 public:
  /// Stores a study, on the worker; returns the text of a failure. May be null.
  using Store = std::function<std::string(RecordedStudy)>;
  static constexpr std::size_t kMostFreezes = 64;

  /// `loop`, `worker` and `gland` (its surface at rest) outlive this. `period_s`: of a tick. `warn` gets failures.
  VolumeStudies(EventLoop& loop, Worker& worker, const SurfaceMesh& gland, double period_s, Store store,
                std::function<void(const std::string&)> warn)
      : turns_(loop, worker),
        gland_(gland),
        period_s_(period_s),
        store_(std::move(store)),
        warn_(std::move(warn)) {}

  /// The scanner was frozen. The oldest of more than kMostFreezes is forgotten.
  void keep(std::shared_ptr<const FrozenGland> gland);

  /// Returns "" where `from` will get the score, or the reason why there is none; else why the study is not scored.
  std::string execute(net::ContourMessage study, const net::Sender& from);

 private:
  using Glands = std::vector<std::shared_ptr<const FrozenGland>>;
  std::string find_glands(const net::ContourMessage& study, Glands& glands) const;
  WorkTurns::Finish score(const net::ContourMessage& study, const Glands& glands,
                          const net::Sender& from) const;

  WorkTurns turns_;
  const SurfaceMesh& gland_;
  const double period_s_;
  const Store store_;
  const std::function<void(const std::string&)> warn_;
  std::deque<std::shared_ptr<const FrozenGland>> frozen_;  // the newest last
};

}  // namespace brachy
