#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

RigidTransform quarter_turn() {
  RigidTransform X;
  X.R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  X.p = {1.5, -2.0, 30.25};
  return X;
}

/// A parabola that ends 2 mm beside the tip of quarter_turn().
NeedleShape sample_shape() {
  NeedleShape shape;
  shape.is_bent = true;
  for (std::size_t k = 0; k < NeedleShape::kPoints; ++k) {
    const double s = static_cast<double>(k) / 16;
    shape.points[k] = {1.5 + 2 * s * s, -2.0, -169.75 + 200 * s};
  }
  shape.tip_axis = {0.0625, 0, 0.998046875};
  shape.tip_deflection = {2, 0, 0};
  return shape;
}

NeedleForces sample_forces() {
  return {{0.5, -0.25, 2}, {0, 0, 0}, {8, -4, 1}, {-128, 64, 16}, 2, 0.5, 1.25, 0.75};
}

std::size_t held(const HelloMessage& m) {
  return m.name.capacity() + m.software.capacity();
}
std::size_t held(const WelcomeMessage& m) {
  return m.server.capacity() + m.units.capacity() + m.frame.capacity();
}
std::size_t held(const TopologyMessage& m) {
  return m.triangles.capacity() * sizeof(Triangle) + m.rest_vertices.capacity() * 4 + m.name.capacity();
}
std::size_t held(const FrameMessage& m) {
  std::size_t bytes = m.poses_of_needles.capacity() * sizeof(NeedlePoses);
  for (const NeedlePoses& needle : m.poses_of_needles) bytes += needle.poses.capacity() * sizeof(TickPose);
  return bytes + m.needles.capacity() * sizeof(NeedleRecord) + m.ranges.capacity() * sizeof(PointRange) +
         m.positions.capacity() * 4 + m.pose_history.capacity() * sizeof(TickPose) +
         m.seeds.capacity() * sizeof(Seed);
}
std::size_t held(const PoseMessage&) {
  return 0;
}
std::size_t held(const StateMessage& m) {
  std::size_t bytes = m.device_holder.capacity() + m.refusals.capacity() * sizeof(PoseRefusals);
  for (const PoseRefusals& refusal : m.refusals) bytes += refusal.text.capacity();
  bytes += m.safety.capacity() * sizeof(SafetyCount);
  for (const SafetyCount& count : m.safety) bytes += count.text.capacity();
  return bytes;
}
std::size_t held(const EventMessage& m) {
  return m.text.capacity();
}
std::size_t held(const ErrorMessage& m) {
  return m.text.capacity();
}
std::size_t held(const PingMessage&) {
  return 0;
}
std::size_t held(const ForceMessage&) {
  return 0;
}
std::size_t held(const LocalModelMessage&) {
  return 0;
}
std::size_t held(const ArmMessage&) {
  return 0;
}
std::size_t held(const DropMessage&) {
  return 0;
}
std::size_t held(const LoadMessage&) {
  return 0;
}
std::size_t held(const ExerciseMessage& m) {
  return m.file.size() + m.trainee.size();
}
std::size_t held(const PlanMessage& m) {
  std::size_t bytes = m.by.capacity() + m.needles.capacity() * sizeof(PlanMessageNeedle);
  for (const PlanMessageNeedle& needle : m.needles) bytes += needle.hole.capacity() + needle.train.capacity();
  return bytes;
}
std::size_t held(const DoseMessage& m) {
  std::size_t bytes = (m.structures.capacity() + m.with_planned.capacity()) * sizeof(StructureDose);
  for (const auto* structures : {&m.structures, &m.with_planned})
    for (const StructureDose& dose : *structures)
      bytes += dose.name.capacity() + dose.volume_share.capacity() * 4;
  return bytes + m.surface_gy.capacity() * 4;
}
std::size_t held(const ControlMessage& m) {
  return m.kernel.capacity();
}
std::size_t held(const SceneMessage& m) {
  std::size_t bytes = m.planned_needles.capacity() * sizeof(ScenePlannedNeedle) +
                      m.planned_seeds.capacity() * sizeof(ScenePlannedSeed) +
                      m.structures.capacity() * sizeof(SceneStructure) +
                      m.kernels.capacity() * sizeof(std::string);
  for (const SceneStructure& structure : m.structures)
    bytes += structure.name.capacity() + structure.vertices.capacity() * 4 +
             structure.triangles.capacity() * sizeof(Triangle);
  for (const std::string& kernel : m.kernels) bytes += kernel.capacity();
  bytes += m.goals.capacity() * sizeof(SceneGoal) + m.colours.capacity() * sizeof(SceneColour);
  for (const SceneColour& colour : m.colours) bytes += colour.name.capacity();
  for (const SceneGoal& goal : m.goals)
    bytes += goal.structure.capacity() + goal.figure.capacity() + goal.source.capacity();
  return bytes;
}

