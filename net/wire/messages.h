#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/geometry/surface/surface_mesh.h"
#include "core/simulation/mesh_state.h"

/// The messages of the native protocol as plain structs, one per section of net/PROTOCOL.md, which says what each
/// field means and where its bytes lie. Lengths mm, world frame W = patient RAS; stamps ns of the sender's
/// monotonic clock unless said otherwise. Every enumeration goes over the wire: append only.
namespace brachy::net {

constexpr std::uint32_t kMagic = 0x59435242;  ///< bytes 42 52 43 59, "BRCY"
constexpr std::uint16_t kProtocolVersion = 1;
constexpr std::size_t kHeaderSize = 32;     ///< bytes
constexpr std::size_t kMaxNameBytes = 64;   ///< client name, server name, units, frame, topology name
constexpr std::size_t kMaxTextBytes = 512;  ///< texts of EVENT and ERROR, device holder

enum class MessageType : std::uint16_t {
  kHello = 1,
  kWelcome = 2,
  kTopology = 3,
  kFrame = 4,
  kPose = 5,
  kState = 6,
  kEvent = 7,
  kError = 8,
  kPing = 9,
  kForce = 10,
  kLocalModel = 11,
  kArm = 12,
  kDrop = 13,
  kDose = 14,
  kControl = 15,
  kScene = 16,
  kImage = 17,
  kScanner = 18,
  kLoad = 19,
  kPlan = 20,
  kContour = 21,
  kExercise = 22,
};

/// Types of which a client never sends a message, and a server never one; the others go both ways.
constexpr bool only_servers_send(MessageType type) {
  switch (type) {
    case MessageType::kWelcome:
    case MessageType::kTopology:
    case MessageType::kFrame:
    case MessageType::kEvent:
    case MessageType::kForce:
    case MessageType::kLocalModel:
    case MessageType::kDose:
    case MessageType::kScene:
    case MessageType::kImage:
      return true;
    default:
      return false;
  }
}
constexpr bool only_clients_send(MessageType type) {
  switch (type) {
    case MessageType::kHello:
    case MessageType::kPose:
    case MessageType::kArm:
    case MessageType::kDrop:
    case MessageType::kControl:
    case MessageType::kLoad:
    case MessageType::kExercise:
      return true;
    default:
      return false;
  }
}

struct Header {
  std::uint16_t version = kProtocolVersion;
  MessageType type = MessageType::kHello;  ///< may hold a value not listed: skip such a message
  std::uint32_t flags = 0;                 ///< reserved, 0
  std::uint32_t length = 0;                ///< bytes of the body
  std::uint64_t sequence = 0;              ///< per connection and direction: 1, 2, 3, …
  std::int64_t stamp_ns = 0;
};

enum class Role : std::uint16_t { kViewer = 1, kDevice = 2, kOperator = 3 };

/// Bits of HelloMessage::subscription.
enum Subscription : std::uint32_t {
  kSubscribeFullFrames = 1u << 0,   ///< every FRAME carries all points instead of the changes
  kSubscribePoseHistory = 1u << 1,  ///< FRAMEs carry the section POSE_HISTORY
  kSubscribeSurface = 1u << 2,      ///< TOPOLOGY and FRAMEs hold the surface vertices alone
  kSubscribeNoMesh = 1u << 3,       ///< neither TOPOLOGY nor FRAME is sent (a plain device)
  kSubscribeScene = 1u << 4,        ///< SCENE comes after TOPOLOGY
  kSubscribeUltrasound = 1u << 5,   ///< SCANNER and IMAGEs are sent, where the server has ultrasound
  kSubscribePlan = 1u << 6,         ///< PLAN is sent, where there is one, and whenever it changes
};

/// Capabilities of a haptic device; NaN = not stated.
struct DeviceLimits {
  double max_force_n = std::numeric_limits<double>::quiet_NaN();
  double max_stiffness_n_per_mm = std::numeric_limits<double>::quiet_NaN();
  double damping_n_s_per_mm = std::numeric_limits<double>::quiet_NaN();
  double rate_hz = std::numeric_limits<double>::quiet_NaN();
};

/// What was negotiated with a device: its plausible limits, and defaults.
struct NegotiatedLimits {
  double max_force_n = 0, max_stiffness_n_per_mm = 0, damping_n_s_per_mm = 0, rate_hz = 0;
  std::uint32_t not_plausible = 0;  ///< stated, but replaced by the default: ImplausibleLimit bits

