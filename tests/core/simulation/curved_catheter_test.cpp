// Catheters that follow a curved course of the plan: what they do to the tissue, and where they are drawn.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include <unistd.h>

#include "core/base/error.h"
#include "core/brachytherapy/hdr/catheter_course.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/simulation/delivered_catheters.h"
#include "core/simulation/state_hash.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

using test::needle_pose;
using test::pose_at;

/// An arc of a circle through the phantom, from the tip backwards, which ends in front of it; turned by `degrees` in
/// all, in chords of a millimetre.
std::vector<Vec3> arc(double degrees, double length = 90, const Vec3& tip = {2, -4, 14}) {
  const double turn = degrees / length * std::numbers::pi / 180;  // for each mm
  std::vector<Vec3> course;
  for (double s = 0; s <= length; s += 1) {
    const double x = turn == 0 ? 0 : (1 - std::cos(turn * s)) / turn;
    const double z = turn == 0 ? s : std::sin(turn * s) / turn;
    course.push_back(tip + Vec3(x, 0.1 * x, -z));
  }
  return course;
}

/// A scene with one catheter of that course.
struct CatheterScene {
  explicit CatheterScene(std::vector<Vec3> points) : course(std::move(points)) {
    scene.tissue.points = 2000;
    scene.implant.kind = "hdr";
    scene.template_grid.origin_mm.z() = -60;
    HdrPlan plan;
    plan.name = "curved";
    plan.catheters = {{.hole = {},
                       .tip_mm = 0,
                       .dwell_s = {5, 5, 5},
                       .name = "a3.5",
                       .course = course,
                       .dwell_mm = {5, 10, 15}}};
    std::ofstream(file) << to_toml(plan, scene.template_grid);
    scene.plan_file = file.string();
  }
  ~CatheterScene() { std::filesystem::remove(file); }

  std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("curved_" + std::to_string(::getpid()) + ".toml");
  std::vector<Vec3> course;
  Scene scene;
};

/// Flies a catheter along its course.
class Flight {
 public:
  Flight(const Scene& scene, const std::vector<Vec3>& course)
      : course_(course), simulator(load_simulation_model(scene, load_tissue(scene).tissue)) {}

  const NeedleState& step_at(double offset) {
    simulator.step(
        needle_pose(pose_at(point_along(course_, offset).position, course_direction(course_, offset))),
        state);
    flags |= state.summary.step_flags;
    hash.add(state);
    return state.needles.states[0];
  }
  const NeedleState& go(double from, double to, double stride) {
    const int steps = static_cast<int>(std::ceil(std::abs(to - from) / stride));
    for (int k = 0; k <= steps; ++k) step_at(from + (to - from) * k / steps);
    return state.needles.states[0];
  }
  double moved_mm() const { return state.summary.max_displacement_mm; }

 private:
  std::vector<Vec3> course_;

 public:
  Simulator simulator;
  MeshState state = simulator.initial_state();
  std::uint32_t flags = 0;
  StateHash hash;
};

/// Tissue that takes no force along a needle.
void make_smooth(Scene& scene) {
  TissueContact& contact = scene.tissue.contact;
  contact.puncture_force_n = contact.cutting_force_n = contact.friction_n_per_mm = 0;
}

// A straight needle at the tip's pose would move tissue by 1.0 mm for a turn of 10°, and by 3.6 mm for 30°.
TEST(CurvedCatheter, GoesThroughTissueAlongItsCourseAndSweepsNothingAside) {
  for (const double degrees : {10., 20., 30., 45.}) {
    CatheterScene made(arc(degrees));
    make_smooth(made.scene);
    Flight flight(made.scene, made.course);
    const NeedleState& needle = flight.go(80, 0, 0.25);
    EXPECT_EQ(needle.contact, ContactState::kInserted);
    EXPECT_LT(flight.moved_mm(), 0.04) << degrees;  // 0.023 mm for 30°, 0.033 for 45°
    EXPECT_LT(needle.forces.lateral_n, 0.02) << degrees;
    EXPECT_EQ(flight.flags & (kStepReinitialized | kStepSaturated | kStepFolded), 0u) << degrees;
    const CutPath& path = flight.simulator.needles()[0].path();
    for (double s = 0; s <= path.length(); s += 1)
      EXPECT_LT(nearest_place(made.course, path.at(s)).distance_mm, 0.05) << degrees << ": " << s;
  }
}

