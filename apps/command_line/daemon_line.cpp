#include "apps/command_line/daemon_line.h"

#include <iostream>

#include "apps/command_line/command_line_parts.h"
#include "apps/command_line/option_groups.h"

namespace brachy {

DaemonOptions parse_daemon_line(int argc, char** argv, std::optional<int>& exit_code) {
  DaemonOptions options;
  std::filesystem::path check;
  CLI::App app("Real-time brachytherapy simulator: needle poses in, deformed prostate out, over TCP.",
               "brachyd");
  app.footer(
      "Examples:\n"
      "  brachyd                                            the default scene, with the viewer; it prints "
      "the link\n"
      "  brachyd --config config/prostate.toml              until Ctrl-C, on the scene's port\n"
      "  brachyd --config my.toml --port 0 --duration 60    a free port, printed on the first line\n"
      "  brachyd --config config/prostate.toml --http-port 18951     the viewer: open "
      "http://127.0.0.1:18951\n"
      "  brachyd --trajectory config/insertion.csv --play --http-port 18980    a needle to look at in a "
      "browser\n"
      "  brachyd --config config/prostate.toml --nats nats://127.0.0.1:4222    for viewers on other "
      "machines: brachy relay --help\n"
      "  brachyd --config config/session.toml --session out/monday   keeps every seed, ends with a report\n"
      "  brachyd --config config/exercises/scenes/01_one_needle.toml --sessions out/class --http-port 18951\n"
      "                                                     exercises in the browser, one after the other\n"
      "  brachyd --check-config my.toml                     reports the errors of a scene\n"
      "  brachyd doctor --config my.toml                    reports whether this machine can run it\n"
      "SIGHUP reads the scene file again.\n"
      "Exit codes: 0 ended cleanly, 1 failed while running, 2 bad scene, mesh or usage, or the port is in "
      "use.");
  app.add_option("--config", options.config, "scene file (TOML); default: the built-in phantom");
  auto* check_option = app.add_option("--check-config", check, "load this scene and its files, then end");
  check_option->excludes("--config");
  app.add_option("--port", options.port, "TCP port; 0: a free one")->check(whole_between(0, 65535));
  app.add_option("--http-port", options.http_port,
                 "port of the viewer for browsers and its WebSocket; 0: a free one")
      ->check(whole_between(0, 65535));
  app.add_option("--igtl-port", options.igtl_port,
                 "port of OpenIGTLink for 3D Slicer and PLUS (usual: 18944); 0: a free one")
      ->check(whole_between(0, 65535));
  app.add_option(
      "--nats", options.broker,
      "NATS server to publish to, for `brachy relay` on any host; default: the scene's broker.url");
  app.add_option("--duration", options.duration_s, "end after this many seconds")->check(durations());
  app.add_option(
      "--trajectory", options.trajectory,
      "CSV of a scripted needle that an operator can start; default: the scene's device.trajectory");
  app.add_flag("--play", options.play, "start the scripted needle at once, in a loop");
  auto* session = app.add_option(
      "--session", options.session,
      "directory to record poses, forces and seeds in, and the report at the end; a session that it holds\n"
      "(also one that was killed) is resumed, with its seeds in the tissue");
  app.add_option("--sessions", options.sessions,
                 "directory of attempts at exercises: operators begin them in the viewer, each is recorded "
                 "in a directory\n"
                 "of its own and scored")
      ->excludes(session);
  as_short_name(
      Option(app.add_option("--trainee", options.trainee, "who practises; stands in the session's files")));
  app.add_option("--simd", options.simd, "instruction set of the field evaluation; default: the scene's")
      ->check(simd_choices());
  app.add_flag(
      "--control-thread", options.control_thread,
      "run an idle thread on the same deadlines, to distinguish the machine's misses from the simulation's");
  app.add_flag(
      "--insecure-allow-remote", options.insecure_allow_remote,
      "allow server.address to be other than loopback without a token and TLS: anyone who reaches it "
      "may connect");
  app.add_option("--report-every", options.report_every_s,
                 "report every so many seconds: to the log, with --json as a line of JSON")
      ->check(durations());
  app.add_flag("--json", options.json,
               "print the addresses and the closing summary as lines of JSON on standard output");
  double doctor_s = 10;
  auto* doctor = app.add_subcommand("doctor", "check whether this machine can run the scene in real time");
  doctor->footer(
      "Examples:\n"
      "  brachyd doctor                                         the default scene\n"
      "  brachyd doctor --config my.toml                        a sentence, and settings for the "
      "scene\n"
      "  brachyd doctor --config my.toml --seconds 60 --json    longer, as JSON\n"
      "The scene runs as in brachyd, with needles that go in and out, on a separate port.\n"
      "Exit codes: 0 the scene fits, 1 it does not, or the machine is too busy to tell, 2 bad scene or "
      "usage.");
  doctor->add_option("--config", options.config, "scene file (TOML); default: the built-in phantom");
  doctor->add_option("--seconds", doctor_s, "of each measurement (default 10)")->check(durations());
  doctor->add_option("--simd", options.simd, "instruction set of the field evaluation; default: the scene's")
      ->check(simd_choices());
  doctor->add_flag("--json", options.json, "print all findings as JSON");
  exit_code = parse_arguments(app, argc, argv);
  if (!exit_code && !options.trainee.empty() && !options.session && !options.sessions) {
    std::cerr << "brachyd: --trainee needs --session or --sessions\nTry --help.\n";
    exit_code = kExitBadInput;
  }
  if (*doctor) options.doctor_s = doctor_s;
  if (check_option->count()) {
    options.config = check;
    options.check_config = true;
  }
  return options;
}

}  // namespace brachy