  bool operator==(const NegotiatedLimits&) const = default;
};
enum ImplausibleLimit : std::uint32_t {
  kForceNotPlausible = 1u << 0,
  kStiffnessNotPlausible = 1u << 1,
  kDampingNotPlausible = 1u << 2,
  kRateNotPlausible = 1u << 3,
};

constexpr std::uint16_t kAnyNeedle = 0xFFFF;  ///< in HELLO: any free one; in WELCOME: none was granted

/// Bits of HelloMessage::device_flags.
enum DeviceFlag : std::uint16_t {
  kEvaluatesLocalModel = 1u << 0,  ///< computes its force from LOCAL_MODEL beside the device, at its own rate
};

/// Bits of HelloMessage::image_flags.
enum ImageRequestFlag : std::uint16_t {
  kTakesZlib = 1u << 0,    ///< pixels of IMAGE may come compressed
  kScannerOnly = 1u << 1,  ///< SCANNER comes, and no IMAGE: for recordings
};

/// A client's authentication: net/access/token_file.h.
constexpr std::size_t kTokenBytes = 32;
using Token = std::array<std::byte, kTokenBytes>;

struct HelloMessage {
  static constexpr MessageType kType = MessageType::kHello;
  Role role = Role::kViewer;
  std::uint32_t subscription = 0;  ///< Subscription bits
  DeviceLimits limits;
  std::string name;
  std::uint16_t needle = kAnyNeedle;  ///< requested; section DEVICE, left out where both have their default
  std::uint16_t device_flags = 0;     ///< DeviceFlag bits
  std::optional<Token> token;         ///< section TOKEN; never in a log or another message
  std::string software;               ///< name and version; section SOFTWARE, left out where empty
  std::uint16_t image_flags = 0;      ///< ImageRequestFlag bits; section IMAGES, left out where 0
};

struct WelcomeMessage {
  static constexpr MessageType kType = MessageType::kWelcome;
  std::uint64_t session = 0;
  Role role = Role::kViewer;       ///< granted
  std::uint32_t subscription = 0;  ///< granted bits
  double deformation_hz = 0;
  double snapshot_hz = 0;
  std::uint32_t max_message_bytes = 0;  ///< largest body the server accepts
  std::uint32_t max_poses_per_s = 0;
  std::uint64_t topology_hash = 0;
  std::string server;  ///< name and version
  std::string units = "mm,s,N";
  std::string frame = "RAS";
  std::uint16_t needle = kAnyNeedle;       ///< granted to a device
  std::uint16_t needle_count = 1;          ///< of the scene: ids 0 … count − 1
  std::optional<NegotiatedLimits> limits;  ///< of a device; section LIMITS
};

struct TopologyMessage {
  static constexpr MessageType kType = MessageType::kTopology;
  std::uint64_t hash = 0;  ///< topology_hash() of what follows
  std::uint32_t surface_vertex_count = 0;
  std::vector<Triangle> triangles;   ///< of the surface, outward
  std::vector<float> rest_vertices;  ///< 3N: x0 y0 z0 x1 …, surface vertices first, world frame, mm
  std::string name;
};

/// Points [first, first + count).
struct PointRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  bool operator==(const PointRange&) const = default;
};

