#include <fmt/format.h>

#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/brachy/files/recording_folder.h"
#include "apps/brachy/live/client_run.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/recording/recording_tally.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"

namespace brachy {
namespace {

struct RecordOptions {
  ConnectOptions connect;
  std::filesystem::path out;  ///< a file NAME.brachy, or a directory
  std::optional<double> duration_s;
  bool surface = false;  ///< the surface's points only
  bool json = false;
};

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options)
      : options_(options),
        is_file_(options.out.extension() == kRecordingExtension),
        run_(client_options(), handlers()) {
    if (!is_file_) {
      folder_.emplace(options.out, options.surface);
      return;
    }
    check_output(options.out, true);
    if (std::filesystem::exists(options.out))
      throw UserError(options.out.string() + ": exists already; give another name, nothing is overwritten");
  }

  int run() {
    run_.run(options_.connect, options_.duration_s, [this] { show_progress(); });
    attempt([&] {
      if (folder_) folder_->close();
    });
    progress_.finish();
    report();
    if (failure_.empty()) failure_ = run_.failure();
    if (failure_.empty()) return kExitOk;
    std::cerr << "brachy record: " << failure_ << "\n";
    return kExitFailed;
  }

 private:
  net::ClientOptions client_options() const {
    net::ClientOptions c = client_options_for(options_.connect);
    c.name = "brachy record";
    c.subscription = net::kSubscribePoseHistory | net::kSubscribeScene | net::kSubscribeUltrasound;
    c.image_flags = net::kScannerOnly;  // brachy us makes the images again
    if (options_.surface) c.subscription |= net::kSubscribeSurface;
    return c;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h{tally_.handlers(), {}};
    h.on_message = [this, count = h.on_message](const net::Header& header, std::span<const std::byte> body) {
      attempt([&] {
        write(header, body);
        count(header, body);
      });
    };
    h.on_welcome = [this, take = h.on_welcome](const net::WelcomeMessage& welcome) {
      take(welcome);
      if (is_file_ && options_.surface && !(welcome.subscription & net::kSubscribeSurface))
        std::cerr << "brachy record: the daemon cannot send the surface alone; all points are recorded\n";
    };
    return h;
  }

  // The file is created with the first message, so that a failed connection leaves nothing behind.
  void write(const net::Header& header, std::span<const std::byte> body) {
    if (folder_) {
      folder_->messages().take(header, body);
      return;
    }
    if (!file_) file_.emplace(options_.out);
    file_->add(header, body);
  }

  // What has been written stays; the first failure ends the recording.
  template <class F>
  void attempt(F&& write) {
    if (!failure_.empty()) return;
    try {
      write();
    } catch (const std::exception& e) {
      failure_ = e.what();
      run_.finish();
    }
  }

  void show_progress() {
    const double share = options_.duration_s ? tally_.duration_s() / *options_.duration_s
                                             : std::numeric_limits<double>::quiet_NaN();
    progress_.show(
        share,
        fmt::format("{} snapshots, {} seeds{}", tally_.frames(), tally_.seeds(),
                    file_ ? fmt::format(", {:.1f} MB", 1e-6 * static_cast<double>(file_->bytes())) : ""));
  }

  void report() const {
    const std::string out = options_.out.string();
    const std::uint64_t missed = tally_.ticks_missed();
    if (options_.json) {
      nlohmann::ordered_json json = {{"out", out}, {"snapshots", tally_.frames()}, {"poses", tally_.poses()}};
      if (folder_) json["forces"] = folder_->counts().forces;
      if (is_file_) json["bytes"] = file_ ? file_->bytes() : 0;
      json["seeds"] = tally_.seeds();
      json["events"] = tally_.events();
      json["ticks_missed"] = missed;
      json["seq_gaps"] = run_.client().snapshots_missed();
      std::cout << json.dump() << "\n";
      return;
    }
    std::cout << "record: "
              << (folder_ ? to_text(*folder_)
                          : fmt::format("{} snapshots, {} poses, {} seeds, {} events in {}, {:.1f} MB",
                                        tally_.frames(), tally_.poses(), tally_.seeds(), tally_.events(), out,
                                        1e-6 * static_cast<double>(file_ ? file_->bytes() : 0)))
              << (missed && !folder_ ? fmt::format("; {} ticks' poses were missed\n", missed) : "\n");
  }

  RecordOptions options_;
  const bool is_file_;
  RecordingTally tally_;
  std::optional<RecordingWriter> file_;
  std::optional<RecordingFolder> folder_;
  Progress progress_{"record"};
  std::string failure_;
  ClientRun run_;
};

int run(const RecordOptions& options) {
  return Recorder(options).run();
}

void declare(OptionList& list, RecordOptions& options) {
  add_connect_options(list, options.connect, "the daemon").required();
  list.add_output_folder("--out", options.out,
                         "file NAME.brachy, or directory to write; nothing is overwritten")
      .required();
  as_duration(list.add("--duration", options.duration_s, "seconds; default: until the daemon ends"));
  list.add_flag("--surface", options.surface, "request the surface only: a tenth of the space");
  list.add_flag("--json", options.json, "print the result as JSON");
}

}  // namespace

Tool record_tool() {
  return make_tool<RecordOptions>(
      "record", "Write what a daemon sends: a recording, or a .pvd/.vtp series with pose log and force log.",
      R"(Examples:
  brachy record --connect 127.0.0.1:18950 --out run1.brachy           one file, a fraction of the space
  brachy export run1.brachy --out out/run1; brachy replay run1.brachy --offline
  brachy record --connect 127.0.0.1:18950 --out out/run1 --duration 10
  paraview out/run1/recording.pvd; brachy replay out/run1/poses.csv --offline
  brachy plot-force out/run1/forces.csv
A file NAME.brachy ("Recording file" in net/PROTOCOL.md) holds the mesh's changes, every tick's poses, events,
states, seeds and dose as they were received; if the recorder is killed, the file is valid up to that moment.
The browser viewer opens it.
In a directory, poses.csv has every tick's pose of every needle, forces.csv each snapshot's force on it.
Exit codes: 0 done, 1 the connection or the disk failed, 2 bad usage, or --out exists already.)",
      declare, run);
}

}  // namespace brachy
