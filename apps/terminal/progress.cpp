#include "apps/terminal/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>

#include "apps/terminal/terminal.h"
#include "core/realtime/deadline.h"

namespace brachy {
namespace {

constexpr double kEstimateS = 1;          // before, the remaining time cannot be estimated
constexpr double kEstimateShare = 0.001;  // likewise

}  // namespace

std::string duration_text(double seconds) {
  const auto s = static_cast<std::uint64_t>(std::ceil(std::max(0.0, seconds)));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

std::optional<std::string> ProgressText::at(double t_s, double share, const std::string& detail) {
  if (t_s - last_s_ < between_s_) return std::nullopt;
  last_s_ = t_s;
  std::string text = command_ + ": ";
  if (std::isnan(share)) {
    text += duration_text(t_s);
  } else {
    share = std::clamp(share, 0.0, 1.0);
    text += fmt::format("{:.0f} %", std::floor(100 * share));
    if (t_s >= kEstimateS && share >= kEstimateShare)
      text += fmt::format(", {} left", duration_text(t_s * (1 - share) / share));
  }
  return detail.empty() ? text : text + ", " + detail;
}

Progress::Progress(std::string command)
    : is_redrawn_(is_drawable(STDERR_FILENO)),
      text_(std::move(command), is_redrawn_),
      begin_ns_(monotonic_ns()) {}

void Progress::show(double share, const std::string& detail) {
  const auto line = text_.at(1e-9 * static_cast<double>(monotonic_ns() - begin_ns_), share, detail);
  if (!line) return;
  if (!is_redrawn_) {
    std::cerr << *line << "\n" << std::flush;
    return;
  }
  std::cerr << "\r\x1b[K" << cut_to(*line, size_of_terminal(STDERR_FILENO).columns - 1) << std::flush;
  is_shown_ = true;
}

void Progress::show_step(std::size_t done, std::size_t count, const std::string& detail) {
  show(count ? static_cast<double>(done) / static_cast<double>(count) : 1, detail);
}

void Progress::finish() {
  if (is_shown_) std::cerr << "\r\x1b[K" << std::flush;
  is_shown_ = false;
}

}  // namespace brachy