/// Of `state` a FRAME carries neither the local model nor, of the input, more than sequence and stamp. Of a needle that
/// bends it carries the shape (section NEEDLE_SHAPES), its points rounded to f32.
struct NeedleRecord {
  std::uint16_t id = 0;
  NeedleState state;
  bool has_forces = false;  ///< state.forces and the input's sequence and stamp are known (section FORCE)
};

/// One needle's part of section POSES_OF_NEEDLES.
struct NeedlePoses {
  std::uint16_t needle = 0;
  std::vector<TickPose> poses;  ///< ascending ticks
};

struct FrameMessage {
  static constexpr MessageType kType = MessageType::kFrame;
  std::uint64_t topology_hash = 0;
  std::uint64_t tick = 0;
  double sim_time_s = 0;
  std::uint64_t snapshot_sequence = 0;  ///< of the server; a jump = snapshots dropped for this client
  std::uint64_t base_tick = 0;          ///< the ranges hold every point changed after this tick
  std::uint64_t overruns = 0;
  std::int64_t publish_ns = 0;         ///< server's clock
  std::uint64_t input_sequence = 0;    ///< header sequence of the last-arrived POSE this tick used, 0 = none
  std::int64_t input_stamp_ns = 0;     ///< that POSE's header stamp (device's clock)
  std::int64_t input_received_ns = 0;  ///< when it arrived (server's clock)
  double max_displacement_mm = 0;
  std::uint32_t step_flags = 0;  ///< StepFlag bits
  bool full = false;             ///< one range with every point; base_tick is 0
  std::uint32_t point_count = 0;
  std::uint32_t moved_vertices = 0;
  std::vector<NeedleRecord> needles;
  std::vector<PointRange> ranges;  ///< ascending, disjoint, not empty
  std::vector<float> positions;    ///< 3 per point of the ranges, in order; world frame, mm
  std::optional<Certificate>
      certificate;                ///< of the tick's field; none: the section was not there, nothing is known
  bool has_pose_history = false;  ///< the section was there (it may be empty)
  std::vector<TickPose> pose_history;         ///< of needle 0, ascending ticks
  std::vector<NeedlePoses> poses_of_needles;  ///< of needles 1 …; empty: the section was not there
  bool has_seeds = false;                     ///< the section was there: seeds have fallen
  std::uint32_t seed_count = 0;               ///< in the tissue
  std::vector<Seed> seeds;                    ///< those that fell or moved after base_tick, ascending ids
  double lag_mm = Certificate::kNotKnown;     ///< TickSummary::lag_mm; NaN: the section was not there
};

/// Sections of a FRAME. Absent means "not known", not zero.
enum class FrameSection : std::uint16_t {
  kForce = 1,
  kSeeds = 2,
  kCertificate = 3,
  kPoseHistory = 4,
  kPosesOfNeedles = 5,
  kButtons = 6,
  kNeedleShapes = 7,
  kLag = 8,
};

struct PoseMessage {
  static constexpr MessageType kType = MessageType::kPose;
  std::uint16_t needle = 0;  ///< the device's own
  std::uint16_t flags = 0;   ///< reserved, 0
  RigidTransform X_WN;       ///< as received: not checked for rigidity or NaN
};

/// Bits of ForceMessage::flags and LocalModelMessage::flags.
enum ForceFlag : std::uint16_t {
  kForceArmed = 1u << 0,    ///< force may be rendered
  kForceRamping = 1u << 1,  ///< between two gains, or limited by the slew limit
  kForceLatched = 1u << 2,  ///< a fault: no force until ARM
  kForceLimited = 1u << 3,  ///< force scaled to max_force_n, or a stiffness cut to max_stiffness_n_per_mm
  kForceExpired = 1u << 4,  ///< the local model is past its time to live: the force goes to 0
};

