#include "apps/daemon/control/volume_studies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/brachytherapy/contours/contour_score.h"

namespace brachy {
namespace {

constexpr double kFarthestMm = 300, kLongestMm = 1000;

/// A study that can be scored.
struct CheckedStudy {
  net::ContourMessage message;                             // as it came
  ContourSet contours;                                     // whose slice is an index of message.slices
  std::vector<std::shared_ptr<const FrozenGland>> glands;  // of each of `contours`
};

/// Whether one of its images is in this plane, but for what rounding does.
bool shows(const FrozenGland& gland, const RigidTransform& X_WI) {
  constexpr double kMostMm = 1e-6, kMostOfAxis = 1e-9;
  return std::ranges::any_of(gland.X_WI, [&](const RigidTransform& own) {
    return (own.p - X_WI.p).norm() <= kMostMm && (own.R - X_WI.R).norm() <= kMostOfAxis;
  });
}

std::string refusal_of(const net::ContourSlice& slice) {
  double length = 0;
  for (std::size_t k = 0; k < slice.points.size(); ++k) {
    const auto [x, y] = slice.points[k];
    const auto [next_x, next_y] = slice.points[(k + 1) % slice.points.size()];
    if (!(std::hypot(x, y) < kFarthestMm))
      return fmt::format("a point is more than {:g} mm from the image's first pixel", kFarthestMm);
    length += std::hypot(next_x - x, next_y - y);
  }
  return length > kLongestMm ? fmt::format("its outline is longer than {:g} mm", kLongestMm) : "";
}

const net::ContourSlice& slice_of(const CheckedStudy& study, std::size_t contour) {
  return study.message.slices[static_cast<std::size_t>(study.contours.contours[contour].slice)];
}

RecordedStudy with_truth(const CheckedStudy& checked, const SurfaceMesh& rest, double period_s) {
  std::vector<SurfaceMesh> meshes;
  std::vector<const SurfaceMesh*> shapes;
  meshes.reserve(checked.glands.size());
  RecordedStudy recorded;
  for (const auto& gland : checked.glands) {
    shapes.push_back(&meshes.emplace_back(SurfaceMesh{gland->vertices, rest.triangles}));
    recorded.t_s = std::max(recorded.t_s, period_s * static_cast<double>(gland->tick));
  }
  recorded.study = make_study(checked.contours, shapes);
  for (StudyPlane& plane : recorded.study.planes) {
    const net::ContourSlice& own = slice_of(checked, plane.shape);
    recorded.sources.push_back({own.tick, plane.slice ? own.probe_depth_mm : NAN});
    if (plane.slice) plane.slice = own.slice;
  }
  return recorded;
}

net::ContourMessage answer_of(const CheckedStudy& checked, const ContourStudy& study,
                              const ContourScore& score) {
  net::ContourMessage answer;
  answer.about_sequence = checked.message.about_sequence;
  net::ContourMessage::Figures figures;
  figures.dice = score.dice;
  figures.outlined_cm3 = score.outlined_cm3;
  figures.true_cm3 = score.gland_cm3;
  figures.same_planes_cm3 = score.same_planes_cm3;
  figures.volume_error_percent = score.step_mm > 0 ? score.volume_error_percent() : NAN;
  figures.hausdorff_mm = score.hausdorff_mm;
  figures.hausdorff_95_mm = score.hausdorff_95_mm;
  figures.mean_mm = score.mean_mm;
  figures.step_mm = score.step_mm;
  figures.missed = static_cast<std::uint16_t>(score.missed);
  figures.beyond = static_cast<std::uint16_t>(score.beyond);
  for (std::size_t i = 0; i < study.planes.size(); ++i) {
    const StudyPlane& plane = study.planes[i];
    const SliceScore& s = score.slices[i];
    const net::ContourSlice& own = slice_of(checked, plane.shape);
    const std::int32_t number = plane.slice ? own.slice : net::ContourSlice::kMissed;
    figures.planes.push_back({number, s.offset_mm, s.areas.first, s.areas.second, s.dice(), s.hausdorff_mm});
    const double aside = plane.offset_mm - checked.contours.contours[plane.shape].offset_mm;
    RigidTransform X_WI = own.X_WI, X_WP = study.X_WS;
    X_WI.p += aside * study.X_WS.R.col(2);
    X_WP.p += plane.offset_mm * study.X_WS.R.col(2);
    const RigidTransform X_IP = X_WI.inverse() * X_WP;
    for (const std::vector<Vec2>& outline : outlines_of(plane.truth)) {
      net::ContourSlice& truth = answer.slices.emplace_back();
      truth.slice = number;
      truth.tick = own.tick;
      truth.probe_depth_mm = plane.slice ? own.probe_depth_mm : NAN;
      truth.X_WI = X_WI;
      for (const Vec2& p : outline) {
        const Vec3 p_I = X_IP * Vec3(p.x(), p.y(), 0);
        truth.points.push_back({p_I.x(), p_I.y()});
      }
    }
  }
  answer.score = std::move(figures);
  return answer;
}

}  // namespace

void VolumeStudies::keep(std::shared_ptr<const FrozenGland> gland) {
  // Frozen again in the same tick: the same shape, maybe in other planes.
  if (!frozen_.empty() && frozen_.back()->tick == gland->tick) {
    auto both = std::make_shared<FrozenGland>(*gland);
    for (const RigidTransform& X_WI : frozen_.back()->X_WI)
      if (both->X_WI.size() < kMostFreezes && !shows(*gland, X_WI)) both->X_WI.push_back(X_WI);
    gland = std::move(both);
    frozen_.pop_back();
  }
  if (frozen_.size() == kMostFreezes) frozen_.pop_front();
  frozen_.push_back(std::move(gland));
}

/// The glands that the slices show, in their order; or why there is none of one.
std::string VolumeStudies::find_glands(const net::ContourMessage& study, Glands& glands) const {
  for (const net::ContourSlice& slice : study.slices) {
    const auto gland = std::find_if(frozen_.rbegin(), frozen_.rend(),
                                    [&](const auto& frozen) { return frozen->tick == slice.tick; });
    if (gland == frozen_.rend())
      return fmt::format(
          "slice {}: no image of tick {} was frozen, or its field was not certified, or {} later ones were: "
          "freeze the image, and outline it again",
          slice.slice, slice.tick, kMostFreezes);
    // An outline in another plane would be scored against what nobody saw.
    if (!shows(**gland, slice.X_WI))
      return fmt::format("slice {}: no image of tick {} was frozen in its plane: give the X_WI of the IMAGE",
                         slice.slice, slice.tick);
    glands.push_back(*gland);
  }
  return {};
}

std::string VolumeStudies::execute(net::ContourMessage study, const net::Sender& from) {
  if (study.slices.empty()) return "there is no outline: outline a slice";
  if (study.slices.size() > net::ContourMessage::kMostSlices)
    return fmt::format("more than {} slices", net::ContourMessage::kMostSlices);
  Glands glands;
  if (std::string why = find_glands(study, glands); !why.empty()) return why;
  const bool is_taken = turns_.add(
      from.id, [this, own = std::make_shared<const net::ContourMessage>(std::move(study)), glands, from] {
        return WorkTurns::Work([this, own, glands, from] { return score(*own, glands, from); });
      });
  return is_taken ? "" : "your last study is still being scored: wait for its result";
}

WorkTurns::Finish VolumeStudies::score(const net::ContourMessage& study, const Glands& glands,
                                       const net::Sender& from) const {
  const auto refuse = [&](std::string why) { return [from, why = std::move(why)] { from.refuse(why); }; };
  CheckedStudy checked{study, {}, {}};
  std::vector<OutlinedSlice> outlined;
  for (std::size_t i = 0; i < study.slices.size(); ++i) {
    const net::ContourSlice& slice = study.slices[i];
    if (const std::string why = refusal_of(slice); !why.empty())
      return refuse(fmt::format("slice {}: {}", slice.slice, why));
    const auto same = [&](const net::ContourSlice& other) { return other.slice == slice.slice; };
    if (std::ranges::count_if(study.slices, same) > 1)
      return refuse(fmt::format("slice {} is there twice: a slice has one outline", slice.slice));
    OutlinedSlice& corners = outlined.emplace_back(OutlinedSlice{static_cast<long long>(i), {}});
    for (const auto& [x, y] : slice.points) corners.corners.push_back(slice.X_WI * Vec3(x, y, 0));
  }
  try {
    checked.contours = make_contours(outlined);
    for (const Contour& contour : checked.contours.contours)
      checked.glands.push_back(glands[static_cast<std::size_t>(contour.slice)]);
    const RecordedStudy recorded = with_truth(checked, gland_, period_s_);
    const ContourScore result = score_study(recorded.study);
    return [this, from, failure = store_ ? store_(recorded) : "",
            answer = answer_of(checked, recorded.study, result)] {
      if (!failure.empty()) warn_(failure);
      from.answer(answer);
    };
  } catch (const std::exception& e) {
    return refuse(e.what());
  }
}

}  // namespace brachy
