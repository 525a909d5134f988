#include "apps/command_line.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "core/ladder/ladder.h"

namespace brachy {
namespace {

constexpr const char* kVersion = "brachy " BRACHY_VERSION;

// CLI11's own exit codes are 100 and up; ours are ExitCode.
std::optional<int> parse(CLI::App& app, int argc, char** argv) {
  app.set_version_flag("--version", kVersion);
  app.failure_message([](const CLI::App* a, const CLI::Error& e) {
    return a->get_name() + ": " + e.what() + "\nTry --help.\n";
  });
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitBadInput;
  }
}

const CLI::Validator kHostPort(
    [](const std::string& text) -> std::string {
      const auto colon = text.rfind(':');
      int port = 0;
      if (colon == std::string::npos || colon == 0 ||
          !CLI::detail::lexical_cast(text.substr(colon + 1), port) || port < 1 || port > 65535)
        return "needs HOST:PORT, such as 127.0.0.1:18950, not '" + text + "'";
      return "";
    },
    "HOST:PORT");

HostPort split(const std::string& text) {
  const auto colon = text.rfind(':');
  return {text.substr(0, colon), static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1)))};
}

// CLI::Range lets NaN through: no comparison holds for it.
CLI::Validator between(double least, double most) {
  const CLI::Range range(least, most);
  return {[range](std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && !(value == value))
              return "needs a number, not '" + text + "'";
            return range(text);
          },
          range.get_description()};
}

const CLI::Validator kDurations = between(0.001, 1e7);

const CLI::IsMember kSimdChoices({"auto", "generic", "sse4", "avx2", "avx512"});

}  // namespace

DaemonOptions parse_daemon_line(int argc, char** argv, std::optional<int>& exit_code) {
  DaemonOptions options;
  std::filesystem::path check;
  CLI::App app("Real-time brachytherapy simulator: needle poses in, deformed prostate out, over TCP.",
               "brachyd");
  app.footer(
      "Examples:\n"
      "  brachyd --config config/prostate.toml              until Ctrl-C, on the scene's port\n"
      "  brachyd --config my.toml --port 0 --duration 60    a free port, printed on the first line\n"
      "  brachyd --check-config my.toml                     says what is wrong with a scene, or that nothing "
      "is\n"
      "Exit codes: 0 ended cleanly, 1 failed while running, 2 bad scene, mesh or usage, or the port is in "
      "use.");
  app.add_option("--config", options.config, "scene file (TOML); default: the built-in phantom");
  auto* check_option = app.add_option("--check-config", check, "load this scene and its files, then end");
  check_option->excludes("--config");
  app.add_option("--port", options.port, "TCP port; 0: a free one")->check(CLI::Range(0, 65535));
  app.add_option("--duration", options.duration_s, "end after this many seconds")->check(kDurations);
  app.add_option("--simd", options.simd, "instruction set of the field evaluation; default: the scene's")
      ->check(kSimdChoices);
  app.add_flag(
      "--control-thread", options.control_thread,
      "run an idle thread on the same deadlines, to tell the machine's misses from the simulation's");
  app.add_flag("--insecure-allow-remote", options.insecure_allow_remote,
               "allow server.address to be other than loopback: anyone who reaches it may connect");
  app.add_flag("--json", options.json, "print the closing summary as JSON on standard output");
  exit_code = parse(app, argc, argv);
  if (check_option->count()) {
    options.config = check;
    options.check_config = true;
  }
  return options;
}