std::size_t held(const ImageMessage& m) {
  return m.data.capacity();
}
std::size_t held(const ScannerMessage&) {
  return 0;
}
std::size_t held(const ContourMessage& m) {
  std::size_t bytes = m.slices.capacity() * sizeof(ContourSlice);
  for (const ContourSlice& slice : m.slices) bytes += slice.points.capacity() * 16;
  return bytes + (m.score ? m.score->planes.capacity() * sizeof(ContourPlaneScore) : 0);
}

template <class Message>
DecodeResult decode_as(std::span<const std::byte> body, Bytes& reencoded, std::size_t& held_bytes) {
  Message message;
  const DecodeResult result = decode_body(body, message);
  reencoded.clear();
  if (result.is_good()) encode_body(message, reencoded);
  held_bytes = held(message);
  return result;
}

}  // namespace

HelloMessage sample_hello() {
  HelloMessage hello;
  hello.role = Role::kDevice;
  hello.subscription = kSubscribePoseHistory;
  hello.limits.max_force_n = 3.3;
  hello.limits.max_stiffness_n_per_mm = 1.0;
  hello.limits.rate_hz = 1000;
  hello.name = "touch";
  hello.needle = 2;
  hello.device_flags = kEvaluatesLocalModel;
  return hello;
}

HelloMessage sample_hello_with_token() {
  HelloMessage hello;
  hello.role = Role::kOperator;
  hello.name = "desk";
  Token& token = hello.token.emplace();
  for (std::size_t i = 0; i < token.size(); ++i) token[i] = static_cast<std::byte>(0xE0 + i);
  hello.software = "desk 2.1";
  return hello;
}

HelloMessage sample_hello_with_images() {
  HelloMessage hello;
  hello.role = Role::kViewer;
  hello.subscription = kSubscribeUltrasound;
  hello.name = "screen";
  hello.image_flags = kTakesZlib;
  return hello;
}

WelcomeMessage sample_welcome() {
  WelcomeMessage welcome;
  welcome.session = 7;
  welcome.role = Role::kDevice;
  welcome.subscription = kSubscribePoseHistory;
  welcome.deformation_hz = 200;
  welcome.snapshot_hz = 30;
  welcome.max_message_bytes = 65536;
  welcome.max_poses_per_s = 2000;
  welcome.topology_hash = sample_topology().hash;
  welcome.server = "brachyd 0.1.0";
  welcome.needle = 2;
  welcome.needle_count = 3;
  welcome.limits = {3.5, 1, 0.0005, 1000, kDampingNotPlausible};
  return welcome;
}

TopologyMessage sample_topology() {
  TopologyMessage topology;
  topology.surface_vertex_count = 4;
  topology.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  topology.rest_vertices = {0, 0, 0, 10, 0, 0, 0, 10, 0, 0, 0, 10, 2.5, 2.5, 2.5};
  topology.name = "tetrahedron";
  topology.hash = topology_hash(topology);
  return topology;
}

