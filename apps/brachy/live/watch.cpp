#include <fmt/format.h>
#include <unistd.h>

#include <deque>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/brachy/live/client_run.h"
#include "apps/command_line/tool.h"
#include "apps/reports/certificate_report.h"
#include "apps/reports/quantiles.h"
#include "apps/terminal/screen.h"
#include "apps/terminal/watch_screen.h"
#include "core/realtime/deadline.h"
#include "core/realtime/histogram.h"

namespace brachy {
namespace {

struct WatchOptions {
  ConnectOptions connect;
  std::optional<double> duration_s;
  bool full = false;
  bool json = false;
};

class Watch {
 public:
  explicit Watch(const WatchOptions& options)
      : options_(options), run_(client_options(options), handlers()) {}

  int run() {
    // On a terminal a screen that is redrawn; to a file or a pipe a line per second.
    if (!options_.json && is_drawable(STDOUT_FILENO)) {
      screen_.emplace(STDOUT_FILENO);
      run_.run(
          options_.connect, options_.duration_s, [this] { draw(); }, kRedraw);
      screen_.reset();
    } else {
      run_.run(options_.connect, options_.duration_s, [this] { print_line(); });
    }
    if (frames_ > 0 || run_.failure().empty()) {
      if (options_.json)
        std::cout << to_json().dump() << "\n";
      else
        print_summary();
    }
    if (run_.failure().empty()) return kExitOk;
    std::cerr << "brachy watch: " << run_.failure() << "\n";
    return kExitFailed;
  }

 private:
  static net::ClientOptions client_options(const WatchOptions& options) {
    net::ClientOptions c = client_options_for(options.connect);
    c.name = "brachy watch";
    if (options.full) c.subscription |= net::kSubscribeFullFrames;
    return c;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_frame = [this](const net::FrameMessage& frame) { take(frame); };
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      view_.server = welcome.server;
      view_.period_ms = 1e3 / welcome.deformation_hz;
    };
    h.on_dose = [this](const net::DoseMessage& dose) {
      dose_ = dose;
      if (prints_lines()) std::cout << dose_line() << std::flush;
    };
    h.on_event = [this](const net::EventMessage& event) {
      const std::string line = fmt::format("  tick {}: {}", event.tick, event.text);
      if (prints_lines()) std::cout << line << "\n" << std::flush;
      view_.events.push_back(line);
      if (view_.events.size() > kEvents) view_.events.pop_front();
    };
    return h;
  }

  void take(const net::FrameMessage& frame) {
    const std::int64_t now_ns = monotonic_ns();
    if (frames_++ == 0) {
      first_ = frame;
      first_ns_ = now_ns;
    }
    // The age of the pose that this mesh shows, which only frames with a new pose give.
    const auto offset = run_.client().clock_offset();
    if (offset && frame.input_sequence != last_.input_sequence && frames_ > 1)
      latency_.record(now_ns + offset->offset_ns - frame.input_received_ns);
    max_displacement_ = std::max(max_displacement_, frame.max_displacement_mm);
    moved_ = std::max(moved_, frame.moved_vertices);
    for (const net::NeedleRecord& needle : frame.needles)
      tip_deflection_mm_ = std::max(tip_deflection_mm_, needle.state.shape.tip_deflection_mm());
    certificates_.add(frame.certificate, frame.step_flags, frame.lag_mm, all_finite(frame.positions));
    if (screen_) remember(frame);
    last_ = frame;
    last_.positions.clear();
    last_ns_ = now_ns;
  }

  bool prints_lines() const { return !options_.json && !screen_; }

  // For the sparklines.
  void remember(const net::FrameMessage& frame) {
    const double t_s = frame.sim_time_s;
    view_.displacement.add(t_s, frame.max_displacement_mm);
    view_.det.add(t_s, frame.certificate ? frame.certificate->vertex_det : Certificate::kNotKnown);
    const std::size_t known = view_.needles.size();
    view_.needles.resize(frame.needles.size());
    for (std::size_t i = 0; i < frame.needles.size(); ++i) {
      const NeedleState& now = frame.needles[i].state;
      WatchScreen::Needle& needle = view_.needles[i];
      needle.id = frame.needles[i].id;
      needle.contact = now.present ? std::string(to_string(now.contact)) : "no needle";
      needle.depth_mm = now.insertion_depth_mm;
      needle.axial_n = now.forces.axial_n;
      needle.lateral_n = now.forces.lateral_n;
      needle.tip_deflection_mm = now.shape.tip_deflection_mm();
      needle.axial.add(t_s, now.forces.axial_n, i < known && now.puncture_count > needle.punctures);
      needle.punctures = now.puncture_count;
    }
  }