ToolOptions parse_tool_line(int argc, char** argv, std::optional<int>& exit_code) {
  CLI::App app("Tools for the brachytherapy simulator.", "brachy");
  app.require_subcommand(1);
  app.footer("brachy COMMAND --help tells more, with examples.");
  std::string connect;

  ReplayOptions replay;
  std::vector<double> translate;
  bool offline = false;
  auto* replay_cmd =
      app.add_subcommand("replay", "Play a needle trajectory into a daemon, or step it offline.");
  replay_cmd->footer(
      "Examples:\n"
      "  brachy replay config/insertion.csv --connect 127.0.0.1:18950\n"
      "  brachy replay insertion.csv --offline --config config/prostate.toml --json");
  replay_cmd->add_option("trajectory", replay.trajectory, "CSV: t_s,m00,…,m23 (X_WN, mm)")->required();
  auto* replay_connect =
      replay_cmd->add_option("--connect", connect, "the daemon to play into")->check(kHostPort);
  auto* offline_flag =
      replay_cmd->add_flag("--offline", offline, "no clock, no network: step and print a hash");
  offline_flag->excludes(replay_connect);
  replay_cmd->add_option("--config", replay.config, "scene for --offline; default: the built-in phantom")
      ->needs(offline_flag);
  replay_cmd->add_option("--threads", replay.threads, "OpenMP threads for --offline; default: the scene's")
      ->needs(offline_flag)
      ->check(CLI::Range(1, 64));
  replay_cmd->add_option("--simd", replay.simd, "instruction set for --offline; default: the scene's")
      ->needs(offline_flag)
      ->check(kSimdChoices);
  replay_cmd->add_option("--rate-hz", replay.rate_hz, "poses a second; between samples they are interpolated")
      ->needs(replay_connect)
      ->check(between(1.0, 2000.0))
      ->capture_default_str();
  replay_cmd->add_option("--speed", replay.speed, "1: as recorded, 2: twice as fast")
      ->check(between(0.01, 100.0))
      ->capture_default_str();
  replay_cmd->add_flag("--loop", replay.loop, "start over at the end, until interrupted")
      ->needs(replay_connect);
  replay_cmd->add_flag("--centre-on-tissue", replay.centre_on_tissue,
                       "move the trajectory so that the place where its tip dwells is the tissue's centre");
  replay_cmd->add_option("--translate-mm", translate, "then move it by x,y,z")
      ->delimiter(',')
      ->expected(3)
      ->check(between(-1e4, 1e4));
  replay_cmd->add_flag("--json", replay.json, "print the result as JSON");

  WatchOptions watch;
  auto* watch_cmd = app.add_subcommand("watch", "Follow a daemon as a viewer and print its counters.");
  watch_cmd->footer("Example:\n  brachy watch --connect 127.0.0.1:18950 --duration 10 --json");
  watch_cmd->add_option("--connect", connect, "the daemon")->required()->check(kHostPort);
  watch_cmd->add_option("--duration", watch.duration_s, "seconds; default: until the daemon ends")
      ->check(kDurations);
  watch_cmd->add_flag("--full", watch.full, "ask for whole meshes instead of changes");
  watch_cmd->add_flag("--json", watch.json, "print the counters as JSON at the end");

  RecordOptions record;
  auto* record_cmd = app.add_subcommand(
      "record", "Write what a daemon sends as a .pvd/.vtp series and a pose log that replays.");
  record_cmd->footer(
      "Example:\n  brachy record --connect 127.0.0.1:18950 --out out/run1 --duration 10\n"
      "  paraview out/run1/recording.pvd; brachy replay out/run1/poses.csv --offline");
  record_cmd->add_option("--connect", connect, "the daemon")->required()->check(kHostPort);
  record_cmd->add_option("--out", record.out, "folder to write; made if missing, must hold no recording")
      ->required();
  record_cmd->add_option("--duration", record.duration_s, "seconds; default: until the daemon ends")
      ->check(kDurations);
  record_cmd->add_flag("--surface", record.surface, "write the surface only: a tenth of the space");
  record_cmd->add_flag("--json", record.json, "print the result as JSON");

  DeformOptions deform;
  auto* deform_cmd =
      app.add_subcommand("deform", "Deform points or a mesh by landmarks, exactly and without a clock.");
  deform_cmd->footer(
      "Examples:\n"
      "  brachy deform --landmarks L.csv --points P.csv --kernel psi31 --support 12 --out O.csv\n"
      "  brachy deform --landmarks L.csv --points P.csv --scene scene.toml --kernel elastic --out O.csv\n"
      "  brachy deform --landmarks L.csv --mesh M.stl --kernel elastic --poisson 0.49 --core-radius 2 --out "
      "O.ply\n"
      "Landmarks: x,y,z,dx,dy,dz[,core_mm] (an anchor has zeros). Points: x,y,z. Out: x,y,z,dx,dy,dz[,det]. "
      "mm.\n"
      "elastic and fem take landmarks that follow each other along a line for a needle's shaft of the "
      "scene's\n"
      "radius, one alone for a contact; a core_mm > 0 makes a landmark a point of that core radius instead.\n"
      "Without --scene, elastic is an unbounded solid and needs a core radius; fem needs a scene.\n"
      "Exit codes: 0 done, 2 bad input, 3 refused (singular or contradictory landmarks; with --strict, "
      "folding).");
  deform_cmd->add_option("--landmarks", deform.landmarks, "CSV x,y,z,dx,dy,dz[,core_mm]")->required();
  auto* points = deform_cmd->add_option("--points", deform.points, "CSV x,y,z");
  auto* mesh = deform_cmd->add_option("--mesh", deform.mesh, "STL, OBJ or PLY; --out is then a PLY");
  points->excludes(mesh);
  deform_cmd->add_option("--scene", deform.scene, "body, moduli, regions, needle and kernel (TOML)");
  deform_cmd->add_option("--kernel", deform.kernel, "rung of the ladder; default: the scene's, or psi31")
      ->check(CLI::IsMember(rung_names()));
  deform_cmd
      ->add_option("--support", deform.support_mm,
                   "support radius a of a psi kernel, mm; largest one of a compact rung (default 48)")
      ->check(between(1e-6, 1e6));
  deform_cmd->add_option("--poisson", deform.poisson, "Poisson's ratio; default: the scene's, or 0.49")
      ->check(between(0.0, 0.4995));
  deform_cmd
      ->add_option("--shear-modulus-kpa", deform.shear_modulus_kpa,
                   "of the tissue; default: the scene's, or 6")
      ->check(between(1e-3, 1e6));
  deform_cmd->add_option("--core-radius", deform.core_radius_mm, "of every landmark without a core_mm, mm")
      ->check(between(1e-3, 1e3));
  deform_cmd->add_option("--out", deform.out, "file to write")->required();
  deform_cmd->add_flag("--jacobian", deform.jacobian, "also write det(I + ∇u)");
  deform_cmd->add_flag("--strict", deform.strict, "refuse a field that folds at a point");
  deform_cmd->add_flag("--json", deform.json, "print the result as JSON");

  InspectOptions inspect;
  auto* inspect_cmd = app.add_subcommand("inspect", "Say what a mesh or a scene's tissue is made of.");
  inspect_cmd->footer(
      "Examples:\n  brachy inspect prostate.stl\n  brachy inspect config/prostate.toml --json");
  inspect_cmd->add_option("file", inspect.file, "STL, OBJ or PLY, or a scene (.toml)")->required();
  inspect_cmd->add_option("--units", inspect.units, "of a mesh")
      ->check(CLI::IsMember({"mm", "m"}))
      ->capture_default_str();
  inspect_cmd->add_option("--frame", inspect.frame, "of a mesh")
      ->check(CLI::IsMember({"RAS", "LPS"}))
      ->capture_default_str();
  inspect_cmd
      ->add_option("--weld-tolerance-mm", inspect.weld_tolerance_mm, "vertices closer than this are one")
      ->check(between(0.0, 1.0))
      ->capture_default_str();
  inspect_cmd->add_option("--min-island-share", inspect.min_island_share, "smaller islands are dropped")
      ->check(between(0.0, 0.5))
      ->capture_default_str();
  inspect_cmd->add_option("--out", inspect.out, "also write the surface, welded and outward, as PLY");
  inspect_cmd->add_flag("--json", inspect.json, "print the report as JSON");

  CompareOptions compare;
  auto* compare_cmd = app.add_subcommand(
      "compare", "Run every model on every reference scene: errors, times, memory, as a table.");
  compare_cmd->footer(
      "Examples:\n"
      "  brachy compare --quick                                       the listed models, a minute\n"
      "  brachy compare --json compare.json --markdown compare.md     all, with the sweep over supports\n"
      "  brachy compare --models psi31_a12,elastic --scenes lateral   those whose names begin so\n"
      "  brachy compare --beads truthcube/beads.csv                   against measured beads instead\n"
      "Beads: i,j,k,x0,y0,z0,x1,y1,z1,… mm at rest and under loads. Those at the ends of the lattice predict "
      "the\n"
      "others; parameters are chosen on the first load's outer beads alone and applied to every load.\n"
      "scripts/compare.sh does the same and draws the charts. Times are one thread's; leave the cores "
      "alone.\n"
      "Exit codes: 0 done, 1 no model had an answer, 2 bad input.");
  compare_cmd->add_option(
      "--references", compare.references,
      "folder of reference scenes; default: the installed or the sources' tests/reference");
  auto* beads = compare_cmd->add_option("--beads", compare.beads, "CSV i,j,k,x0,y0,z0,x1,y1,z1,…");
  compare_cmd->add_option("--json", compare.json, "write all rows as JSON");
  compare_cmd->add_option("--markdown", compare.markdown, "write the table, which is printed anyway");
  compare_cmd->add_option("--models", compare.models, "beginnings of model names, comma-separated")
      ->delimiter(',');
  compare_cmd->add_option("--scenes", compare.scenes, "beginnings of scene names, comma-separated")
      ->delimiter(',');
  compare_cmd->add_flag("--quick", compare.quick, "listed models only, ticks timed for less long");
  for (const char* other : {"--references", "--markdown", "--models", "--scenes", "--quick"})
    beads->excludes(compare_cmd->get_option(other));

  exit_code = parse(app, argc, argv);
  if (exit_code) return inspect;

  const auto refuse = [&](CLI::App* command, const char* what) {
    std::cerr << "brachy " << command->get_name() << ": " << what << "\nTry --help.\n";
    exit_code = kExitBadInput;
    return inspect;
  };
  if (*replay_cmd) {
    if (!offline && connect.empty()) return refuse(replay_cmd, "needs --connect HOST:PORT or --offline");
    if (!offline) replay.connect = split(connect);
    if (!translate.empty()) replay.translate_mm = Vec3(translate[0], translate[1], translate[2]);
    return replay;
  }
  if (*watch_cmd) {
    watch.connect = split(connect);
    return watch;
  }
  if (*record_cmd) {
    record.connect = split(connect);
    return record;
  }
  if (*deform_cmd) {
    if (!deform.points && !deform.mesh) return refuse(deform_cmd, "needs --points FILE or --mesh FILE");
    return deform;
  }
  if (*compare_cmd) return compare;
  return inspect;
}

}  // namespace brachy
