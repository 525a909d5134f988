#include "core/sim/simulator.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/contact/landmark_stiffness.h"
#include "core/error.h"
#include "core/field/deformation.h"
#include "core/heterogeneous/heterogeneous_deformation.h"
#include "core/ladder/ladder.h"
#include "core/ladder/ladder_deformation.h"
#include "core/plan/plan_file.h"
#include "core/scene/load_body.h"
#include "core/scene/load_needle_tissues.h"
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
  return scene.needle.count * static_cast<std::size_t>(scene.contact.max_landmarks) + scene.anchors.count;
}

std::unique_ptr<GuardedField> make_field(const Scene& scene, const Tissue& tissue) {
  const SimdTarget target = resolve_simd_target(scene.engine.simd);
  const std::size_t landmarks = max_landmarks(scene);
  const BlockField::Options options{
      .target = target, .threads = scene.engine.threads, .max_landmarks = landmarks};
  const std::string& rung = scene.model.kernel;
  const bool heterogeneous = has_supports(scene, rung);
  const double stiffness = elastic_landmark_stiffness(1e-3 * scene.tissue.shear_modulus_kpa,
                                                      scene.tissue.poisson, scene.contact.tip_core_mm);
  std::unique_ptr<TissueField> field;
  std::unique_ptr<Composition> composition;
  if (is_matrix_rung(rung)) {
    const ElasticBody body = load_body(scene);
    if (heterogeneous) {
      require_in_box(tissue, body);
      field = std::make_unique<HeterogeneousDeformation<CompactKernels>>(
          tissue, load_compact_tissues(scene, *find_compact_rung(rung), body), options, stiffness);
    } else {
      field = std::make_unique<LadderDeformation>(
          tissue, rung, body,
          LadderDeformation::Options{.target = target,
                                     .threads = scene.engine.threads,
                                     .max_landmarks = landmarks,
                                     .landmark_stiffness_n_per_mm = stiffness});
    }
  } else {
    const Kernel kernel = *find_kernel(rung);
    const double radius = scene.model.support_radius_mm;
    if (heterogeneous) {
      field = std::make_unique<HeterogeneousDeformation<ScalarKernels>>(
          tissue, load_scalar_tissues(scene, kernel, radius), options, stiffness);
    } else {
      field = std::make_unique<Deformation>(tissue, kernel, radius, options, stiffness);
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
      needle_tissues_(load_needle_tissues(scene)),
      contact_solve_(max_landmarks(scene)),
      anchors_(make_anchors(scene, tissue_)),
      anchor_clearance_(scene.anchors.clearance_mm),
      field_(make_field(scene, tissue_)),
      seed_loading_(scene.seeds, scene.template_grid, load_plan(scene), scene.needle.count),
      implant_(static_cast<std::size_t>(scene.seeds.max_count)),
      block_ticks_(tissue_.blocks.size()),
      block_evaluated_(tissue_.blocks.size()) {
  for (std::size_t n = 0; n < scene.needle.count; ++n)
    contacts_.emplace_back(surface_, needle_tissues_, scene.needle, scene.contact);
  landmarks_.reserve(max_landmarks(scene));
  needles_.resize(scene.needle.count);
  pose_histories_.resize(scene.needle.count);
  displaced_.reserve(tissue_.blocks.size());
  was_displaced_.reserve(tissue_.blocks.size());
  for (auto& blocks : changed_) blocks.reserve(tissue_.blocks.size());
  rest_.reserve(3 * tissue_.size());
  for (const Vec3& X : tissue_.rest_vertices)
    for (int k = 0; k < 3; ++k) rest_.push_back(static_cast<float>(X[k]));
  deformed_ = rest_;
}

void Simulator::restore_seeds(std::span<const Seed> seeds) {
  implant_.restore(seeds);
  for (const Seed& seed : seeds) seed_loading_.take_out(seed.planned);
}

void Simulator::go_on_from(const Simulator& other) noexcept {
  tick_ = other.tick_;
  implant_ = other.implant_;
  implant_.move(tick_, *field_);
  seed_loading_ = other.seed_loading_;
  pose_histories_ = other.pose_histories_;
  for (std::size_t n = 0; n < needles_.size(); ++n) needles_[n].drops = other.needles_[n].drops;
}

MeshState Simulator::initial_state() const {
  MeshState state;
  state.deformed_vertices = rest_;
  state.block_ticks.assign(tissue_.blocks.size(), 0);
  state.needles = needles_;
  state.pose_histories = pose_histories_;
  state.seed_slots.resize(implant_.max_count());
  state.seed_ticks.resize(implant_.max_count());
  state.seed_count = static_cast<std::uint32_t>(implant_.seeds().size());
  std::ranges::copy(implant_.seeds(), state.seed_slots.begin());
  return state;
}

void Simulator::step(std::span<const NeedlePose> poses, MeshState& state) noexcept {
  ++tick_;
  touch(poses);
  gather_landmarks();
  deform();
  drop_seeds();
  write(state);
}

void Simulator::touch(std::span<const NeedlePose> poses) noexcept {
  flags_ = 0;
  for (std::size_t n = 0; n < contacts_.size(); ++n) {
    const NeedlePose pose = n < poses.size() ? poses[n] : NeedlePose{};
    needles_[n].present = pose.present;
    needles_[n].input = pose;
    needles_[n].X_WN = pose.X_WN;
    if (!pose.present) {
      contacts_[n].skip();
      continue;
    }
    pose_histories_[n][tick_ % MeshState::kPoseHistory] = {tick_, pose.X_WN, pose.button};
    contacts_[n].begin(pose.X_WN, field_.get());
    flags_ |= contacts_[n].flags();
  }
}

// No needle landmark, no landmarks at all: anchors alone hold nothing back.
void Simulator::gather_landmarks() noexcept {
  landmarks_.clear();
  double load = 0;
  bool touches = false;
  for (const NeedleContact& contact : contacts_) {
    touches |= !contact.landmarks().empty();
    load = std::max(load, contact.load());
  }
  anchors_.update(touches ? load : 0, period_s_);
  if (!touches) return;
  for (Vec3 anchor : anchors_.positions())
    if (keep_clear(anchor)) landmarks_.add(anchor, Vec3::Zero(), 0);
  landmarks_.anchors = landmarks_.positions.size();
  for (const bool tips : {false, true})
    for (std::size_t n = 0; n < contacts_.size(); ++n) {
      const auto of_needle = std::as_const(contacts_[n]).landmarks();
      for (std::size_t i = 0; i < of_needle.size(); ++i) {
        if ((contacts_[n].has_tip_landmark() && i + 1 == of_needle.size()) != tips) continue;
        landmarks_.add(of_needle[i].position, of_needle[i].if_stuck, of_needle[i].core_mm);
        landmarks_.owners.push_back({static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(i)});
      }
    }
}

// Moves an anchor aside that lies in a needle's way: left out once the tip comes near, it would let go of the tissue at
// once, and the force with it. False where several needles leave it no place.
bool Simulator::keep_clear(Vec3& anchor) const noexcept {
  for (const NeedleContact& contact : contacts_) {
    if (contact.landmarks().empty()) continue;
    const Vec3 on_line = contact.nearest_on_line(anchor), aside = anchor - on_line;
    const double distance = aside.norm();
    if (distance >= anchor_clearance_) continue;
    const Vec3 direction = distance > 0 ? Vec3(aside / distance) : contact.axis().unitOrthogonal();
    anchor = on_line + anchor_clearance_ * direction;
  }
  return std::ranges::none_of(contacts_, [&](const NeedleContact& contact) {
    return std::ranges::any_of(contact.landmarks(), [&](const NeedleLandmark& landmark) {
      return (landmark.position - anchor).norm() < 0.5 * anchor_clearance_;
    });
  });
}

void Simulator::deform() noexcept {
  changed_[tick_ % kChangeHistory].clear();
  if (!contact_solve_.solve(tick_, contacts_, landmarks_, *field_, flags_) ||
      !field_->update(landmarks_.positions, landmarks_.displacements, landmarks_.cores)) {
    flags_ |= kStepSolveFailed;  // the last field stands
    return;
  }
  flags_ |= field_->flags();
  ++evaluation_counts_[static_cast<std::size_t>(field_->evaluation())];
  if (field_->evaluation() == Evaluation::kIdle) return;
  apply_field();
  implant_.move(tick_, *field_);
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

void Simulator::drop_seeds() noexcept {
  for (std::size_t n = 0; n < needles_.size(); ++n) {
    seed_loading_.update(n, needles_[n].input);
    if (seed_loading_.asked_in_vain(n)) refuse_drop(n, DropRefusal::kNothingLoaded);
    while (const auto due = seed_loading_.due(n)) drop(n, *due);
  }
}

void Simulator::drop(std::size_t needle, const SeedDrop& due) noexcept {
  const ContactState contact = contacts_[needle].state();
  DropRefusal refusal = DropRefusal::kNotInTissue;
  if (contact == ContactState::kInserted || contact == ContactState::kThrough) {
    Seed seed;
    seed.tick = tick_;
    seed.t_s = static_cast<double>(tick_) * period_s_;
    seed.needle = static_cast<std::uint16_t>(needle);
    seed.planned = due.planned;
    seed.source = due.source;
    seed.air_kerma_strength_u = due.air_kerma_strength_u;
    seed.dropped = due.at;
    seed.dropped_axis = needles_[needle].X_WN.R.col(2);
    seed.gland_motion = mean_displacement();
    refusal = implant_.drop(seed, *field_, field_->certificate().verdict, contacts_[needle].material_tip());
  }
  if (refusal == DropRefusal::kNone) {
    seed_loading_.dropped(needle);
    ++needles_[needle].drops.dropped;
  } else if (seed_loading_.refused(needle)) {
    refuse_drop(needle, refusal);
  }
}

void Simulator::refuse_drop(std::size_t needle, DropRefusal why) noexcept {
  ++needles_[needle].drops.refused;
  needles_[needle].drops.last_refusal = why;
}

Vec3 Simulator::mean_displacement() const noexcept {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < rest_.size(); ++i) sum[static_cast<int>(i % 3)] += deformed_[i] - rest_[i];
  return sum / static_cast<double>(tissue_.size());
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

  const std::span<const Seed> seeds = implant_.seeds();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (i < state.seed_count && implant_.changed_tick(i) <= state.tick) continue;
    state.seed_slots[i] = seeds[i];
    state.seed_ticks[i] = implant_.changed_tick(i);
  }
  state.seed_count = static_cast<std::uint32_t>(seeds.size());

  state.tick = tick_;
  state.sim_time_s = static_cast<double>(tick_) * period_s_;
  for (std::size_t n = 0; n < needles_.size(); ++n) {
    const NeedleContact& contact = contacts_[n];
    needles_[n].contact = contact.state();
    needles_[n].insertion_depth_mm = contact.insertion_depth();
    needles_[n].tip_depth_mm = contact.tip_depth();
    needles_[n].landmark_count = static_cast<std::uint32_t>(contact.landmarks().size());
    needles_[n].puncture_count = contact.puncture_count();
    needles_[n].forces = contact.forces();
    needles_[n].local_model = contact.local_model();
  }
  state.needles = needles_;
  state.landmark_count = static_cast<std::uint32_t>(landmarks_.positions.size());
  state.step_flags = flags_;
  state.certificate = field_->certificate();
  state.certificate.condition = field_->condition();
  state.max_displacement_mm = max_displacement_;
  state.moved_vertices = moved_vertices_;
}

}  // namespace brachy