/// The force to render now, and what it was computed from.
struct ForceMessage {
  static constexpr MessageType kType = MessageType::kForce;
  std::uint16_t needle = 0;
  std::uint16_t flags = 0;           ///< ForceFlag bits
  std::uint64_t tick = 0;            ///< of the simulation it was computed from
  std::uint64_t input_sequence = 0;  ///< header sequence of the POSE it answers, 0 = none
  std::int64_t input_stamp_ns = 0;   ///< that POSE's header stamp (device's clock)
  NeedleForces forces;               ///< limited; finite
  std::uint16_t valid_ms = 0;        ///< from its arrival on; then the device takes it to 0; 0: 50 ms
};

/// What a device needs to compute its force itself until the next one arrives.
struct LocalModelMessage {
  static constexpr MessageType kType = MessageType::kLocalModel;
  std::uint16_t needle = 0;
  std::uint16_t flags = 0;  ///< ForceFlag bits
  std::uint64_t input_sequence = 0;
  std::int64_t input_stamp_ns = 0;
  LocalContactModel model;  ///< its stiffnesses within the limit below; only its three bounds may be infinite
  double max_force_n = 0;   ///< negotiated, also below
  double max_stiffness_n_per_mm = 0;
  double max_slew_n_per_ms = 0;  ///< of the rendered force, always
  double ramp_s = 0;             ///< gain 0 → 1 after connecting or ARM
};

/// Ends a latched fault of a needle. From its device, or from an operator.
struct ArmMessage {
  static constexpr MessageType kType = MessageType::kArm;
  std::uint16_t needle = 0;
};

/// The button of a needle's device went down or up, which drops seeds (core/brachytherapy/seeds/seed_loading.h). From
/// its device.
struct DropMessage {
  static constexpr MessageType kType = MessageType::kDrop;
  std::uint16_t needle = 0;
  bool pressed = false;
};

/// An operator loads a needle with the seeds of one of the plan's (core/brachytherapy/seeds/seed_loading.h).
struct LoadMessage {
  static constexpr MessageType kType = MessageType::kLoad;
  static constexpr std::uint16_t kNothing = 0xFFFF;
  std::uint16_t needle = 0;  ///< the device's
  std::uint16_t plan_needle =
      kNothing;  ///< index in SCENE's planned needles; kNothing: as if nobody had loaded it
};

/// Where a plan comes from; of a request, what is to be done. May hold a value not listed: of a request refuse it.
enum class PlanKind : std::uint16_t {
  kFile = 1,       ///< of the scene's file; never in a request
  kOptimised = 2,  ///< in a request: optimise the rest, for what lies in the body, and give no needles
  kEdited = 3,     ///< in a request: the rest is to be these needles
};

/// One needle of a plan. Of a request the first three are not looked at.
struct PlanMessageNeedle {
  std::uint16_t number = 0;      ///< that LOAD names; never used for another needle
  bool is_begun = false;         ///< a seed has left it: it stays as it is
  std::uint32_t first_seed = 0;  ///< number of its first seed, which Seed::planned counts; the others follow
  double depth_mm = 0;           ///< of its tip beyond the template; NaN in a request: by the loading rule
  std::string hole;              ///< "E7"
  std::string train;             ///< PlanNeedle::train; empty in a request: by the loading rule
};

/// From a server: the plan in use, the needles that were begun and the rest. From an operator: a request to change the
/// rest.
struct PlanMessage {
  static constexpr MessageType kType = MessageType::kPlan;
  static constexpr std::size_t kMostNeedles = 4096;

  PlanKind kind = PlanKind::kFile;
  bool is_optimising = false;  ///< from a server: a request to optimise is being carried out
  std::uint32_t change = 0;    ///< the changes since the file; in a request: of the plan that it goes on from
  double air_kerma_strength_u = 0;  ///< of each seed; not looked at in a request, as `by`
  std::string by;                   ///< who or what made it: a file, or "NAME (ADDRESS)"
  std::vector<PlanMessageNeedle> needles;
};