FrameMessage sample_frame() {
  FrameMessage frame;
  frame.topology_hash = sample_topology().hash;
  frame.tick = 42;
  frame.sim_time_s = 0.21;
  frame.snapshot_sequence = 9;
  frame.base_tick = 40;
  frame.overruns = 3;
  frame.publish_ns = 2'000'000'000;
  frame.input_sequence = 17;
  frame.input_stamp_ns = 1'000'000'500;
  frame.input_received_ns = 1'999'990'000;
  frame.max_displacement_mm = 1.25;
  frame.step_flags = kStepSaturated | kStepSubstepped | kStepClamped | kStepLate | kStepSteep;
  frame.point_count = 5;
  frame.moved_vertices = 2;
  NeedleRecord needle;
  needle.state.present = true;
  needle.state.contact = ContactState::kInserted;
  needle.state.X_WN = quarter_turn();
  needle.state.insertion_depth_mm = 12.5;
  needle.state.landmark_count = 11;
  needle.state.puncture_count = 1;
  needle.state.input.sequence = 17;
  needle.state.input.stamp_ns = 1'000'000'500;
  needle.state.forces = sample_forces();
  needle.state.tip_depth_mm = 14.5;
  needle.state.shape = sample_shape();
  needle.has_forces = true;
  frame.needles = {needle};
  frame.ranges = {{1, 1}, {3, 1}};
  frame.positions = {10, 0.5, -0.25, 0, 0, 9};
  Certificate certificate;
  certificate.det_bound = 0.25;
  certificate.vertex_det = 0.5;
  certificate.place = {1.5, -2.0, 28};
  certificate.margin_mm = 0.75;
  certificate.substeps = 3;
  certificate.held_mm = 2.125;
  certificate.condition = 1024;
  frame.certificate = certificate;
  frame.has_pose_history = true;
  RigidTransform before;
  before.p = {0.5, 0.25, -40};
  frame.pose_history = {{41, before, true}, {42, quarter_turn(), true}};
  frame.poses_of_needles = {{1, {{42, before, true}}}};
  frame.has_seeds = true;
  frame.seed_count = 2;
  frame.seeds = {sample_seed()};
  frame.lag_mm = 0.375;
  return frame;
}

Seed sample_seed() {
  Seed seed;
  seed.id = 2;
  seed.tick = 40;
  seed.t_s = 0.2;
  seed.is_certified = true;
  seed.planned = 1;
  seed.air_kerma_strength_u = 0.5;
  seed.dropped = {1.5, -2.0, 28};
  seed.rest = {1.5, -2.0, 26.5};
  seed.gland_motion = {0, 0, 0.25};
  seed.position = {1.5, -2.0, 27.75};
  return seed;
}

PoseMessage sample_pose() {
  return {2, 0, quarter_turn()};
}

StateMessage sample_state() {
  StateMessage state;
  state.ticks = 1000;
  state.overruns = 3;
  state.control_overruns = 2;
  state.tick_ms = {1000, 0.25, 0.5, 0.75, 1.5};
  state.lateness_ms = {1000, 0.0625, 1, 2, 4};
  state.latency_ms = {900, 2.5, 5, 6, 8};
  state.poses_accepted = 900;
  state.refusals = {{kRefusedRate, 5, "too many"}};
  state.snapshots = 150;
  state.snapshots_sent = 140;
  state.snapshots_dropped = 10;
  state.clients = 4;
  state.viewers = 3;
  state.device_holder = "touch (127.0.0.1:5)";
  state.safety = {{2, 3, 7, "stalled"}};
  state.controls = {"psi31", 12, kScriptIsThere | kScriptPlays};
  state.events_dropped = 12;
  return state;
}

EventMessage sample_event() {
  return {EventKind::kPuncture, 0, 42, "capsule punctured"};
}
ErrorMessage sample_error() {
  return {ErrorCode::kPoseRefused, false, 3, 17, "not rigid"};
}
PingMessage sample_ping() {
  return {5, true, 2'000'000'007, 1'000'000'590};
}

