#pragma once

#include <memory>

#include "core/brachytherapy/plan/plan.h"
#include "core/models/displacement_field.h"
#include "core/simulation/instruments.h"
#include "core/simulation/make_guarded_field.h"
#include "core/simulation/tick_landmarks.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy::test {

/// The parts of a tick by themselves, as Simulator has them, for a small phantom: 2,000 points.
struct TickParts {
  static Scene small_phantom() {
    Scene scene;
    scene.tissue.points = 2000;
    return scene;
  }
  explicit TickParts(const Scene& scene = small_phantom())
      : model(load_simulation_model(scene, load_tissue(scene).tissue)),
        field(make_guarded_field(*model)),
        instruments(*model, field->plain_field().knows_forces()),
        landmarks(*model, field->plain_field().gives_way()),
        contact_solve(model->max_landmarks(), model->settings.period_s),
        body(model->body_at_rest) {}

  /// One tick as far as the field, of needles with their tips at `tips`, along +z.
  void step(std::initializer_list<Vec3> tips) {
    std::vector<NeedlePose> poses;
    for (const Vec3& tip : tips) poses.push_back(needle_pose(pose_at(tip, Vec3::UnitZ())));
    step(poses);
  }
  void step(std::span<const NeedlePose> poses) {
    flags = instruments.begin(++tick, poses, *field, body.frame());
    landmarks.gather(instruments, body);
    is_solved = bool(contact_solve.solve(tick, instruments.needles(), instruments.probe(), landmarks.set(),
                                         field->plain_field(), flags)) &&
                bool(field->update(landmarks.set()));
  }

  std::shared_ptr<const SimulationModel> model;
  std::unique_ptr<GuardedField> field;
  Instruments instruments;
  TickLandmarks landmarks;
  ContactSolve contact_solve;
  BodyMotion body;
  std::uint64_t tick = 0;
  std::uint32_t flags = 0;
  bool is_solved = false;
};

/// Moves whole blocks by one displacement each.
class MovedBlocks : public DisplacementField {
 public:
  explicit MovedBlocks(std::size_t blocks) : u_(blocks) {}

  void move(std::uint32_t block, const Vec3& u) {
    touched_.push_back(block);
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
      u_[block].ux[i] = static_cast<float>(u.x());
      u_[block].uy[i] = static_cast<float>(u.y());
      u_[block].uz[i] = static_cast<float>(u.z());
    }
  }
  void rest() { touched_.clear(); }

  std::span<const std::uint32_t> touched() const override { return touched_; }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override { return u_[block]; }
  Vec3 displacement_at(const Vec3&) const noexcept override { return Vec3::Zero(); }
  void displacements_at(std::span<const Vec3>, std::span<Vec3>) noexcept override {}

 private:
  std::vector<std::uint32_t> touched_;
  std::vector<BlockDisplacement<float>> u_;
};

}  // namespace brachy::test
