#include "apps/terminal/watch_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

constexpr std::size_t kLabelColumns = 11, kTextColumns = 33;
constexpr double kQuietS = 1;  // longer times without a frame are shown
enum class Colour { kNone = 0, kRed = 31, kGreen = 32, kYellow = 33, kBlue = 36 };

class Lines {
 public:
  Lines(TerminalSize size, bool colour) : size_(size), colour_(colour) {}

  void add(const std::string& line) {
    if (lines_.size() < size_.rows) lines_.push_back(cut_to(line, size_.columns));
  }
  /// A label, a text, and a bar or chart that fills the remaining `columns` of the line.
  template <class Picture>
  void add(const std::string& label, const std::string& text, Colour colour, const Picture& picture) {
    const std::size_t used = kLabelColumns + kTextColumns + 1;
    std::string line = padded_to(label, kLabelColumns) + padded_to(text, kTextColumns);
    if (size_.columns > used + 4) line += ' ' + painted(picture(size_.columns - used), colour);
    add(line);
  }

  std::string painted(const std::string& text, Colour colour) const {
    if (!colour_ || colour == Colour::kNone) return text;
    return fmt::format("\x1b[{}m{}\x1b[0m", static_cast<int>(colour), text);
  }
  std::size_t rows_left() const { return size_.rows - lines_.size(); }
  std::vector<std::string> take() { return std::move(lines_); }

 private:
  const TerminalSize size_;
  const bool colour_;
  std::vector<std::string> lines_;
};

/// The end of a scale that holds `most`: `least` or a doubling of it.
double scale_for(double most, double least) {
  while (most > least) least *= 2;
  return least;
}

std::string number(double value, const char* format) {
  return std::isnan(value) ? "–" : fmt::format(fmt::runtime(format), value);
}

auto bar_of(double share) {
  return [share](std::size_t columns) { return "▕" + bar(share, columns - 2) + "▏"; };
}

void add_head(Lines& lines, const WatchScreen& s) {
  std::string head = fmt::format("{} at {}", s.server.empty() ? "brachyd" : s.server, s.address);
  if (!s.model.empty()) head += "   model " + s.model;
  if (!s.device.empty()) head += "   device " + s.device;
  lines.add(head);
  const std::string missed = fmt::format("{} of {} deadlines missed", s.overruns, s.ticks);
  lines.add(fmt::format("t {:.2f} s   {:.1f} Hz, {}", s.sim_time_s, s.ticks_hz,
                        lines.painted(missed, s.overruns ? Colour::kYellow : Colour::kNone)));
  const std::string lost = fmt::format("{} dropped, {} gaps", s.dropped, s.gaps);
  std::string frames = fmt::format("{:.1f} frames/s, {}, {:.2f} MB/s", s.frames_hz,
                                   lines.painted(lost, s.dropped + s.gaps ? Colour::kYellow : Colour::kNone),
                                   1e-6 * s.bytes_per_s);
  if (s.silence_s > kQuietS)
    frames += "   " + lines.painted(fmt::format("NOTHING for {:.0f} s", s.silence_s), Colour::kRed);
  lines.add(frames);
  lines.add("");
}

void add_times(Lines& lines, const WatchScreen& s) {
  const double share = s.tick_p99_ms / s.period_ms;
  lines.add("tick",
            fmt::format("p50 {}  p99 {} of {:.2f} ms", number(s.tick_p50_ms, "{:.2f}"),
                        number(s.tick_p99_ms, "{:.2f}"), s.period_ms),
            share > 1 ? Colour::kRed : Colour::kGreen, bar_of(share));
  const double scale = scale_for(s.latency_p99_ms, 25);
  lines.add("latency",
            fmt::format("p50 {}  p99 {} of {:.0f} ms", number(s.latency_p50_ms, "{:.1f}"),
                        number(s.latency_p99_ms, "{:.1f}"), scale),
            Colour::kGreen, bar_of(s.latency_p99_ms / scale));
}