ForceMessage sample_force() {
  return {2, kForceArmed | kForceRamping, 42, 17, 1'000'000'500, sample_forces()};
}

LocalModelMessage sample_local_model() {
  LocalModelMessage message;
  message.needle = 2;
  message.flags = kForceArmed | kForceLimited;
  message.input_sequence = 17;
  message.input_stamp_ns = 1'000'000'500;
  LocalContactModel& model = message.model;
  model.tick = 42;
  model.in_contact = true;
  model.is_capsule = true;
  model.is_stuck = false;
  model.reference_tip = {1.5, -2.0, 30.25};
  model.contact_point = {1.5, -2.0, 28};
  model.axis = {0, 0, 1};
  model.axial_stiffness_n_per_mm = 0.5;
  model.axial_min_n = -0.25;
  model.axial_max_n = std::numeric_limits<double>::infinity();
  model.after_puncture_n = 1.75;
  model.lateral_n = {0.125, -0.5, 0};
  model.lateral_stiffness_n_per_mm = 0.75;
  model.time_to_live_s = 0.05;
  message.max_force_n = 3.3;
  message.max_stiffness_n_per_mm = 1;
  message.max_slew_n_per_ms = 0.5;
  message.ramp_s = 0.5;
  return message;
}

ArmMessage sample_arm() {
  return {2};
}

DropMessage sample_drop() {
  return {2, true};
}

ContourMessage sample_contour() {
  ContourMessage contour;
  contour.about_sequence = 22;
  ContourSlice& slice = contour.slices.emplace_back();
  slice.slice = 3;
  slice.tick = 42;
  slice.probe_depth_mm = -5;
  slice.X_WI.R.diagonal() << 1, -1, -1;
  slice.X_WI.p = {-30, 40, 5};
  slice.points = {{20, 30}, {40, 30}, {30, 50.5}};
  contour.score = {0.75, 31.5, 30, 30.25, 5, 2.5, 1.5, 0.5, 5, 1, 0, {{3, 0, 205, 200, 0.75, 2.5}}};
  return contour;
}

LoadMessage sample_load() {
  return {2, 5};
}

ExerciseMessage sample_exercise() {
  return {"01_one_needle.toml", "Anna"};
}

PlanMessage sample_plan() {
  PlanMessage message;
  message.kind = PlanKind::kEdited;
  message.is_optimising = true;
  message.change = 2;
  message.air_kerma_strength_u = 0.5;
  message.by = "desk (127.0.0.1)";
  message.needles = {{4, true, 12, 80.5, "E7", "s-s--s"}, {9, false, 31, 78, "G5", "ss"}};
  return message;
}

DoseMessage sample_dose() {
  StructureDose prostate;
  prostate.name = "prostate";
  prostate.volume_cc = 47.5;
  prostate.mean_gy = 2.5;
  prostate.min_gy = 0.25;
  prostate.max_gy = 500;
  prostate.v100_percent = 0.5;
  prostate.v150_percent = 0.25;
  prostate.v200_percent = 0.125;
  prostate.v100_cc = 0.25;
  prostate.d90_gy = 0.5;
  prostate.d30_gy = 1.5;
  prostate.d10_gy = 3;
  prostate.d2cc_gy = std::numeric_limits<double>::quiet_NaN();
  prostate.volume_share = {1, 0.5, 0.25};
  return {2, 145, 1, {prostate}, {150, std::numeric_limits<float>::quiet_NaN()}, {}};
}

DoseMessage sample_dose_with_planned() {
  DoseMessage message = sample_dose();
  message.with_planned = message.structures;
  message.with_planned[0].d90_gy = 145;
  message.fraction = DosedFraction{4, 18, 30, 140.5};
  return message;
}

ControlMessage sample_control() {
  return {ControlAction::kModel, true, 18.5, "psi32"};
}

SceneMessage sample_scene() {
  SceneMessage scene;
  scene.needle_length_mm = 200;
  scene.needle_diameter_mm = 1.25;
  scene.seed_length_mm = 4.5;
  scene.seed_diameter_mm = 0.75;
  scene.prescription_gy = 145;
  scene.template_grid.rows = 12;
  scene.planned_needles = {{{5, -10, 20.5}, "G5"}};
  scene.planned_seeds = {{{5, -10, 18.25}, {0, 0, 1}, 0}};
  scene.structures = {{"urethra", {0, 0, 0, 1, 0, 0, 0, 1, 0.5}, {{0, 1, 2}}}};
  scene.kernels = {"psi31", "elastic"};
  scene.probe = SceneProbe{.needle = 3, .diameter_mm = 20, .length_mm = 150, .rectal_wall_mm = 4};
  scene.goals = {{"prostate", "D90", 130.5, true, false, "ABS"}};
  scene.colours = {{"urethra", 242, 201, 76}};
  scene.template_grid = scene.template_grid.named("right", true);
  return scene;
}

ImageMessage sample_image() {
  ImageMessage image;
  image.array = ScannerArray::kSagittal;
  image.flags = kImageHeld;
  image.width = 3;
  image.height = 2;
  image.sequence = 7;
  image.tick = 40;
  image.newest_tick = 42;
  image.publish_ns = 1'999'000'000;
  image.spacing_mm = 0.25;
  image.X_WI.R << 0, 0, -1, 0, -1, 0, -1, 0, 0;
  image.X_WI.p = Vec3(1.5, 60.5, -2.25);
  image.data = {0, 64, 128, 192, 255, 1};
  return image;
}

ScannerMessage sample_scanner() {
  ScannerMessage scanner;
  scanner.array = ScannerArray::kBiplane;
  scanner.freeze = ScannerFreeze::kLive;
  scanner.flags = kProbeIsStepped;
  scanner.tick = 42;
  scanner.depth_mm = 60;
  scanner.gain_db = -3;
  scanner.dynamic_range_db = 60;
  scanner.tgc_extra_db_per_cm = 0;
  scanner.focus_mm = 30;
  scanner.probe_depth_mm = -5;
  scanner.probe_rotation_deg = 15;
  return scanner;
}

std::vector<std::pair<MessageType, Bytes>> sample_bodies() {
  return {{MessageType::kHello, body_of(sample_hello())},
          {MessageType::kHello, body_of(sample_hello_with_token())},
          {MessageType::kHello, body_of(sample_hello_with_images())},
          {MessageType::kWelcome, body_of(sample_welcome())},
          {MessageType::kTopology, body_of(sample_topology())},
          {MessageType::kFrame, body_of(sample_frame())},
          {MessageType::kPose, body_of(sample_pose())},
          {MessageType::kState, body_of(sample_state())},
          {MessageType::kEvent, body_of(sample_event())},
          {MessageType::kError, body_of(sample_error())},
          {MessageType::kPing, body_of(sample_ping())},
          {MessageType::kForce, body_of(sample_force())},
          {MessageType::kLocalModel, body_of(sample_local_model())},
          {MessageType::kArm, body_of(sample_arm())},
          {MessageType::kDrop, body_of(sample_drop())},
          {MessageType::kDose, body_of(sample_dose())},
          {MessageType::kDose, body_of(sample_dose_with_planned())},
          {MessageType::kLoad, body_of(sample_load())},
          {MessageType::kExercise, body_of(sample_exercise())},
          {MessageType::kPlan, body_of(sample_plan())},
          {MessageType::kControl, body_of(sample_control())},
          {MessageType::kScene, body_of(sample_scene())},
          {MessageType::kImage, body_of(sample_image())},
          {MessageType::kScanner, body_of(sample_scanner())},
          {MessageType::kContour, body_of(sample_contour())}};
}

DecodeResult decode_any(MessageType type, std::span<const std::byte> body, Bytes& reencoded,
                        std::size_t& held_bytes) {
  switch (type) {
    case MessageType::kHello:
      return decode_as<HelloMessage>(body, reencoded, held_bytes);
    case MessageType::kWelcome:
      return decode_as<WelcomeMessage>(body, reencoded, held_bytes);
    case MessageType::kTopology:
      return decode_as<TopologyMessage>(body, reencoded, held_bytes);
    case MessageType::kFrame:
      return decode_as<FrameMessage>(body, reencoded, held_bytes);
    case MessageType::kPose:
      return decode_as<PoseMessage>(body, reencoded, held_bytes);
    case MessageType::kState:
      return decode_as<StateMessage>(body, reencoded, held_bytes);
    case MessageType::kEvent:
      return decode_as<EventMessage>(body, reencoded, held_bytes);
    case MessageType::kError:
      return decode_as<ErrorMessage>(body, reencoded, held_bytes);
    case MessageType::kPing:
      return decode_as<PingMessage>(body, reencoded, held_bytes);
    case MessageType::kForce:
      return decode_as<ForceMessage>(body, reencoded, held_bytes);
    case MessageType::kLocalModel:
      return decode_as<LocalModelMessage>(body, reencoded, held_bytes);
    case MessageType::kArm:
      return decode_as<ArmMessage>(body, reencoded, held_bytes);
    case MessageType::kDrop:
      return decode_as<DropMessage>(body, reencoded, held_bytes);
    case MessageType::kDose:
      return decode_as<DoseMessage>(body, reencoded, held_bytes);
    case MessageType::kLoad:
      return decode_as<LoadMessage>(body, reencoded, held_bytes);
    case MessageType::kExercise:
      return decode_as<ExerciseMessage>(body, reencoded, held_bytes);
    case MessageType::kPlan:
      return decode_as<PlanMessage>(body, reencoded, held_bytes);
    case MessageType::kControl:
      return decode_as<ControlMessage>(body, reencoded, held_bytes);
    case MessageType::kScene:
      return decode_as<SceneMessage>(body, reencoded, held_bytes);
    case MessageType::kImage:
      return decode_as<ImageMessage>(body, reencoded, held_bytes);
    case MessageType::kScanner:
      return decode_as<ScannerMessage>(body, reencoded, held_bytes);
    case MessageType::kContour:
      return decode_as<ContourMessage>(body, reencoded, held_bytes);
  }
  return DecodeResult::bad("unknown type");
}

}  // namespace brachy::net::test
