#include "apps/score/needle_score.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace brachy {
namespace {

const std::string kBeside;  // the empty name: beside the template

std::string hole_of(const TemplateGrid& grid, const RigidTransform& X_WN) {
  return grid.nearest(X_WN.p, X_WN.R.col(2)).value_or(kBeside);
}

/// A stay of a device's needle in the tissue.
struct Stay {
  double first_s = 0, last_s = 0;
  std::string hole;
};

/// The hole that the needle goes through for most of a visit's poses.
std::string hole_of(const TemplateGrid& grid, std::span<const TrajectorySample> visit) {
  std::map<std::string, std::size_t> poses;
  for (const TrajectorySample& sample : visit) ++poses[hole_of(grid, sample.X_WN)];
  return std::ranges::max_element(poses, {}, [](const auto& counted) { return counted.second; })->first;
}

/// Whether the tip moved along the needle when it came in at sample `first`; a motion that begins inside did.
bool goes_forwards(std::span<const TrajectorySample> samples, std::size_t first) {
  if (first == 0) return true;
  const RigidTransform& X_WN = samples[first].X_WN;
  return (X_WN.p - samples[first - 1].X_WN.p).dot(X_WN.R.col(2)) > 0;
}

class HoleScores {
 public:
  HoleScores(std::span<const std::string> holes, bool has_poses, bool has_forces)
      : has_poses_(has_poses), has_forces_(has_forces) {
    for (std::size_t i = 0; i < holes.size(); ++i) add(holes[i]).planned = i;
  }

  NeedleScore& at(const std::string& hole) {
    const auto found = std::ranges::find(needles_, hole, &NeedleScore::hole);
    return found == needles_.end() ? add(hole) : *found;
  }

  std::vector<NeedleScore> take() {
    std::ranges::stable_sort(needles_, {}, [](const NeedleScore& n) {
      return n.planned ? std::tuple(0, *n.planned, std::string())
                       : std::tuple(n.hole.empty() ? 2 : 1, std::size_t{0}, n.hole);
    });
    return std::move(needles_);
  }

 private:
  NeedleScore& add(const std::string& hole) {
    NeedleScore& needle = needles_.emplace_back();
    needle.hole = hole;
    if (has_poses_) {
      needle.passes = needle.insertions = 0;
      needle.path_in_tissue_mm = needle.time_in_tissue_s = 0;
    }
    if (has_poses_ && has_forces_) needle.punctures = 0;
    return needle;
  }

  bool has_poses_, has_forces_;
  std::vector<NeedleScore> needles_;
};

}  // namespace

NeedlesScore score_needles(std::span<const std::string> planned, const TemplateGrid& grid,
                           const NeedleTrajectories* poses, std::span<const RecordedForce> forces,
                           const InsideTest& inside) {
  HoleScores holes(planned, poses != nullptr, !forces.empty());
  NeedlesScore score;
  std::map<std::uint32_t, std::vector<Stay>> stays;  // by device needle
  if (poses) {
    NeedleMetricsTally all;
    for (const auto& [id, motion] : poses->needles()) {
      const std::span<const TrajectorySample> samples = motion.samples();
      const std::vector<TissueVisit> visits = tissue_visits(samples, inside);
      all.add(samples, visits);
      for (const TissueVisit& visit : visits) {
        const std::string hole = hole_of(grid, samples.subspan(visit.first, visit.end - visit.first));
        stays[id].push_back({samples[visit.first].t_s, samples[visit.end - 1].t_s, hole});
        NeedleScore& needle = holes.at(hole);
        needle.path_in_tissue_mm += visit.path_mm;
        needle.time_in_tissue_s += visit.time_s;
        *needle.passes += visit.entry;
        if (!visit.entry || !goes_forwards(samples, visit.first)) continue;
        ++*needle.insertions;
        needle.insertions_s.push_back(samples[visit.first].t_s);
      }
    }
    score.motion = all.result();
  }

  const auto hole_at = [&](std::uint32_t id, double t_s) -> std::optional<std::string> {
    for (const Stay& stay : stays[id])
      if (stay.first_s - kSameTime <= t_s && t_s <= stay.last_s + kSameTime) return stay.hole;
    const auto X_WN = poses ? poses->sample(id, t_s) : std::nullopt;
    return X_WN ? std::optional(hole_of(grid, *X_WN)) : std::nullopt;
  };
  if (!forces.empty()) score.punctures = 0;
  std::map<std::uint32_t, ContactState> last;
  for (const RecordedForce& sample : forces) {
    const bool punctured =
        last[sample.needle] == ContactState::kTouching && sample.state == ContactState::kInserted;
    last[sample.needle] = sample.state;
    const double force_n = sample.force_n;
    *score.punctures += punctured;
    score.largest_force_n = std::fmax(score.largest_force_n, force_n);
    if (!punctured && !(force_n > 0)) continue;
    const auto hole = hole_at(sample.needle, sample.t_s);
    if (!hole) continue;
    NeedleScore& needle = holes.at(*hole);
    needle.largest_force_n = std::fmax(needle.largest_force_n, force_n);
    *needle.punctures += punctured;
  }
  score.needles = holes.take();
  return score;
}

}  // namespace brachy