/// Catheters of an afterloader that are in the tissue: what a fraction would give that is given now.
struct DosedFraction {
  std::uint32_t catheters = 0, planned_catheters = 0;  ///< that are in the dose; of the plan
  std::uint32_t dwells = 0;                            ///< of those catheters, with a time
  double seconds = 0;                                  ///< of these dwells
  bool operator==(const DosedFraction&) const = default;
};

/// The dose of all seeds in the tissue at rest, by structure; or, with a fraction, of the source's dwells in the
/// catheters in place.
struct DoseMessage {
  static constexpr MessageType kType = MessageType::kDose;
  std::uint32_t seeds = 0;  ///< that are in it
  double prescription_gy = 0;
  double air_kerma_strength_u = 0;  ///< of all of them
  std::vector<StructureDose> structures;
  std::vector<float> surface_gy;  ///< at each surface vertex at rest; NaN = not known; empty: none of it is
  /// With the planned seeds that have not left their needles where the plan has them; empty: there is no plan.
  std::vector<StructureDose> with_planned;
  std::optional<DosedFraction> fraction = std::nullopt;  ///< then there are no seeds
};

enum class ControlAction : std::uint16_t {
  kPlay = 1,   ///< the scripted needle starts from its beginning
  kStop = 2,   ///< … and is removed
  kReset = 3,  ///< tissue, needles and seeds from scratch
  kModel = 4,  ///< another kernel or support from now on
};

/// An operator's request to the running simulation.
struct ControlMessage {
  static constexpr MessageType kType = MessageType::kControl;
  ControlAction action = ControlAction::kPlay;  ///< may hold a value not listed: refuse it
  bool loop = false;                            ///< kPlay: repeat
  double support_radius_mm = std::numeric_limits<double>::quiet_NaN();  ///< kModel; NaN: as it is
  std::string kernel;                                                   ///< kModel; empty: as it is
};

struct ScenePlannedNeedle {
  Vec3 tip = Vec3::Zero();  ///< planned position, mm
  std::string hole;
};
struct ScenePlannedSeed {
  Vec3 position = Vec3::Zero();  ///< mm
  Vec3 axis = Vec3::UnitZ();
  std::uint32_t needle = 0;  ///< of SceneMessage::planned_needles
};
struct SceneStructure {
  std::string name;
  std::vector<float> vertices;  ///< 3 a vertex, at rest, mm
  std::vector<Triangle> triangles;
};

/// A transrectal ultrasound probe: a cylinder with a round tip.
struct SceneProbe {
  std::uint16_t needle = 0;  ///< its number among the needles of FRAME, which bring its pose
  double diameter_mm = 0, length_mm = 0;
  double rectal_wall_mm = 0;  ///< between it and the gland
};

/// What a figure of the dose should be.
struct SceneGoal {
  std::string structure, figure;  ///< "prostate", "V100"
  double limit = 0;               ///< in the figure's unit: %, cm³ or Gy
  bool is_above = false;          ///< of the limit the figure should be; else below
  bool is_of_plan = false;        ///< else of the implant
  std::string source;             ///< who recommends it
};

