#include "apps/brachy/replay/replay.h"

#include <vector>

#include "apps/command_line/option_groups.h"
#include "apps/command_line/tool.h"

namespace brachy {
namespace {

constexpr auto kSummary = "Play a needle trajectory into a daemon, or step it offline.";
constexpr auto kDetails = R"(Examples:
  brachy replay config/insertion.csv --connect 127.0.0.1:18950
  brachy replay run1.brachy --offline --config config/prostate.toml      a recording: the same ticks again
  brachy replay insertion.csv --offline --config config/prostate.toml --json
  brachy replay out/monday/poses.csv --offline --config config/session.toml --from 60      a session, from its middle
  brachy replay config/insertion_5mm_s.csv --offline --log force.csv
  brachy replay config/insertion_three_needles.csv --offline --config three.toml   needle.count = 3 there
  brachy replay config/insertion.csv --offline --device-dynamics --delay-ms 20 --drop 0.01
  brachy replay config/insertion.csv --connect 127.0.0.1:18950 --device-dynamics --hand-stiffness 800
With --device-dynamics the trajectory is the hand's: it holds a device with mass, which receives the force and
moves the needle (the file's first). Reported: peak force, largest jump in a millisecond, oscillation.
A file with the column needle after m23 moves several needles, with --connect each as a device of its own; one
without moves needle 0. In the column button, the last, 1 is a button held from that row to the needle's next:
pressed, it drops seeds.
The log has a row per tick and needle: t_s,needle,state,depth_mm,fx_n,fy_n,fz_n,axial_n,lateral_n,
cutting_n,friction_n,landmarks,min_det,tip_deflection_mm,guide_x_n,guide_y_n,guide_z_n; brachy plot-force
draws it.)";

/// The options as they are given on the command line.
struct GivenOptions : ReplayOptions {
  ConnectOptions daemon;
  std::vector<double> translate;
  bool offline = false, dynamics = false;
  SimulatedDeviceOptions simulated;
};

void declare_device(OptionList& list, SimulatedDeviceOptions& device, Option dynamics) {
  const auto number = [&](const char* name, double& value, const char* help, double least, double most) {
    list.add(name, value, help).needs(dynamics).range(least, most).show_default();
  };
  number("--mass-kg", device.mass_kg, "of the device at its tip", 0.001, 10);
  number("--damping", device.damping_n_s_per_m, "of the device, N·s/m", 0.001, 50);
  number("--hand-stiffness", device.hand_stiffness_n_per_m, "of the grip, N/m", 0, 1e5);
  number("--hand-damping", device.hand_damping_n_s_per_m, "of the grip, N·s/m", 0, 1000);
  number("--device-hz", device.rate_hz, "cycles per second", 50, 4000);
  number("--encoder-um", device.encoder_um, "step of its positions; 0: none", 0, 1000);
  number("--max-force", device.max_force_n, "largest force that it renders, N", 0.01, 100);
  number("--delay-ms", device.delay_ms, "added each way between device and simulation", 0, 1000);
  number("--drop", device.drop_share, "share of the poses that are lost", 0, 1);
  list.add("--seed", device.seed, "random seed of the lost poses").needs(dynamics).show_default();
  list.add_flag("--simple-client", device.simple_client,
                "forces come over the wire, not from the local model")
      .needs(dynamics);
}

void declare(OptionList& list, GivenOptions& options) {
  list.add("trajectory", options.trajectory,
           "CSV: t_s,m00,…,m23[,needle][,button] (X_WN, mm), or a recording")
      .required();
  const Option connect = add_connect_options(list, options.daemon, "the daemon to play into");
  const Option offline =
      list.add_flag("--offline", options.offline, "no clock, no network: step and print a hash");
  offline.excludes(connect);
  list.add("--config", options.config,
           "scene for --offline; default: the session's own beside the trajectory, else the built-in phantom")
      .needs(offline);
  list.add_flag("--what-if", options.what_if,
                "for --offline: a session's poses may go into another scene than its own")
      .needs(offline);
  list.add("--threads", options.threads, "OpenMP threads for --offline; default: the scene's")
      .needs(offline)
      .range(1, 64);
  as_simd(
      list.add("--simd", options.simd, "instruction set for --offline; default: the scene's").needs(offline));
  list.add_output("--log", options.log, "for --offline: the force on every needle in every tick, as CSV")
      .needs(offline);
  list.add_force(options.force);
  const Option session = list.add_output_folder("--session", options.session,
                                                "for --offline: directory to write poses, forces and seeds "
                                                "to, as brachyd --session records them")
                             .needs(offline);
  as_short_name(
      list.add("--trainee", options.trainee, "whose session it is; stands in its files").needs(session));
  list.add("--from", options.from_s,
           "for --offline: start at the newest state before that time, s, that the session beside the "
           "trajectory kept")
      .needs(offline)
      .range(0.0, 1e6)
      .excludes(session);
  list.add("--rate-hz", options.rate_hz, "poses per second; interpolated between samples")
      .needs(connect)
      .range(1.0, 2000.0)
      .show_default();
  list.add("--speed", options.speed, "1: as recorded, 2: twice as fast").range(0.01, 100.0).show_default();
  list.add_flag("--loop", options.loop, "start over at the end, until interrupted").needs(connect);
  list.add_flag("--centre-on-tissue", options.centre_on_tissue,
                "move the trajectory so that the place where its tip dwells is the tissue's centre");
  list.add("--translate-mm", options.translate, "then move it by x,y,z")
      .comma_separated()
      .values(3)
      .range(-1e4, 1e4);
  const Option dynamics =
      list.add_flag("--device-dynamics", options.dynamics, "a device with mass between hand and needle");
  declare_device(list, options.simulated, dynamics);
  list.add_flag("--json", options.json, "print the result as JSON");
}

int run(const GivenOptions& given) {
  if (!given.offline && given.daemon.host.empty()) throw UsageError("needs --connect HOST:PORT or --offline");
  ReplayOptions options = given;
  if (!given.offline) options.connect = given.daemon;
  if (given.dynamics) options.device = given.simulated;
  if (const auto& mm = given.translate; !mm.empty()) options.translate_mm = Vec3(mm[0], mm[1], mm[2]);
  return options.connect ? replay_live(options) : replay_offline(options);
}

}  // namespace

Tool replay_tool() {
  return make_tool<GivenOptions>("replay", kSummary, kDetails, declare, run);
}

}  // namespace brachy
