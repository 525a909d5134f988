#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/base/work_budget.h"
#include "core/brachytherapy/dose/dose_goal.h"
#include "core/brachytherapy/dose/dose_settings.h"
#include "core/brachytherapy/hdr/implant_settings.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/robust/uncertainty.h"
#include "core/brachytherapy/seeds/seed_settings.h"
#include "core/geometry/tissue/phantom.h"
#include "core/injectivity/guard_settings.h"
#include "core/needle/contact_settings.h"
#include "core/needle/probe_settings.h"
#include "core/simulation/body_settings.h"
#include "core/simulation/clinical_noise.h"
#include "core/solve/anchors.h"
#include "core/ultrasound/ultrasound_settings.h"

namespace brachy {

/// The tissue: its surface, points, moduli and needle forces.
struct TissueSettings {
  std::string mesh;              ///< STL, OBJ or PLY, relative to the scene file; empty: the phantom
  std::string units = "mm";      ///< of all mesh files of the scene: mm or m
  std::string frame = "RAS";     ///< of all mesh files of the scene: RAS or LPS
  std::uint64_t points = 14560;  ///< surface and interior together
  std::uint64_t phantom_surface_vertices = 1200;
  Vec3 phantom_size_mm = phantom_size();  ///< its bounding box
  double min_island_share = 0.01;         ///< islands under this share of the volume are dropped and reported
  double weld_tolerance_mm = 1e-4;
  std::string colour;      ///< "#rrggbb", in viewers; empty: theirs
  std::uint64_t seed = 1;  ///< of the interior points
  /// of tissue in no region; 17 kPa Young's modulus of a gland (core/DESIGN.md, section 5), a third of it
  double shear_modulus_kpa = 6;
  double poisson = 0.49;  ///< of all tissue
  TissueContact contact;  ///< of tissue in no region, and of the outer surface

  bool operator==(const TissueSettings&) const = default;
};

/// The box that holds the tissue, for the elastic models.
struct BoxSettings {
  Vec3 size_mm = Vec3::Constant(96);
  Vec3 centre_mm = Vec3::Zero();
  std::array<bool, 6> held = {true, true, true,
                              true, true, true};  ///< in the order of kFaceNames; false: free

  bool operator==(const BoxSettings&) const = default;
};

/// A part of the tissue with a modulus, a support radius or needle forces of its own; a later one lies over an
/// earlier one.
struct RegionSettings {
  /// Of blend_mm; less where the region is narrower. A push of up to 3.3 mm does not fold it (Membership::kMaxSlope),
  /// which is what the default tip carries along while it cuts; a capsule there is clamped before it gives way.
  static constexpr double kBlendMm = 8;

  std::string shape = "ellipsoid";  ///< ellipsoid (axes along x, y, z), sphere, or mesh
  Vec3 centre_mm = Vec3::Zero();
  Vec3 semi_axes_mm = Vec3::Constant(20);  ///< of a sphere: its radius, three times
  std::string file;                        ///< for mesh: STL, OBJ or PLY, relative to the scene file
  std::optional<double> shear_modulus_kpa;
  std::optional<double> support_radius_mm;  ///< of the ψ models; the compact ones' largest
  /// Needle forces in the region: those that the file omits are as in [tissue], but without a capsule.
  std::optional<TissueContact> contact;
  double blend_mm = kBlendMm;  ///< across the surface, from one support to the other
  std::string place;           ///< file:line, for messages

  bool operator==(const RegionSettings&) const = default;
};

struct ModelSettings {
  static constexpr double kMinSupportMm = 0.5, kMaxSupportMm = 500;

  /// core/models/matrix_kernel/matrix_models.h, or auto (core/scene/choice/choice.h)
  std::string kernel = "elastic";
  double support_radius_mm = 12;  ///< of the ψ models
  double tolerance_mm = 1;        ///< auto: largest error in the gland
  double tick_budget_ms = 2.5;    ///< auto: time of a tick, one thread
  std::string needs = "volume";   ///< auto: volume, or surface where no client uses the points inside

  bool operator==(const ModelSettings&) const = default;
};

struct RateSettings {
  double deformation_hz = 200;
  double snapshot_hz = 30;

  bool operator==(const RateSettings&) const = default;
};

struct EngineSettings {
  /// instruction set: auto, generic, sse4, avx2, avx512; pinned for golden hashes
  std::string simd = "auto";
  int threads = 1;  ///< OpenMP threads of the field evaluation

  bool operator==(const EngineSettings&) const = default;
};

struct RealtimeSettings {
  int fifo_priority = 0;     ///< SCHED_FIFO for the deformation thread; 0: off
  bool lock_memory = false;  ///< mlockall
  /// an idle thread with the same deadlines: counts what the machine itself misses
  bool control_thread = false;

  bool operator==(const RealtimeSettings&) const = default;
};

struct DeviceSettings {
  std::string kind = "network";  ///< network, or scripted (plays `trajectory` inside the daemon)
  std::string trajectory;        ///< for scripted: CSV, relative to the scene file
  bool loop = false;
  /// for scripted: move the trajectory so that its tip rests at the tissue's centre
  bool centre_on_tissue = false;
  double stale_pose_ms = 100;  ///< poses older than this are rejected