/// In what colour a structure is shown.
struct SceneColour {
  std::string name;  ///< of SceneMessage::structures or of DOSE, such as "prostate", the tissue; once
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// What surrounds the tissue and does not change while the daemon runs; world frame W.
struct SceneMessage {
  static constexpr MessageType kType = MessageType::kScene;
  double needle_length_mm = 0, needle_diameter_mm = 0;
  double seed_length_mm = 0, seed_diameter_mm = 0;
  double prescription_gy = 0;
  /// By what names its holes are to be shown; in the messages they are named_as_on_wire.
  TemplateGrid template_grid;
  std::vector<ScenePlannedNeedle> planned_needles;
  std::vector<ScenePlannedSeed> planned_seeds;  ///< in the plan's order
  std::vector<SceneStructure> structures;       ///< all but the tissue itself
  std::vector<std::string> kernels;             ///< that kModel accepts
  std::optional<SceneProbe> probe;
  std::vector<SceneGoal> goals;
  std::vector<SceneColour> colours;  ///< of structures whose file has one
};

/// Which array of a transrectal probe. May hold a value not listed: of IMAGE show it, of SCANNER refuse it.
enum class ScannerArray : std::uint16_t {
  kAsItIs = 0,  ///< in a request alone
  kTransverse = 1,
  kSagittal = 2,
  kEndFire = 3,
  kBiplane = 4,  ///< transverse and sagittal in turn; of SCANNER alone
};

/// Bits of ImageMessage::flags.
enum ImageFlag : std::uint16_t {
  /// The field folds since, or could not be inverted: the pixels are those of an earlier tick.
  kImageHeld = 1u << 0,
  kImageFrozen = 1u << 1,       ///< the scanner is frozen
  kImageZlib = 1u << 2,         ///< `data` is compressed (RFC 1950)
  kImageUncertified = 1u << 3,  ///< it is not known whether the field of these pixels folds
};

/// An ultrasound image. Image frame I: origin in the middle of the first pixel, +x along its row, +y down its columns.
struct ImageMessage {
  static constexpr MessageType kType = MessageType::kImage;
  static constexpr std::uint16_t kMaxSide = 4096;  ///< pixels