void add_field(Lines& lines, const WatchScreen& s) {
  const bool is_injective = s.verdict.starts_with("injective");
  lines.add("det J", lines.painted(s.verdict, is_injective ? Colour::kNone : Colour::kRed), Colour::kBlue,
            [&](std::size_t columns) { return s.det.sparkline(columns, std::fmin(0, s.det.smallest()), 1); });
  lines.add("displaced", fmt::format("{:.2f} mm, {} points", s.displacement_mm, s.moved), Colour::kBlue,
            [&](std::size_t columns) {
              return s.displacement.sparkline(columns, 0, scale_for(s.displacement.largest(), 1));
            });
}

void add_needle(Lines& lines, const WatchScreen::Needle& needle) {
  lines.add("");
  const double depth = scale_for(needle.depth_mm, 40);
  lines.add(fmt::format("needle {}", needle.id),
            fmt::format("{:9} {:5.1f} of {:.0f} mm deep", needle.contact, needle.depth_mm, depth),
            Colour::kBlue, bar_of(needle.depth_mm / depth));
  const double scale = scale_for(
      std::fmax(std::fmax(needle.axial.largest(), -needle.axial.smallest()), std::abs(needle.axial_n)), 4);
  lines.add("  axial",
            fmt::format("{:+.2f} N of ±{:.0f}, {:.2f} N across", needle.axial_n, scale, needle.lateral_n),
            needle.axial_n < 0 ? Colour::kYellow : Colour::kGreen, [&](std::size_t columns) {
              return centred_bar(needle.axial_n / scale, columns - 1 + columns % 2);
            });
  const std::string bent =
      needle.tip_deflection_mm > 0 ? fmt::format(", tip {:.1f} mm off", needle.tip_deflection_mm) : "";
  lines.add("", fmt::format("{} punctures ▼{}", needle.punctures, bent), Colour::kBlue,
            [&](std::size_t columns) {
              return needle.axial.sparkline(columns, std::fmin(0, needle.axial.smallest()), scale);
            });
}

void add_dose(Lines& lines, const WatchScreen& s) {
  if (s.seeds == 0 && s.dose_name.empty()) return;
  lines.add("");
  std::string text = fmt::format("{} seeds", s.seeds);
  if (s.dose_name.empty()) return lines.add(text);
  lines.add(text,
            fmt::format("{} D90 {} of {:.0f} Gy", s.dose_name, number(s.d90_gy, "{:.1f}"), s.prescription_gy),
            Colour::kGreen, bar_of(s.d90_gy / s.prescription_gy));
  lines.add("", fmt::format("V100 {} %", number(s.v100_percent, "{:.1f}")), Colour::kGreen,
            bar_of(0.01 * s.v100_percent));
}

void add_events(Lines& lines, const WatchScreen& s) {
  if (s.events.empty() || lines.rows_left() < 2) return;
  lines.add("");
  const std::size_t count = std::min(lines.rows_left(), s.events.size());
  for (std::size_t i = s.events.size() - count; i < s.events.size(); ++i) lines.add(s.events[i]);
}

}  // namespace

std::vector<std::string> render(const WatchScreen& screen, TerminalSize size, bool colour) {
  Lines lines(size, colour);
  add_head(lines, screen);
  add_times(lines, screen);
  add_field(lines, screen);
  // Of many needles those that fit beside dose and events.
  constexpr std::size_t kRowsOfNeedle = 4, kRowsBelow = 5;
  std::size_t shown = 0;
  for (const WatchScreen::Needle& needle : screen.needles) {
    if (shown > 0 && lines.rows_left() < kRowsOfNeedle + kRowsBelow) break;
    add_needle(lines, needle);
    ++shown;
  }
  if (shown < screen.needles.size())
    lines.add(fmt::format("… and {} more needles", screen.needles.size() - shown));
  add_dose(lines, screen);
  add_events(lines, screen);
  return lines.take();
}

}  // namespace brachy