  void draw() {
    const std::int64_t now_ns = monotonic_ns();
    const net::StateMessage& state = run_.last_state();
    WatchScreen& v = view_;
    v.address = fmt::format("{}:{}", options_.connect.host, options_.connect.port);
    v.device = state.device_holder;
    if (const net::ControlsState& model = state.controls; !model.kernel.empty())
      v.model = fmt::format("{}, {:g} mm{}", model.kernel, model.support_radius_mm,
                            model.flags & net::kScriptPlays ? ", script plays" : "");
    v.silence_s = 1e-9 * static_cast<double>(now_ns - (frames_ ? last_ns_ : begin_ns_));
    v.sim_time_s = last_.sim_time_s;
    v.ticks = ticks();
    v.overruns = overruns();
    v.tick_p50_ms = state.tick_ms.p50;
    v.tick_p99_ms = state.tick_ms.p99;
    v.latency_p50_ms = latency_.count() ? latency_ms(0.5) : Certificate::kNotKnown;
    v.latency_p99_ms = latency_.count() ? latency_ms(0.99) : Certificate::kNotKnown;
    v.dropped = state.snapshots_dropped;
    v.gaps = run_.client().snapshots_missed();
    v.verdict = frames_ ? verdict_line() : "";
    v.displacement_mm = last_.max_displacement_mm;
    v.moved = last_.moved_vertices;
    v.seeds = static_cast<std::uint32_t>(run_.client().mesh().seeds().size());
    if (!dose_.structures.empty()) {
      v.dose_name = dose_.structures.front().name;
      v.v100_percent = dose_.structures.front().v100_percent;
      v.d90_gy = dose_.structures.front().d90_gy;
      v.prescription_gy = dose_.prescription_gy;
    }
    counts_.push_back({now_ns, frames_, last_.tick, run_.client().bytes_received()});
    if (counts_.size() > kCounts) counts_.pop_front();
    const Counts &then = counts_.front(), &now = counts_.back();
    const double passed_s = 1e-9 * static_cast<double>(now.at_ns - then.at_ns);
    const auto rate = [&](std::uint64_t from, std::uint64_t to) {
      return passed_s > 0 && to > from ? static_cast<double>(to - from) / passed_s : 0;
    };
    v.frames_hz = rate(then.frames, now.frames);
    v.ticks_hz = rate(then.tick, now.tick);
    v.bytes_per_s = rate(then.bytes, now.bytes);
    screen_->draw(render(v, screen_->size(), wants_colour()));
  }

  /// Of the first structure, the gland.
  std::string dose_line() const {
    if (dose_.structures.empty()) return "";
    const StructureDose& gland = dose_.structures.front();
    return fmt::format("  dose of {} seeds: {} V100 {:.1f} %, D90 {:.1f} Gy\n", dose_.seeds, gland.name,
                       gland.v100_percent, gland.d90_gy);
  }

  std::string verdict_line() const { return one_line(last_.certificate, last_.step_flags, last_.lag_mm); }
  std::uint64_t ticks() const { return last_.tick - first_.tick; }
  std::uint64_t overruns() const { return last_.overruns - first_.overruns; }
  double sim_hz() const {
    const double elapsed_s = 1e-9 * static_cast<double>(last_.publish_ns - first_.publish_ns);
    return elapsed_s > 0 ? static_cast<double>(ticks()) / elapsed_s : 0;
  }
  double snapshots_hz() const {
    const double elapsed_s = 1e-9 * static_cast<double>(last_ns_ - first_ns_);
    return elapsed_s > 0 ? static_cast<double>(frames_ - 1) / elapsed_s : 0;
  }
  double latency_ms(double q) const { return 1e-6 * static_cast<double>(latency_.quantile(q)); }

  void print_line() {
    if (frames_ == 0) return;
    const NeedleState needle = last_.needles.empty() ? NeedleState{} : last_.needles[0].state;
    const std::string line = fmt::format(
        "t {:7.2f} s  {:9}  depth {:5.1f} mm  displaced {:5.2f} mm  moved {:6}  {}  missed {}  drops {}\n",
        last_.sim_time_s, needle.present ? to_string(needle.contact) : "no needle", needle.insertion_depth_mm,
        last_.max_displacement_mm, last_.moved_vertices, verdict_line(), overruns(),
        run_.last_state().snapshots_dropped);
    (options_.json ? std::cerr : std::cout) << line << std::flush;
  }