// The same tissue, the same forces: of as much shaft as a straight needle has.
TEST(CurvedCatheter, TakesTheForcesOfAsMuchShaftAsAStraightNeedle) {
  CatheterScene bent(arc(20)), straight(arc(0));
  Flight flight(bent.scene, bent.course), other(straight.scene, straight.course);
  const NeedleState& needle = flight.go(80, 0, 0.05);
  const NeedleState& there = other.go(80, 0, 0.05);
  EXPECT_NEAR(needle.insertion_depth_mm, there.insertion_depth_mm, 2.5);
  EXPECT_NEAR(needle.forces.friction_n / needle.insertion_depth_mm,
              there.forces.friction_n / there.insertion_depth_mm, 2e-3);
  EXPECT_NEAR(needle.forces.cutting_n, there.forces.cutting_n, 0.1);
  EXPECT_NEAR(flight.moved_mm() / other.moved_mm(), 1, 0.15);
}

// To the last bits a needle along its own straight line is the needle that has no course.
TEST(CurvedCatheter, OfAStraightCourseIsAStraightNeedle) {
  CatheterScene made(arc(0));
  Flight with(made.scene, made.course);
  made.scene.plan_file.clear();
  Flight without(made.scene, made.course);
  for (const auto& [from, to] : {std::pair(80., 0.), std::pair(0., 20.), std::pair(20., 5.)})
    for (double k = 0; k <= 100; ++k) {
      const double offset = from + (to - from) * k / 100;
      const NeedleState& a = with.step_at(offset);
      const NeedleState& b = without.step_at(offset);
      ASSERT_EQ(a.contact, b.contact) << offset;
      ASSERT_LT((a.forces.force_n - b.forces.force_n).norm(), 1e-7) << offset;
      ASSERT_NEAR(a.forces.axial_n, b.forces.axial_n, 1e-7) << offset;
      ASSERT_NEAR(a.local_model.axial_stiffness_n_per_mm, b.local_model.axial_stiffness_n_per_mm, 1e-7);
      ASSERT_NEAR(with.moved_mm(), without.moved_mm(), 1e-7) << offset;
    }
}

// Pushed aside it takes the tissue along its whole curve, by what it is pushed.
TEST(CurvedCatheter, PushedAsideTakesTheTissueAlong) {
  CatheterScene made(arc(30));
  make_smooth(made.scene);
  Flight flight(made.scene, made.course);
  flight.go(80, 0, 0.25);
  const RigidTransform X_WN = flight.state.needles.states[0].X_WN;
  for (int k = 1; k <= 20; ++k) {
    RigidTransform aside = X_WN;
    aside.p.y() += 0.1 * k;
    flight.simulator.step(needle_pose(aside), flight.state);
  }
  const CutPath& path = flight.simulator.needles()[0].path();
  for (double s = 2.5; s <= path.length() - 2.5; s += 5) {
    const Vec3 u = flight.simulator.field().displacement_at(path.at(s));
    EXPECT_NEAR(u.y(), 2, 0.25) << s;
    EXPECT_LT(u.head<1>().norm(), 0.35) << s;
  }
  EXPECT_GT(flight.state.needles.states[0].forces.lateral_n, 0.3);
}

TEST(CurvedCatheter, IsDrawnAlongItsCourse) {
  CatheterScene made(arc(30));
  make_smooth(made.scene);
  Flight flight(made.scene, made.course);
  const NeedleState needle = flight.go(80, 3, 0.5);
  ASSERT_TRUE(needle.shape.is_bent);
  EXPECT_EQ(needle.shape.tip_deflection, Vec3(Vec3::Zero()));
  EXPECT_EQ(needle.shape.tip_axis, Vec3(needle.X_WN.R.col(2)));
  EXPECT_LT((needle.shape.points.back() - needle.X_WN.p).norm(), 1e-12);
  // 12.5 mm apart from the tip backwards; what is beyond the course's end goes on straight.
  for (std::size_t k = 0; k < NeedleShape::kPoints; ++k) {
    const Vec3& p = needle.shape.points[NeedleShape::kPoints - 1 - k];
    EXPECT_LT((p - point_along(made.course, 3 + 12.5 * static_cast<double>(k)).position).norm(), 1e-3) << k;
  }
  // Between them pictures go along a spline; in its last piece it is 0.07 mm off.
  for (double s = 0; s < 80; s += 1)
    EXPECT_LT((point_behind_tip(needle, 200, s) - point_along(made.course, 3 + s).position).norm(), 0.1) << s;
}

