#include "net/igtl/content/snapshot_messages.h"

#include <algorithm>
#include <utility>

#include "net/igtl/codec/point_codec.h"

namespace brachy::net::igtl {
namespace {

/// The frame of a bent needle's tip: the pose's, turned the shortest way onto the tip's tangent.
RigidTransform bent_tip_of(const NeedleState& needle) {
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(needle.X_WN.R.col(2), needle.shape.tip_axis);
  return {turn * needle.X_WN.R, needle.shape.points.back()};
}

std::vector<float> in_frame(std::span<const float> points, const Naming& naming) {
  const RigidTransform X_FW = naming.X_WF.inverse();
  std::vector<float> moved;
  for (std::size_t i = 0; i + 3 <= points.size(); i += 3) {
    const Vec3 p = X_FW * Vec3(points[i], points[i + 1], points[i + 2]);
    for (int k = 0; k < 3; ++k) moved.push_back(static_cast<float>(p[k]));
  }
  return moved;
}

using Colour = std::array<std::uint8_t, 4>;
constexpr Colour kSeedColour{235, 195, 60, 255}, kTargetColour{90, 200, 250, 255},
    kShapeColour{200, 200, 210, 255};
constexpr double kSeedRadiusMm = 0.4;

}  // namespace

SnapshotMessages::SnapshotMessages(const Tissue& tissue, std::string surface_name, Naming naming,
                                   std::vector<Vec3> targets)
    : surface_name_(std::move(surface_name)),
      naming_(std::move(naming)),
      targets_(std::move(targets)),
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
    auto points = std::span<const float>(state_->mesh.deformed_vertices).first(3 * surface_count_);
    const std::vector<float> moved = naming_.is_world() ? std::vector<float>() : in_frame(points, naming_);
    if (!moved.empty()) points = moved;
    message = std::make_shared<const Bytes>(
        encode_polydata({version, surface_name_, timestamp_}, points, triangles_, triangle_count_));
    ++encoded_;
  }
  return message;
}

SnapshotMessages::SeedVersion SnapshotMessages::seed_version() const {
  const SeedStates& seeds = state_->seeds;
  SeedVersion version{state_->summary.run, seeds.count, 0};
  for (std::uint32_t i = 0; i < seeds.count; ++i)
    version.last_tick = std::max(version.last_tick, seeds.ticks[i]);
  return version;
}

std::shared_ptr<const Bytes> SnapshotMessages::seeds(std::uint16_t version) {
  auto& message = of(version).seeds;
  if (!message) {
    std::vector<Point> points;
    for (const Seed& seed : state_->seeds.in_tissue())
      points.push_back({"Seed " + std::to_string(seed.id), "Seeds", kSeedColour,
                        naming_.to_peer({Mat3::Identity(), seed.position}).p, kSeedRadiusMm});
    message =
        std::make_shared<const Bytes>(encode_points({version, "Seeds", timestamp_}, points, surface_name_));
  }
  return message;
}

Bytes SnapshotMessages::targets(std::uint16_t version) const {
  std::vector<Point> points;
  for (std::size_t i = 0; i < targets_.size(); ++i)
    points.push_back({"Target " + std::to_string(i + 1), "Targets", kTargetColour,
                      naming_.to_peer({Mat3::Identity(), targets_[i]}).p, kSeedRadiusMm});
  return encode_points({version, "Targets", timestamp_}, points, surface_name_);
}

/// From the tip, where it is, to the planned seed nearest to it, W.
Vec3 SnapshotMessages::to_nearest_target(const NeedleState& needle) const {
  const Vec3 tip =
      needle.shape.is_bent && needle.shape.is_finite() ? needle.shape.points.back() : needle.X_WN.p;
  const auto nearer = [&](const Vec3& a, const Vec3& b) { return (a - tip).norm() < (b - tip).norm(); };
  return *std::ranges::min_element(targets_, nearer) - tip;
}

/// The course of a needle that bends, from the hub to the tip.
Bytes SnapshotMessages::shape_message(std::size_t needle, std::uint16_t version) const {
  const std::string name = naming_.shape_name(needle, state_->needles.states.size());
  std::vector<Point> points;
  for (const Vec3& p : state_->needles.states[needle].shape.points)
    points.push_back({name + " " + std::to_string(points.size()), "Needle", kShapeColour,
                      naming_.to_peer({Mat3::Identity(), p}).p, 0});
  return encode_points({version, name, timestamp_}, points, surface_name_);
}

const std::vector<SnapshotMessages::Transforms>& SnapshotMessages::transforms(std::uint16_t version) {
  auto& all = of(version).transforms;
  if (all) return *all;
  all.emplace();
  const auto& needles = state_->needles.states;
  const auto vector_message = [&](const std::string& name, const Vec3& v) {
    const Vec3 in_peers_frame = naming_.is_world() ? v : Vec3(naming_.X_WF.R.transpose() * v);
    return encode_transform({version, name, timestamp_}, {Mat3::Identity(), in_peers_frame}, "OK");
  };
  for (std::size_t n = 0; n < needles.size(); ++n) {
    if (!needles[n].present) continue;
    Transforms& messages = all->emplace_back();
    messages.needle = n;
    const std::string pose = naming_.pose_name(n, needles.size()),
                      tip = naming_.bent_tip_name(n, needles.size());
    messages.pose = encode_transform({version, pose, timestamp_}, naming_.to_peer(needles[n].X_WN), "OK");
    if (naming_.is_probe(n)) continue;  // no force, shape or target is a probe's
    if (needles[n].forces.is_finite())
      messages.force = vector_message(naming_.force_name(n, needles.size()), needles[n].forces.force_n);
    if (needles[n].shape.is_bent && needles[n].shape.is_finite()) {
      messages.bent_tip =
          encode_transform({version, tip, timestamp_}, naming_.to_peer(bent_tip_of(needles[n])), "OK");
      messages.shape = shape_message(n, version);
    }
    if (!targets_.empty())
      messages.error = vector_message(naming_.error_name(n, needles.size()), to_nearest_target(needles[n]));
  }
  return *all;
}

}  // namespace brachy::net::igtl
