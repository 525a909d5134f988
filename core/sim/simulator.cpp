#include "core/sim/simulator.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/conditioning/landmark_hygiene.h"
#include "core/error.h"
#include "core/field/deformation.h"
#include "core/heterogeneous/heterogeneous_deformation.h"
#include "core/ladder/ladder.h"
#include "core/ladder/ladder_deformation.h"
#include "core/scene/load_body.h"
#include "core/scene/load_tissues.h"

namespace brachy {
namespace {

const Scene& check(const Scene& scene) {
  if (scene.model.kernel == "auto")
    throw UserError("model.kernel is still \"auto\"; the scene has to go through with_choice first");
  return scene;
}

SurfaceMesh surface_of(const Tissue& tissue) {
  const auto begin = tissue.rest_vertices.begin();
  return {{begin, begin + static_cast<std::ptrdiff_t>(tissue.surface_count)}, tissue.triangles};
}

std::size_t max_landmarks(const Scene& scene) {
  return static_cast<std::size_t>(scene.contact.max_landmarks) + scene.anchors.count;
}

std::unique_ptr<GuardedField> make_field(const Scene& scene, const Tissue& tissue) {
  const SimdTarget target = resolve_simd_target(scene.engine.simd);
  const std::size_t landmarks = max_landmarks(scene);
  const BlockField::Options options{
      .target = target, .threads = scene.engine.threads, .max_landmarks = landmarks};
  const std::string& rung = scene.model.kernel;
  const bool heterogeneous = has_supports(scene, rung);
  std::unique_ptr<TissueField> field;
  std::unique_ptr<Composition> composition;
  if (is_matrix_rung(rung)) {
    const ElasticBody body = load_body(scene);
    if (heterogeneous) {
      require_in_box(tissue, body);
      field = std::make_unique<HeterogeneousDeformation<CompactKernels>>(
          tissue, load_compact_tissues(scene, *find_compact_rung(rung), body), options);
    } else {
      field = std::make_unique<LadderDeformation>(
          tissue, rung, body,
          LadderDeformation::Options{
              .target = target, .threads = scene.engine.threads, .max_landmarks = landmarks});
    }
  } else {
    const Kernel kernel = *find_kernel(rung);
    const double radius = scene.model.support_radius_mm;
    if (heterogeneous) {
      field = std::make_unique<HeterogeneousDeformation<ScalarKernels>>(
          tissue, load_scalar_tissues(scene, kernel, radius), options);
    } else {
      field = std::make_unique<Deformation>(tissue, kernel, radius, options);
      composition = std::make_unique<Composition>(tissue, kernel, radius, target, landmarks,
                                                  static_cast<std::size_t>(scene.stability.max_substeps));
    }
  }
  return std::make_unique<GuardedField>(tissue, std::move(field), std::move(composition), scene.stability,
                                        landmarks);
}

}  // namespace

// Anchors stand in for what holds the tissue where a kernel knows nothing of it; the matrix rungs know.
Anchors make_anchors(const Scene& scene, const Tissue& tissue) {
  if (scene.anchors.count > tissue.surface_count)
    throw UserError("anchors.count is " + std::to_string(scene.anchors.count) + " but the surface has only " +
                    std::to_string(tissue.surface_count) + " vertices; lower anchors.count");
  Anchors::Options options = scene.anchors;
  if (is_matrix_rung(scene.model.kernel)) options.count = 0;
  return {{tissue.rest_vertices.data(), tissue.surface_count}, options};
}

Simulator::Simulator(const Scene& scene, Tissue tissue)
    : tissue_(std::move(tissue)),
      surface_(surface_of(tissue_)),
      period_s_(check(scene).period_s()),
      contact_(surface_, scene.needle, scene.contact),
      anchors_(make_anchors(scene, tissue_)),
      anchor_clearance_(scene.anchors.clearance_mm),
      field_(make_field(scene, tissue_)),
      block_ticks_(tissue_.blocks.size()),
      block_evaluated_(tissue_.blocks.size()) {
  positions_.reserve(max_landmarks(scene));
  displacements_.reserve(max_landmarks(scene));
  needles_.resize(1);
  pose_histories_.resize(1);
  displaced_.reserve(tissue_.blocks.size());
  was_displaced_.reserve(tissue_.blocks.size());
  for (auto& blocks : changed_) blocks.reserve(tissue_.blocks.size());
  rest_.reserve(3 * tissue_.size());
  for (const Vec3& X : tissue_.rest_vertices)
    for (int k = 0; k < 3; ++k) rest_.push_back(static_cast<float>(X[k]));
  deformed_ = rest_;
}

MeshState Simulator::initial_state() const {
  MeshState state;
  state.deformed_vertices = rest_;
  state.block_ticks.assign(tissue_.blocks.size(), 0);
  state.needles = needles_;
  state.pose_histories = pose_histories_;
  return state;
}

void Simulator::step(std::span<const NeedlePose> poses, MeshState& state) noexcept {
  ++tick_;
  gather_landmarks(poses);
  deform();
  write(state);
}

// No needle landmark, no landmarks at all: anchors alone hold nothing back. The tip's landmark, which moves most, is
// last: the landmark system then only renews its last row.
void Simulator::gather_landmarks(std::span<const NeedlePose> poses) noexcept {
  const NeedlePose pose = poses.empty() ? NeedlePose{} : poses[0];
  NeedleState& state = needles_[0];
  state.present = pose.present;
  state.input = pose;
  state.X_WN = pose.X_WN;
  if (pose.present) pose_histories_[0][tick_ % MeshState::kPoseHistory] = {tick_, pose.X_WN};
  positions_.clear();
  displacements_.clear();
  flags_ = 0;
  if (pose.present) {
    contact_.update(pose.X_WN, field_.get());
    flags_ = contact_.flags();
  }
  const auto needle = pose.present ? contact_.positions() : std::span<const Vec3>();
  anchors_.update(needle.empty() ? 0 : contact_.load(), period_s_);
  if (needle.empty()) return;
  for (const Vec3& anchor : anchors_.positions()) {
    const auto too_near = [&](const Vec3& p) { return (p - anchor).norm() < anchor_clearance_; };
    if (std::ranges::any_of(needle, too_near)) continue;
    positions_.push_back(anchor);
    displacements_.push_back(Vec3::Zero());
  }
  positions_.insert(positions_.end(), needle.begin(), needle.end());
  displacements_.insert(displacements_.end(), contact_.displacements().begin(),
                        contact_.displacements().end());
}

void Simulator::deform() noexcept {
  changed_[tick_ % kChangeHistory].clear();
  if (!solve()) {
    flags_ |= kStepSolveFailed;  // the last field stands
    return;
  }
  flags_ |= field_->flags();
  ++evaluation_counts_[static_cast<std::size_t>(field_->evaluation())];
  if (field_->evaluation() != Evaluation::kIdle) apply_field();
}

// The tick's landmarks, or what is left of them once those are out that keep them from being solved.
FactorStatus Simulator::solve() noexcept {
  FactorStatus status = field_->update(positions_, displacements_);
  if (status) return status;
  LandmarkMender mender(positions_, displacements_, positions_.size() - contact_.positions().size());
  while (!status) {
    const Mended mended = mender.mend(status);
    if (mended == Mended::kNothing) break;
    flags_ |= mended == Mended::kMerged ? kStepMerged : kStepDropped;
    status = field_->update(positions_, displacements_);
  }
  return status;
}

// Blocks in reach take their displacement; those that were displaced and are out of reach now go back to rest. No other
// block is looked at.
void Simulator::apply_field() noexcept {
  max_displacement_ = 0;
  moved_vertices_ = 0;
  std::swap(displaced_, was_displaced_);
  displaced_.clear();
  for (const std::uint32_t b : field_->touched()) {
    block_evaluated_[b] = tick_;
    if (apply_block(b)) changed_[tick_ % kChangeHistory].push_back(b);
  }
  for (const std::uint32_t b : was_displaced_) {
    if (block_evaluated_[b] == tick_) continue;
    const Block& block = tissue_.blocks[b];
    std::copy_n(&rest_[3 * block.first], 3 * block.count, &deformed_[3 * block.first]);
    changed_[tick_ % kChangeHistory].push_back(b);
  }
  for (const std::uint32_t b : changed_[tick_ % kChangeHistory]) block_ticks_[b] = tick_;
}

// True if any coordinate of the block changed.
bool Simulator::apply_block(std::uint32_t b) noexcept {
  const Block& block = tissue_.blocks[b];
  const BlockDisplacement<float>& u = field_->displacement(b);
  float* out = &deformed_[3 * block.first];
  const float* rest = &rest_[3 * block.first];
  bool changed = false;
  std::uint32_t moved = 0;
  float largest_squared = 0;
  for (std::uint32_t i = 0; i < block.count; ++i) {
    const float x[3] = {rest[3 * i] + u.ux[i], rest[3 * i + 1] + u.uy[i], rest[3 * i + 2] + u.uz[i]};
    changed |= x[0] != out[3 * i] || x[1] != out[3 * i + 1] || x[2] != out[3 * i + 2];
    moved += x[0] != rest[3 * i] || x[1] != rest[3 * i + 1] || x[2] != rest[3 * i + 2];
    std::memcpy(out + 3 * i, x, sizeof x);
    largest_squared = std::max(largest_squared, u.ux[i] * u.ux[i] + u.uy[i] * u.uy[i] + u.uz[i] * u.uz[i]);
  }
  max_displacement_ = std::max(max_displacement_, std::sqrt(static_cast<double>(largest_squared)));
  moved_vertices_ += moved;
  if (moved > 0) displaced_.push_back(b);
  return changed;
}

void Simulator::write(MeshState& state) noexcept {
  const auto update_block = [&](std::size_t b) {
    if (state.block_ticks[b] == block_ticks_[b]) return;
    const Block& block = tissue_.blocks[b];
    std::copy_n(&deformed_[3 * block.first], 3 * block.count, &state.deformed_vertices[3 * block.first]);
    state.block_ticks[b] = block_ticks_[b];
  };
  if (tick_ - state.tick <= kChangeHistory) {
    for (std::uint64_t t = state.tick + 1; t <= tick_; ++t)
      for (const std::uint32_t b : changed_[t % kChangeHistory]) update_block(b);
  } else {
    for (std::size_t b = 0; b < tissue_.blocks.size(); ++b) update_block(b);
  }

  constexpr std::uint64_t kHistory = MeshState::kPoseHistory;
  const std::uint64_t oldest_lacking = std::max(state.tick + 1, tick_ < kHistory ? 1 : tick_ - kHistory + 1);
  for (std::size_t n = 0; n < needles_.size(); ++n)
    for (std::uint64_t t = oldest_lacking; t <= tick_; ++t)
      state.pose_histories[n][t % kHistory] = pose_histories_[n][t % kHistory];

  state.tick = tick_;
  state.sim_time_s = static_cast<double>(tick_) * period_s_;
  needles_[0].contact = contact_.state();
  needles_[0].insertion_depth_mm = contact_.insertion_depth();
  needles_[0].landmark_count = static_cast<std::uint32_t>(contact_.positions().size());
  needles_[0].puncture_count = contact_.puncture_count();
  state.needles = needles_;
  state.landmark_count = static_cast<std::uint32_t>(positions_.size());
  state.step_flags = flags_;
  state.certificate = field_->certificate();
  state.certificate.condition = field_->condition();
  state.max_displacement_mm = max_displacement_;
  state.moved_vertices = moved_vertices_;
}

}  // namespace brachy
