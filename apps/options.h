#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/slices/slice.h"
#include "core/math/rigid_transform.h"

namespace brachy {

// What the programs' command lines say, after checking: plain values with their defaults. Lengths in mm, times in s.

struct DaemonOptions {
  std::optional<std::filesystem::path>
      config;                         ///< none: the built-in defaults, which are config/prostate.toml's
  bool check_config = false;          ///< load everything, say so, and end
  std::optional<int> port;            ///< none: the scene's
  std::optional<int> http_port;       ///< none: the scene's
  std::optional<int> igtl_port;       ///< none: the scene's
  std::optional<std::string> broker;  ///< its URL; none: the scene's
  std::optional<double> duration_s;   ///< none: until SIGINT or SIGTERM
  std::optional<std::filesystem::path> trajectory;  ///< of the scripted needle; none: the scene's
  bool play = false;                                ///< start it at once, over and over
  std::optional<std::filesystem::path>
      session;       ///< folder to record into, or to go on with; none: nothing is kept
  std::string simd;  ///< empty: the scene's
  bool control_thread = false;
  bool insecure_allow_remote = false;
  std::optional<double> report_every_s;  ///< none: only the closing summary
  std::optional<double> doctor_s;  ///< `brachyd doctor`: look at machine and scene for so long each, and end
  bool json = false;
};

/// How a tool reaches a daemon.
struct ConnectOptions {
  std::string host;
  std::uint16_t port = 0;
  std::optional<std::filesystem::path> token_file;  ///< none: it shows no token
  bool tls = false;                                 ///< also without any of these
  std::filesystem::path tls_ca;                     ///< empty: the system's
  std::filesystem::path tls_certificate, tls_key;   ///< the tool's own; empty: it shows none
};

/// The device with mass that `replay --device-dynamics` puts between the trajectory, which is the hand's, and the needle.
struct SimulatedDeviceOptions {
  double mass_kg = 0.1;
  double damping_n_s_per_m = 0.5;                                   ///< of the device
  double hand_stiffness_n_per_m = 300, hand_damping_n_s_per_m = 5;  ///< of the grip
  double rate_hz = 1000;
  double encoder_um = 20;
  double max_force_n = 3.3;
  double delay_ms = 0;    ///< added each way
  double drop_share = 0;  ///< of the poses
  std::uint64_t seed = 1;
  bool simple_client = false;  ///< forces come over the wire instead of the local model
};

struct ReplayOptions {
  std::filesystem::path trajectory;             ///< CSV or recording
  std::optional<ConnectOptions> connect;        ///< none: offline
  std::optional<std::filesystem::path> config;  ///< offline
  double rate_hz = 200;
  double speed = 1;
  bool loop = false;
  bool centre_on_tissue = false;
  Vec3 translate_mm = Vec3::Zero();
  int threads = 0;                               ///< offline; 0: the scene's
  std::string simd;                              ///< offline; empty: the scene's
  std::optional<std::filesystem::path> log;      ///< offline: the force log to write
  std::optional<std::filesystem::path> session;  ///< offline: folder to record into and to report in
  std::optional<SimulatedDeviceOptions> device;  ///< none: the trajectory is the needle's
  bool json = false;
};

struct WatchOptions {
  ConnectOptions connect;
  std::optional<double> duration_s;
  bool full = false;
  bool json = false;
};

struct RecordOptions {
  ConnectOptions connect;
  std::filesystem::path out;  ///< a file NAME.brachy, or a folder
  std::optional<double> duration_s;
  bool surface = false;  ///< the surface's points only
  bool json = false;
};

/// Serves a session that a daemon publishes to a broker.
struct RelayOptions {
  std::string broker;  ///< URL
  std::string session = "default";
  std::filesystem::path broker_ca, broker_certificate, broker_key;  ///< TLS towards the broker; empty: none
  std::string address = "127.0.0.1";
  int port = 18950;
  std::optional<int> http_port;                     ///< none: no page, no WebSocket
  std::optional<std::filesystem::path> token_file;  ///< viewers show it; none: nobody needs one
  std::filesystem::path tls_certificate, tls_key;   ///< for viewers; empty: in the clear
  int max_clients = 1024, max_clients_per_address = 1024;
  bool insecure_allow_remote = false;
  std::optional<double> duration_s;  ///< none: until SIGINT or SIGTERM
  bool json = false;
};

struct ExportOptions {
  std::filesystem::path recording;
  std::filesystem::path out;  ///< folder
  bool surface = false;       ///< the .vtp hold the surface only
  bool json = false;
};

struct DeformOptions {
  std::filesystem::path landmarks;
  std::optional<std::filesystem::path> points, mesh;  ///< exactly one
  std::optional<std::filesystem::path> scene;         ///< body and kernel
  std::string kernel;                                 ///< empty: the scene's, or psi31
  std::optional<double> support_mm, poisson, shear_modulus_kpa, core_radius_mm;
  std::filesystem::path out;
  bool jacobian = false;
  bool strict = false;
  bool json = false;
};

struct DoseOptions {
  std::filesystem::path seeds;                       ///< CSV
  std::optional<std::filesystem::path> points, out;  ///< CSVs; both or neither
  std::optional<std::filesystem::path> scene;        ///< its structures' DVH
  std::optional<std::filesystem::path> grid;         ///< .nrrd to write; only with a scene
  bool json = false;
};

struct InspectOptions {
  std::filesystem::path file;  ///< mesh, scene or recording
  std::string units = "mm", frame = "RAS";
  double weld_tolerance_mm = 1e-4;
  double min_island_share = 0.01;
  std::optional<std::filesystem::path> out;  ///< PLY of the surface
  bool json = false;
};

struct CompareOptions {
  std::optional<std::filesystem::path> references;      ///< none: the installed scenes, or the sources'
  std::optional<std::filesystem::path> beads;           ///< measured beads instead of reference scenes
  std::optional<std::filesystem::path> json, markdown;  ///< files to write
  std::vector<std::string> models, scenes;              ///< beginnings of names; empty: all
  bool quick = false;                                   ///< listed models only, ticks timed for less long
  std::optional<Slice> slice;                           ///< of the rows; written to `json`
  std::vector<std::filesystem::path> merge;             ///< slices' files, instead of running anything
};

struct StabilityOptions {
  std::optional<std::filesystem::path>
      scene;  ///< none: the built-in defaults, which are config/prostate.toml's
  std::optional<std::filesystem::path> json;  ///< file to write
  std::optional<std::filesystem::path> out;   ///< folder of the table and the charts' data
  std::vector<std::string> sweeps;            ///< names; empty: all
  bool quick = false;                         ///< fewer and smaller cases
  std::optional<Slice> slice;                 ///< of the sweeps; written to `json`
  std::vector<std::filesystem::path> merge;   ///< slices' files, instead of sweeping anything
};

struct ZWidthOptions {
  double mass_kg = 0.1, damping_n_s_per_mm = 0.0005;    ///< of the device
  std::optional<std::filesystem::path> json, markdown;  ///< files to write
  bool quick = false;                                   ///< fewer cases
};

struct PlotForceOptions {
  std::filesystem::path log;
  std::optional<std::filesystem::path> out;  ///< none: the log's name with .svg
  std::optional<std::uint32_t> needle;       ///< none: the first one in the log
  bool json = false;
};

struct MetricsOptions {
  std::filesystem::path trajectory, mesh;
  std::string units = "mm", frame = "RAS";  ///< of the mesh
  bool json = false;
};

struct ScoreOptions {
  std::filesystem::path recording;                    ///< folder
  std::optional<std::filesystem::path> plan, config;  ///< none: the scene's plan; the built-in phantom
  std::optional<std::filesystem::path> out;           ///< none: report.html in the recording
  bool json = false;
};

struct PlanOptions {
  std::optional<std::filesystem::path> plan;    ///< none: the scene's
  bool generate = false;                        ///< make one instead
  std::optional<std::filesystem::path> config;  ///< none: the built-in phantom
  std::optional<std::filesystem::path> out, csv, seeds, structures, trajectory;  ///< to write
  double speed_mm_s = 50, drop_speed_mm_s = 20;                                  ///< of the trajectory
  bool json = false;
};

struct AdviseOptions {
  std::filesystem::path scene;
  std::optional<double> tolerance_mm, tick_budget_ms;  ///< none: the scene's
  bool json = false;
};

struct TokenOptions {
  std::filesystem::path file;
  bool show = false;  ///< print the one that is there instead of making it
};

using ToolOptions =
    std::variant<ReplayOptions, WatchOptions, RecordOptions, RelayOptions, ExportOptions, DeformOptions,
                 DoseOptions, InspectOptions, CompareOptions, StabilityOptions, ZWidthOptions, AdviseOptions,
                 PlotForceOptions, MetricsOptions, ScoreOptions, PlanOptions, TokenOptions>;

/// Exit codes of both programs.
enum ExitCode : int {
  kExitOk = 0,
  kExitFailed = 1,    ///< went wrong while running: connection lost, disk full
  kExitBadInput = 2,  ///< usage, files, settings, a port in use
  kExitRefused = 3,   ///< the input is well-formed, but its answer would be wrong (brachy deform)
};

}  // namespace brachy