  ScannerArray array = ScannerArray::kTransverse;
  std::uint16_t flags = 0;  ///< ImageFlag bits
  std::uint16_t width = 0, height = 0;
  std::uint64_t sequence = 0;  ///< of this array's images; a jump = images dropped for this client
  std::uint64_t tick = 0;      ///< that it shows
  std::uint64_t newest_tick =
      0;  ///< that the scanner has seen; later than `tick` where the image is held or frozen
  std::int64_t publish_ns = 0;     ///< server's clock: when the deformation loop published the tick shown
  double spacing_mm = 0;           ///< of pixels, in both directions
  RigidTransform X_WI;             ///< image frame to world
  std::vector<std::uint8_t> data;  ///< rows from the top, `width` gray values each; or those compressed
};

enum class ScannerFreeze : std::uint16_t { kAsItIs = 0, kLive = 1, kFrozen = 2 };

/// Bits of ScannerMessage::flags, set by the server.
enum ScannerFlag : std::uint32_t {
  kProbeHasDevice = 1u << 0,  ///< a device moves the probe: its stepper is not used
  kProbeIsStepped = 1u << 1,  ///< the stepper moves the probe that the tissue feels
};

/// What is set at the scanner's console and the probe's stepper. From a server: what is in use; numbers are finite, and
/// neither enumeration is kAsItIs. From a client: a request, in which kAsItIs and NaN leave things as they are.
struct ScannerMessage {
  static constexpr MessageType kType = MessageType::kScanner;
  ScannerArray array = ScannerArray::kAsItIs;
  ScannerFreeze freeze = ScannerFreeze::kAsItIs;
  std::uint32_t flags = 0;  ///< ScannerFlag bits
  std::uint64_t tick = 0;   ///< from a server: the newest when it came into use
  double depth_mm = std::numeric_limits<double>::quiet_NaN();
  double gain_db = std::numeric_limits<double>::quiet_NaN();
  double dynamic_range_db = std::numeric_limits<double>::quiet_NaN();
  double tgc_extra_db_per_cm = std::numeric_limits<double>::quiet_NaN();
  double focus_mm = std::numeric_limits<double>::quiet_NaN();
  /// Where the stepper brings the probe: along its axis, + is deeper, and turned about it; 0 is where it rests.
  double probe_depth_mm = std::numeric_limits<double>::quiet_NaN();
  double probe_rotation_deg = std::numeric_limits<double>::quiet_NaN();
};

/// An outline on a frozen image: of a client what an operator drew, in an answer the gland's own.
struct ContourSlice {
  static constexpr std::int32_t kMissed = -1;
  std::int32_t slice = 0;  ///< its number, from 0; kMissed (in an answer): nobody outlined this plane
  std::uint64_t tick = 0;  ///< of the image it was drawn on, or of the gland's shape
  double probe_depth_mm = std::numeric_limits<double>::quiet_NaN();  ///< ScannerMessage's; for the record
  RigidTransform X_WI;                                               ///< ImageMessage's
  std::vector<std::array<double, 2>> points;  ///< x and y in the plane, mm; the last is joined to the first
};

/// An operator begins an attempt at an exercise: the server goes on with its scene, and every client connects again.
struct ExerciseMessage {
  static constexpr MessageType kType = MessageType::kExercise;
  std::string file;     ///< of /exercises
  std::string trainee;  ///< whose attempt it is; empty: nobody's
};

/// A plane of ContourMessage's score.
struct ContourPlaneScore {
  std::int32_t slice = 0;  ///< as ContourSlice's
  double offset_mm = 0;    ///< from the first outlined plane, across the planes
  double outlined_mm2 = 0, true_mm2 = 0, dice = 0;
  double hausdorff_mm = 0;  ///< 0 where one outline is empty
};

/// An operator's volume study, to be scored; from a server: the score, and the gland's outlines.
struct ContourMessage {
  static constexpr MessageType kType = MessageType::kContour;
  static constexpr std::size_t kMostPoints = 2000;  ///< of an outline
  static constexpr std::size_t kMostSlices = 64;    ///< from a client
  std::uint64_t about_sequence = 0;  ///< from a server: the header's sequence of what it answers
  std::vector<ContourSlice> slices;  ///< from a server as many of a plane as the gland has pieces there
  /// core/brachytherapy/contours/contour_score.h
  struct Figures {
    double dice = 0, outlined_cm3 = 0, true_cm3 = 0, same_planes_cm3 = 0;
    double volume_error_percent = 0;  ///< NaN of one plane
    double hausdorff_mm = 0, hausdorff_95_mm = 0, mean_mm = 0, step_mm = 0;
    std::uint16_t missed = 0, beyond = 0;  ///< planes
    std::vector<ContourPlaneScore> planes;
  };
  std::optional<Figures> score;  ///< from a server
};

/// Of a histogram, ms.
struct Quantiles {
  std::uint64_t count = 0;
  double p50 = 0, p99 = 0, p999 = 0, max = 0;
};

/// Poses refused for one reason since start.
struct PoseRefusals {
  std::uint16_t code = 0;
  std::uint64_t count = 0;
  std::string text;  ///< of the last one
};

/// Safety actions of one kind for a needle since start.
struct SafetyCount {
  std::uint16_t needle = 0;
  std::uint16_t code = 0;  ///< the daemon's: net/PROTOCOL.md
  std::uint64_t count = 0;
  std::string text;  ///< of the last one
};

/// The current state of what an operator can change.
struct ControlsState {
  std::string kernel;  ///< empty: not known
  double support_radius_mm = 0;
  std::uint32_t flags = 0;  ///< ControlFlag bits
};

/// Bits of ControlsState::flags.
enum ControlFlag : std::uint32_t {
  kScriptIsThere = 1u << 0,
  kScriptPlays = 1u << 1,
  kScriptLoops = 1u << 2,
  kPreparesModel = 1u << 3,  ///< one is being prepared, and used when ready
};

struct StateMessage {
  static constexpr MessageType kType = MessageType::kState;
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;
  std::uint64_t control_overruns = 0;  ///< deadlines that an idle timer thread of the same period missed
  Quantiles tick_ms;
  Quantiles lateness_ms;  ///< wake-up after the deadline
  Quantiles latency_ms;   ///< pose received to mesh published
  std::uint64_t poses_accepted = 0;
  std::vector<PoseRefusals> refusals;
  std::uint64_t snapshots = 0;          ///< made by the server
  std::uint64_t snapshots_sent = 0;     ///< to this client
  std::uint64_t snapshots_dropped = 0;  ///< for this client, replaced by newer ones
  std::uint32_t clients = 0;
  std::uint32_t viewers = 0;
  std::string device_holder;  ///< empty: no lease is held
  std::vector<SafetyCount> safety;
  ControlsState controls;
  std::uint64_t events_dropped = 0;  ///< EVENTs for this client, because it was behind; section DROPS
};

enum class EventKind : std::uint16_t {
  kNote = 1,
  kContact = 2,  ///< the contact state changed
  kPuncture = 3,
  kReset = 4,
  kDeviceAttached = 5,
  kDeviceDetached = 6,
  kWarning = 7,
  kSafety = 8,      ///< the force was limited, removed or restored
  kSeed = 9,        ///< a seed was dropped, or could not be
  kStructure = 10,  ///< a needle came into an organ or left it, or bone stopped it
  kSeedLost = 11,   ///< a seed left its needle outside the body
};

struct EventMessage {
  static constexpr MessageType kType = MessageType::kEvent;
  EventKind kind = EventKind::kNote;  ///< may hold a value not listed: show the text
  std::uint16_t needle = 0;
  std::uint64_t tick = 0;
  std::string text;
};

enum class ErrorCode : std::uint16_t {
  kProtocol = 1,          ///< the peer broke PROTOCOL.md
  kVersion = 2,           ///< another protocol version
  kTooLarge = 3,          ///< a body over max_message_bytes
  kBusy = 4,              ///< no slot for another client
  kDeviceBusy = 5,        ///< another device holds the lease
  kNotDevice = 6,         ///< POSE, ARM or DROP from a client without that right
  kPoseRefused = 7,       ///< `reason` says which rule
  kPoseRate = 8,          ///< more than max_poses_per_s
  kTimeout = 9,           ///< no HELLO, no answer, or nothing read in time
  kShutdown = 10,         ///< the server stops
  kNoNeedle = 11,         ///< HELLO or ARM names a needle that does not exist
  kNotOperator = 12,      ///< CONTROL from a client that is not an operator
  kControlRefused = 13,   ///< a CONTROL that cannot be done; the text gives the reason
  kUnauthorised = 14,     ///< no token, an unknown one, or one for another role
  kScannerRefused = 15,   ///< a SCANNER that cannot be done; the text gives the reason
  kPlanRefused = 16,      ///< a PLAN that cannot be done; the text gives the reason
  kLoadRefused = 17,      ///< a LOAD that cannot be done; the text gives the reason
  kContourRefused = 18,   ///< a CONTOUR that cannot be scored; the text gives the reason
  kExerciseRefused = 19,  ///< an EXERCISE that cannot begin; the text gives the reason
};

/// PoseRefusals::code and ErrorMessage::reason from here on are the server's; lower ones are the daemon's.
enum PoseRefusalCode : std::uint16_t {
  kRefusedRate = 0xFF01,
  kRefusedNeedle = 0xFF02,
  kRefusedNotDevice = 0xFF03,
};

struct ErrorMessage {
  static constexpr MessageType kType = MessageType::kError;
  ErrorCode code = ErrorCode::kProtocol;
  bool fatal = false;                ///< the sender closes after it
  std::uint16_t reason = 0;          ///< with kPoseRefused: the refusal's code
  std::uint64_t about_sequence = 0;  ///< header sequence of the message it answers, 0 = none
  std::string text;
};

struct PingMessage {
  static constexpr MessageType kType = MessageType::kPing;
  std::uint64_t nonce = 0;
  bool reply = false;
  std::int64_t echoed_stamp_ns = 0;  ///< in a reply: the request's header stamp
  std::int64_t received_ns = 0;      ///< in a reply: when the request arrived, replier's clock
};

}  // namespace brachy::net