  nlohmann::ordered_json to_json() const {
    const net::StateMessage& state = run_.last_state();
    nlohmann::ordered_json json = {
        {"ticks", ticks()},
        {"overruns", overruns()},
        {"control_overruns", state.control_overruns - run_.first_state().control_overruns},
        {"sim_hz", sim_hz()},
        {"snapshots", frames_},
        {"snapshots_hz", snapshots_hz()},
        {"tick_ms", to_json_ms(state.tick_ms)},
        {"lateness_ms", to_json_ms(state.lateness_ms)},
        {"latency_ms", to_json_ms(latency_)},
        {"drops", state.snapshots_dropped},
        {"seq_gaps", run_.client().snapshots_missed()},
        {"max_disp_mm", max_displacement_},
        {"moved", moved_},
        {"bytes", run_.client().bytes_received()}};
    add_to_json(json, "frames", certificates_);
    json["seeds"] = run_.client().mesh().seeds().size();
    if (!dose_.structures.empty()) {
      json["dose_seeds"] = dose_.seeds;
      json["v100_percent"] = dose_.structures.front().v100_percent;
      json["d90_gy"] = dose_.structures.front().d90_gy;
    }
    json["max_tip_deflection_mm"] = tip_deflection_mm_;
    return json;
  }

  void print_summary() const {
    const net::StateMessage& state = run_.last_state();
    std::cout << fmt::format(
        "watch: {} ticks at {:.1f} Hz, {} missed; {} snapshots at {:.1f} Hz, {} dropped, {} sequence gaps\n"
        "  tick time p50 {:.3f} ms, p99 {:.3f} ms, max {:.3f} ms; pose to this client p50 {:.1f} ms, p99 "
        "{:.1f} ms\n"
        "  largest displacement {:.2f} mm; at most {} points moved; {:.1f} MB received\n{}",
        ticks(), sim_hz(), overruns(), frames_, snapshots_hz(), state.snapshots_dropped,
        run_.client().snapshots_missed(), state.tick_ms.p50, state.tick_ms.p99, state.tick_ms.max,
        latency_ms(0.5), latency_ms(0.99), max_displacement_, moved_,
        1e-6 * static_cast<double>(run_.client().bytes_received()), to_text("frames", certificates_));
    if (tip_deflection_mm_ > 0)
      std::cout << fmt::format("  tip deflected by at most {:.2f} mm\n", tip_deflection_mm_);
    std::cout << dose_line();
  }

  static constexpr std::chrono::milliseconds kRedraw{100};
  static constexpr std::size_t kEvents = 40, kCounts = 20;  // kept; counts at every redrawing, for the rates
  struct Counts {
    std::int64_t at_ns;
    std::uint64_t frames, tick, bytes;
  };

  WatchOptions options_;
  const std::int64_t begin_ns_ = monotonic_ns();
  std::optional<TerminalScreen> screen_;  // none: lines are printed
  WatchScreen view_;
  std::deque<Counts> counts_;
  std::uint64_t frames_ = 0;
  net::FrameMessage first_, last_;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  double max_displacement_ = 0;
  std::uint32_t moved_ = 0;
  double tip_deflection_mm_ = 0;
  CertificateTally certificates_;
  net::DoseMessage dose_;  // the newest
  Histogram latency_;
  ClientRun run_;
};

int run(const WatchOptions& options) {
  return Watch(options).run();
}

void declare(OptionList& list, WatchOptions& options) {
  add_connect_options(list, options.connect, "the daemon").required();
  as_duration(list.add("--duration", options.duration_s, "seconds; default: until the daemon ends"));
  list.add_flag("--full", options.full, "request whole meshes instead of changes");
  list.add_flag("--json", options.json, "print the counters as JSON at the end");
}

}  // namespace

Tool watch_tool() {
  return make_tool<WatchOptions>("watch", "Follow a daemon as a viewer: a live picture, or its counters.",
                                 R"(Examples:
  brachy watch --connect 127.0.0.1:18950                 on a terminal: bars and sparklines, until Ctrl-C
  brachy watch --connect 127.0.0.1:18950 > watch.log     otherwise a line per second
  brachy watch --connect 127.0.0.1:18950 --duration 10 --json
NO_COLOR=1: without colours. TERM=dumb: lines on a terminal too.)",
                                 declare, run);
}

}  // namespace brachy