  bool operator==(const DeviceSettings&) const = default;
};

struct ServerSettings {
  std::string address = "127.0.0.1";
  int port = 18950;
  int http_port = -1;        ///< of the viewer and its WebSocket; 0: a free one, -1: none
  int igtl_port = -1;        ///< OpenIGTLink's; -1: off
  std::string igtl_connect;  ///< HOST:PORT of an OpenIGTLink server whose tools move the needles; empty: none
  bool igtl_connect_sends = false;  ///< sends it what clients get, as to a 3D Slicer that listens
  std::string
      igtl_needle_names;  ///< of the TRANSFORMs that move needle 0, 1, …, "A, B"; beside NeedleToRas …
  std::string igtl_frame = "Ras";  ///< what OpenIGTLink's coordinates are in: NeedleTo…
  std::string igtl_frame_pose;     ///< X_WF of that frame, row by row, 12 or 16 numbers; empty: it is RAS
  bool igtl_commands = false;      ///< OpenIGTLink's STRING and COMMAND reset, play, arm, drop, …
  /// 32 bytes; its holder may have any role; relative to the scene file; empty: none
  std::string token_file;
  std::string device_token_file;    ///< its holder may be device or viewer
  std::string viewer_token_file;    ///< its holder may be viewer
  bool igtl_without_token = false;  ///< allows OpenIGTLink, which has no tokens, where tokens are set
  std::string tls_certificate;      ///< PEM, relative to the scene file; with tls_key: TLS; empty: none
  std::string tls_key;
  std::string tls_client_ca;  ///< PEM; clients must present a certificate signed by it; empty: none
  int max_clients = 64;
  int max_clients_per_address = 48;
  std::uint64_t max_message_bytes = 65536;  ///< from a client
  double max_poses_per_s = 2000;
  int hello_timeout_ms = 2000;    ///< from connection to a complete HELLO
  int silence_timeout_ms = 5000;  ///< a client that completes no message for this long is closed
  int stall_timeout_ms = 5000;    ///< a stalled client, which reads nothing for this long, is closed

  bool has_tokens() const {
    return !token_file.empty() || !device_token_file.empty() || !viewer_token_file.empty();
  }
  bool has_tls() const { return !tls_certificate.empty(); }

  bool operator==(const ServerSettings&) const = default;
};

/// A NATS server, to which the session is published for viewers beyond this machine.
struct BrokerSettings {
  std::string url;                       ///< nats://HOST:4222, tls://…; empty: off
  std::string session = "default";       ///< which a relay subscribes to
  std::string tls_ca;                    ///< PEM, relative to the scene file, also below; empty: the system's
  std::string tls_certificate, tls_key;  ///< presented to the broker; empty: none

  bool operator==(const BrokerSettings&) const = default;
};

/// A structure of the patient: dose is reported for it (core/scene/load_structures.h).
struct StructureSettings {
  std::string name;         ///< "urethra", "rectum" or any other of letters, digits, _ and -; once
  std::string file;         ///< STL, OBJ or PLY, relative to the scene file
  std::string place;        ///< file:line, for messages
  std::string colour = {};  ///< "#rrggbb", in viewers; empty: theirs
  std::string role = {};    ///< of role_words(); empty: by its name (core/scene/structure_roles.h)

  bool operator==(const StructureSettings&) const = default;
};

/// What viewers show beside the simulation.
struct DisplaySettings {
  std::string volume;  ///< NRRD, in slices; relative to the scene file; empty: none

  bool operator==(const DisplaySettings&) const = default;
};

/// All settings of a scene file (config/KEYS.md). The defaults are those of config/prostate.toml. Checked by
/// load_scene.
struct Scene {
  std::string name = "prostate";
  std::filesystem::path directory;  ///< of the scene file: relative paths start here
  TissueSettings tissue;
  BoxSettings box;
  std::vector<RegionSettings> regions;
  ModelSettings model;
  GuardSettings stability;
  Anchors::Options anchors;
  NeedleSettings needle;
  ContactSettings contact;
  GlandSettings gland;
  SwellingSettings swelling;
  ProbeSettings probe;
  UltrasoundSettings ultrasound;
  NoiseSettings noise;
  UncertaintySettings uncertainty;
  TemplateGrid template_grid;
  ImplantSettings implant;
  SeedSettings seeds;
  /// TOML or CSV, relative to the scene file (core/brachytherapy/plan/plan_file.h); empty: no plan
  std::string plan_file;
  DoseSettings dose;
  std::vector<StructureSettings> structures;
  std::vector<DoseGoal> goals;  ///< none: default_dose_goals()
  DisplaySettings display;
  RateSettings rates;
  EngineSettings engine;
  WorkCosts work_costs;
  RealtimeSettings realtime;
  DeviceSettings device;
  ServerSettings server;
  BrokerSettings broker;

  /// The needles, and the probe after them.
  std::size_t instrument_count() const { return needle.count + (probe.on ? 1 : 0); }
  double period_s() const { return 1 / rates.deformation_hz; }
  std::filesystem::path resolve(const std::string& path) const { return directory / path; }

  bool operator==(const Scene&) const = default;
};

}  // namespace brachy