// In the tissue at once, as where a session is taken up: along its curve, without a force.
TEST(CurvedCatheter, ThatStartsInTheTissueLiesAlongItsCourse) {
  CatheterScene made(arc(30));
  Flight flight(made.scene, made.course);
  const NeedleState& needle = flight.step_at(0);
  EXPECT_EQ(needle.contact, ContactState::kInserted);
  EXPECT_LT(needle.forces.force_n.norm(), 0.02);
  EXPECT_LT(flight.moved_mm(), 0.02);
  const CutPath& path = flight.simulator.needles()[0].path();
  EXPECT_GT(path.length(), 30);
  for (double s = 0; s <= path.length(); s += 1)
    EXPECT_LT(nearest_place(made.course, path.at(s)).distance_mm, 0.1) << s;
}

TEST(CurvedCatheter, DrawnOutLeavesTheTissueAtRest) {
  CatheterScene made(arc(30));
  Flight flight(made.scene, made.course);
  flight.go(80, 0, 0.25);
  EXPECT_GT(flight.moved_mm(), 0.5);
  const NeedleState& needle = flight.go(0, 80, 0.25);
  EXPECT_EQ(needle.contact, ContactState::kWithdrawn);
  EXPECT_EQ(flight.moved_mm(), 0);
  // Again along the same way it follows its old cut: friction only.
  const NeedleState& again = flight.go(80, 10, 0.25);
  EXPECT_EQ(again.contact, ContactState::kInserted);
  EXPECT_NEAR(again.forces.cutting_n, 0, 1e-9);
  EXPECT_GT(again.forces.friction_n, 0.2);
}

// Far from its course it is a straight needle; in the tissue that is a jump, and told.
TEST(CurvedCatheter, FarFromItsCourseIsStraight) {
  CatheterScene made(arc(30));
  make_smooth(made.scene);
  Flight flight(made.scene, made.course);
  RigidTransform X_WN = pose_at(made.course.front() + Vec3(-14, 0, 0), Vec3::UnitZ());
  flight.simulator.step(needle_pose(X_WN), flight.state);
  EXPECT_TRUE(flight.state.needles.states[0].shape.is_bent);
  EXPECT_EQ(flight.state.needles.states[0].contact, ContactState::kInserted);
  X_WN.p.x() -= 1.5;
  flight.simulator.step(needle_pose(X_WN), flight.state);
  EXPECT_FALSE(flight.state.needles.states[0].shape.is_bent);
  EXPECT_NE(flight.state.summary.step_flags & kStepReinitialized, 0u);
}

TEST(CurvedCatheter, GoesOnFromASavedStateBitForBit) {
  CatheterScene made(arc(30));
  Flight flight(made.scene, made.course);
  flight.go(80, 12, 0.25);
  std::vector<std::byte> bytes;
  flight.simulator.save(bytes);
  Flight other(made.scene, made.course);
  other.simulator.restore(bytes);
  other.state = other.simulator.initial_state();
  flight.hash = {};
  flight.go(12, 2, 0.25);
  other.go(12, 2, 0.25);
  EXPECT_EQ(flight.hash.value(), other.hash.value());
  // Of another course the state is another scene's.
  CatheterScene elsewhere(arc(31));
  Flight third(elsewhere.scene, elsewhere.course);
  EXPECT_THROW(third.simulator.restore(bytes), UserError);
}

TEST(CurvedCatheter, TicksDoNotAllocate) {
  CatheterScene made(arc(30));
  Flight flight(made.scene, made.course);
  flight.go(80, 20, 0.5);
  std::vector<NeedlePose> poses;
  for (double offset = 20; offset >= 0; offset -= 0.5)
    poses.push_back(needle_pose(
        pose_at(point_along(made.course, offset).position, course_direction(made.course, offset))));
  const std::uint64_t before = test::allocation_count();
  for (const NeedlePose& pose : poses) flight.simulator.step(pose, flight.state);
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace brachy
