#include "net/igtl/snapshot_messages.h"

#include <utility>

#include "net/igtl/needle_name.h"

namespace brachy::net::igtl {
namespace {

/// The frame of a bent needle's tip: the pose's, turned the shortest way onto the tip's tangent.
RigidTransform bent_tip_of(const NeedleState& needle) {
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(needle.X_WN.R.col(2), needle.shape.tip_axis);
  return {turn * needle.X_WN.R, needle.shape.points.back()};
}

}  // namespace

SnapshotMessages::SnapshotMessages(const Tissue& tissue, std::string surface_name)
    : surface_name_(std::move(surface_name)),
      surface_count_(tissue.surface_count),
      triangle_count_(static_cast<std::uint32_t>(tissue.triangles.size())),
      triangles_(encode_triangles(tissue.triangles)) {}

void SnapshotMessages::update(std::shared_ptr<const MeshState> state, std::int64_t utc_ns) {
  state_ = std::move(state);
  timestamp_ = to_timestamp(utc_ns);
  encoded_as_ = {};
}

std::shared_ptr<const Bytes> SnapshotMessages::surface(std::uint16_t version) {
  auto& message = of(version).surface;
  if (!message) {
    const auto points = std::span<const float>(state_->mesh.deformed_vertices).first(3 * surface_count_);
    message = std::make_shared<const Bytes>(
        encode_polydata({version, surface_name_, timestamp_}, points, triangles_, triangle_count_));
    ++encoded_;
  }
  return message;
}

std::shared_ptr<const Bytes> SnapshotMessages::tracking(std::uint16_t version) {
  auto& message = of(version).tracking;
  if (!message) {
    std::vector<TrackedTool> tools;
    const auto& needles = state_->needles.states;
    for (std::size_t n = 0; n < needles.size(); ++n)
      if (needles[n].present) tools.push_back({pose_name(n, needles.size()), needles[n].X_WN});
    message = std::make_shared<const Bytes>(encode_tracking({version, "Needles", timestamp_}, tools));
  }
  return message;
}

const std::vector<SnapshotMessages::Transforms>& SnapshotMessages::transforms(std::uint16_t version) {
  auto& all = of(version).transforms;
  if (all) return *all;
  all.emplace();
  const auto& needles = state_->needles.states;
  for (std::size_t n = 0; n < needles.size(); ++n) {
    if (!needles[n].present) continue;
    Transforms& messages = all->emplace_back();
    messages.needle = n;
    const std::string pose = pose_name(n, needles.size()), force = force_name(n, needles.size());
    messages.pose = encode_transform({version, pose, timestamp_}, needles[n].X_WN);
    if (needles[n].forces.is_finite())
      messages.force =
          encode_transform({version, force, timestamp_}, {Mat3::Identity(), needles[n].forces.force_n});
    const std::string tip = bent_tip_name(n, needles.size());
    if (needles[n].shape.is_bent && needles[n].shape.is_finite())
      messages.bent_tip = encode_transform({version, tip, timestamp_}, bent_tip_of(needles[n]));
  }
  return *all;
}

}  // namespace brachy::net::igtl
