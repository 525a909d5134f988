// The command lines of the tools that meet a daemon: replay, watch, record; and export of what was recorded.
#include <memory>

#include "apps/command_line_parts.h"
#include "core/error.h"

namespace brachy {

namespace {

void add_device_options(CLI::App& command, SimulatedDeviceOptions& device, CLI::Option* dynamics) {
  const auto number = [&](const char* name, double& value, const char* what, double least, double most) {
    command.add_option(name, value, what)
        ->needs(dynamics)
        ->check(between(least, most))
        ->capture_default_str();
  };
  number("--mass-kg", device.mass_kg, "of the device at its tip", 0.001, 10);
  number("--damping", device.damping_n_s_per_m, "of the device, N·s/m", 0.001, 1000);
  number("--hand-stiffness", device.hand_stiffness_n_per_m, "of the grip, N/m", 0, 1e5);
  number("--hand-damping", device.hand_damping_n_s_per_m, "of the grip, N·s/m", 0, 1000);
  number("--device-hz", device.rate_hz, "cycles a second", 50, 4000);
  number("--encoder-um", device.encoder_um, "step of its positions; 0: none", 0, 1000);
  number("--max-force", device.max_force_n, "N that it can take", 0.01, 100);
  number("--delay-ms", device.delay_ms, "added each way between device and simulation", 0, 1000);
  number("--drop", device.drop_share, "share of the poses that are lost", 0, 1);
  command.add_option("--seed", device.seed, "of which are lost")->needs(dynamics)->capture_default_str();
  command
      .add_flag("--simple-client", device.simple_client,
                "forces come over the wire, not from the local model")
      ->needs(dynamics);
}

}  // namespace

ToolLine add_replay(CLI::App& app) {
  struct Said : ReplayOptions {
    ConnectOptions daemon;
    std::vector<double> translate;
    bool offline = false, dynamics = false;
    SimulatedDeviceOptions simulated;
  };
  auto options = std::make_shared<Said>();
  auto* command = app.add_subcommand("replay", "Play a needle trajectory into a daemon, or step it offline.");
  command->footer(
      "Examples:\n"
      "  brachy replay config/insertion.csv --connect 127.0.0.1:18950\n"
      "  brachy replay run1.brachy --offline --config config/prostate.toml      a recording: the same ticks "
      "again\n"
      "  brachy replay insertion.csv --offline --config config/prostate.toml --json\n"
      "  brachy replay config/insertion_5mm_s.csv --offline --log force.csv\n"
      "  brachy replay config/insertion_three_needles.csv --offline --config three.toml   needle.count = 3 "
      "there\n"
      "  brachy replay config/insertion.csv --offline --device-dynamics --delay-ms 20 --drop 0.01\n"
      "  brachy replay config/insertion.csv --connect 127.0.0.1:18950 --device-dynamics --hand-stiffness "
      "800\n"
      "With --device-dynamics the trajectory is the hand's: it holds a device with mass, which feels the "
      "force and\n"
      "moves the needle (the file's first). Reported: peak force, largest jump in a millisecond, "
      "oscillation.\n"
      "A file with the column needle behind m23 moves several needles, with --connect each as a\n"
      "device of its own; one without moves needle 0. In the column button, the last, 1 is a button held "
      "from that\n"
      "row to the needle's next: pressed, it drops seeds.\n"
      "The log has a row a tick and needle: t_s,needle,state,depth_mm,fx_n,fy_n,fz_n,axial_n,lateral_n,\n"
      "cutting_n,friction_n,landmarks,min_det; brachy plot-force draws it.");
  command
      ->add_option("trajectory", options->trajectory,
                   "CSV: t_s,m00,…,m23[,needle][,button] (X_WN, mm), or a recording")
      ->required();
  auto* replay_connect = add_connect_options(*command, options->daemon, "the daemon to play into");
  auto* offline_flag =
      command->add_flag("--offline", options->offline, "no clock, no network: step and print a hash");
  offline_flag->excludes(replay_connect);
  command->add_option("--config", options->config, "scene for --offline; default: the built-in phantom")
      ->needs(offline_flag);
  command->add_option("--threads", options->threads, "OpenMP threads for --offline; default: the scene's")
      ->needs(offline_flag)
      ->check(CLI::Range(1, 64));
  command->add_option("--simd", options->simd, "instruction set for --offline; default: the scene's")
      ->needs(offline_flag)
      ->check(simd_choices());
  command
      ->add_option("--log", options->log,
                   "for --offline: the force on every needle in every tick, as CSV; must not be there yet")
      ->needs(offline_flag);
  command
      ->add_option("--session", options->session,
                   "for --offline: folder for poses, forces and seeds, as brachyd --session records them")
      ->needs(offline_flag);
  command->add_option("--rate-hz", options->rate_hz, "poses a second; between samples they are interpolated")
      ->needs(replay_connect)
      ->check(between(1.0, 2000.0))
      ->capture_default_str();
  command->add_option("--speed", options->speed, "1: as recorded, 2: twice as fast")
      ->check(between(0.01, 100.0))
      ->capture_default_str();
  command->add_flag("--loop", options->loop, "start over at the end, until interrupted")
      ->needs(replay_connect);
  command->add_flag("--centre-on-tissue", options->centre_on_tissue,
                    "move the trajectory so that the place where its tip dwells is the tissue's centre");
  command->add_option("--translate-mm", options->translate, "then move it by x,y,z")
      ->delimiter(',')
      ->expected(3)
      ->check(between(-1e4, 1e4));
  auto* dynamics =
      command->add_flag("--device-dynamics", options->dynamics, "a device with mass between hand and needle");
  add_device_options(*command, options->simulated, dynamics);
  command->add_flag("--json", options->json, "print the result as JSON");
  return {command, [options]() -> ToolOptions {
            if (!options->offline && options->daemon.host.empty())
              throw UserError("needs --connect HOST:PORT or --offline");
            ReplayOptions replay = *options;
            if (!options->offline) replay.connect = options->daemon;
            if (options->dynamics) replay.device = options->simulated;
            if (const auto& mm = options->translate; !mm.empty())
              replay.translate_mm = Vec3(mm[0], mm[1], mm[2]);
            return replay;
          }};
}

ToolLine add_watch(CLI::App& app) {
  auto options = std::make_shared<WatchOptions>();
  auto* command =
      app.add_subcommand("watch", "Follow a daemon as a viewer: a live picture, or its counters.");
  command->footer(
      "Examples:\n"
      "  brachy watch --connect 127.0.0.1:18950                 on a terminal: bars and sparklines, until "
      "Ctrl-C\n"
      "  brachy watch --connect 127.0.0.1:18950 > watch.log     otherwise a line a second\n"
      "  brachy watch --connect 127.0.0.1:18950 --duration 10 --json\n"
      "NO_COLOR=1: without colours. TERM=dumb: lines on a terminal too.");
  add_connect_options(*command, options->connect, "the daemon")->required();
  command->add_option("--duration", options->duration_s, "seconds; default: until the daemon ends")
      ->check(durations());
  command->add_flag("--full", options->full, "ask for whole meshes instead of changes");
  command->add_flag("--json", options->json, "print the counters as JSON at the end");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_record(CLI::App& app) {
  auto options = std::make_shared<RecordOptions>();
  auto* command = app.add_subcommand(
      "record", "Write what a daemon sends: a recording, or a .pvd/.vtp series with pose log and force log.");
  command->footer(
      "Examples:\n"
      "  brachy record --connect 127.0.0.1:18950 --out run1.brachy           one file, a fraction of the "
      "space\n"
      "  brachy export run1.brachy --out out/run1; brachy replay run1.brachy --offline\n"
      "  brachy record --connect 127.0.0.1:18950 --out out/run1 --duration 10\n"
      "  paraview out/run1/recording.pvd; brachy replay out/run1/poses.csv --offline\n"
      "  brachy plot-force out/run1/forces.csv\n"
      "A file NAME.brachy (\"Recording file\" in net/PROTOCOL.md) has the mesh's changes, every tick's "
      "poses, "
      "events,\n"
      "states, seeds and dose as they came; killed at any moment it is good up to there. The browser viewer "
      "opens "
      "it.\n"
      "In a folder poses.csv has every tick's pose of every needle, forces.csv each snapshot's force on it.\n"
      "Exit codes: 0 done, 1 the connection or the disk failed, 2 bad usage, or --out is there already.");
  add_connect_options(*command, options->connect, "the daemon")->required();
  command->add_option("--out", options->out, "file NAME.brachy, or folder to write; nothing is overwritten")
      ->required();
  command->add_option("--duration", options->duration_s, "seconds; default: until the daemon ends")
      ->check(durations());
  command->add_flag("--surface", options->surface, "ask for the surface only: a tenth of the space");
  command->add_flag("--json", options->json, "print the result as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_relay(CLI::App& app) {
  auto options = std::make_shared<RelayOptions>();
  auto* command = app.add_subcommand(
      "relay", "Serve viewers, on any host, a session that a daemon publishes to a NATS server.");
  command->footer(
      "Examples:\n"
      "  nats-server -a 127.0.0.1                                                  Debian: apt install "
      "nats-server\n"
      "  brachyd --config config/prostate.toml --nats nats://127.0.0.1:4222\n"
      "  brachy relay --nats nats://127.0.0.1:4222 --port 18960 --http-port 18961\n"
      "  brachy watch --connect 127.0.0.1:18960                                    or a browser at "
      "http://127.0.0.1:18961\n"
      "  brachy relay --nats tls://TOKEN@broker.example:4222 --nats-ca ca.pem --session theatre-2 --address "
      "0.0.0.0 \\\n"
      "    --token-file viewer.token --tls-certificate relay.pem --tls-key relay.key\n"
      "Viewers get what they get beside the daemon (net/PROTOCOL.md). Here they only watch: devices and "
      "operators connect\n"
      "to the daemon. The first line, once the session is there: brachy relay listening on ADDRESS:PORT. It "
      "waits for broker\n"
      "and daemon for as long as they are away.\n"
      "Exit codes: 0 ended by Ctrl-C or --duration, 1 failed while running, 2 bad usage, or the port is in "
      "use.");
  command
      ->add_option("--nats", options->broker, "the NATS server: nats://[USER:PASSWORD@ or TOKEN@]HOST:4222")
      ->required();
  command->add_option("--session", options->session, "the daemon's broker.session")->capture_default_str();
  command->add_option("--nats-ca", options->broker_ca, "PEM: who signed the NATS server's certificate");
  auto* own = command->add_option("--nats-certificate", options->broker_certificate, "PEM, shown to it");
  auto* own_key = command->add_option("--nats-key", options->broker_key, "PEM, of that");
  own->needs(own_key);
  own_key->needs(own);
  command->add_option("--address", options->address, "to listen on; other than loopback takes token and TLS")
      ->capture_default_str();
  command->add_option("--port", options->port, "for viewers; 0: a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command->add_option("--http-port", options->http_port, "of the viewer for browsers; 0: a free one")
      ->check(CLI::Range(0, 65535));
  command->add_option("--token-file", options->token_file, "what viewers show (`brachy token`)");
  auto* certificate =
      command->add_option("--tls-certificate", options->tls_certificate, "PEM: TLS for viewers");
  auto* key = command->add_option("--tls-key", options->tls_key, "PEM, of that");
  certificate->needs(key);
  key->needs(certificate);
  command->add_option("--max-clients", options->max_clients, "on all ports together")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  command->add_option("--max-clients-per-address", options->max_clients_per_address, "of them")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  command->add_flag("--insecure-allow-remote", options->insecure_allow_remote,
                    "allow --address to be other than loopback without a token and TLS");
  command->add_option("--duration", options->duration_s, "end after this many seconds")->check(durations());
  command->add_flag("--json", options->json, "print what was relayed as JSON at the end");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_token(CLI::App& app) {
  auto options = std::make_shared<TokenOptions>();
  auto* command =
      app.add_subcommand("token", "Make a token: what a daemon wants to see before it lets anybody in.");
  command->footer(
      "Examples:\n"
      "  brachy token operator.token                    32 random bytes, for your eyes alone\n"
      "  brachy watch --connect 127.0.0.1:18950 --token-file operator.token\n"
      "  brachy token --show operator.token             for a browser: http://127.0.0.1:PORT/#token=…\n"
      "The daemon's scene names it: token_file (any role), device_token_file (device, viewer) or\n"
      "viewer_token_file under [server].\n"
      "Exit codes: 0 done, 2 the file is there already, or is no token.");
  command->add_option("file", options->file, "to make; nothing is overwritten")->required();
  command->add_flag("--show", options->show, "print the token that is in it, as 64 hexadecimal digits");
  return {command, [options]() -> ToolOptions { return *options; }};
}

ToolLine add_export(CLI::App& app) {
  auto options = std::make_shared<ExportOptions>();
  auto* command = app.add_subcommand("export", "Write a recording as files for ParaView and spreadsheets.");
  command->footer(
      "Examples:\n"
      "  brachy export run1.brachy --out out/run1\n"
      "  paraview out/run1/recording.pvd; brachy plot-force out/run1/forces.csv; brachy score out/run1\n"
      "The same files as `brachy record --out DIR` writes: recording.pvd with a .vtp a snapshot, poses.csv, "
      "forces.csv,\n"
      "seeds.csv, events.csv, structures/. After a reset of the simulation what follows goes into run_2, … "
      "within.\n"
      "Exit codes: 0 done, 1 the disk failed, 2 no recording, or --out holds one already.");
  command->add_option("recording", options->recording, "of `brachy record --out NAME.brachy`")->required();
  command->add_option("--out", options->out, "folder to write; made if missing, must hold no recording")
      ->required();
  command->add_flag("--surface", options->surface, "write the surface only: a tenth of the space");
  command->add_flag("--json", options->json, "print the result as JSON");
  return {command, [options]() -> ToolOptions { return *options; }};
}

}  // namespace brachy
