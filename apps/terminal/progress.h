#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace brachy {

/// When and what a long command prints about its progress. Pure: the caller passes the time.
class ProgressText {
 public:
  /// Between two lines: of one that is redrawn, and of plain ones.
  static constexpr double kRedrawS = 0.1, kPlainS = 5;

  ProgressText(std::string command, bool is_redrawn)
      : command_(std::move(command)),
        between_s_(is_redrawn ? kRedrawS : kPlainS),
        last_s_(is_redrawn ? -1 : 0) {}

  /// At `t_s` since the beginning `share` (0 … 1) is done, NaN: unknown; `detail` is what is being done. The line to
  /// show, without its end, if it is time for one.
  std::optional<std::string> at(double t_s, double share, const std::string& detail);

 private:
  std::string command_;
  double between_s_, last_s_;
};

/// "8 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

/// Shows the progress of a long command on standard error: on a terminal as one line that is redrawn and removed at
/// the end, otherwise as a plain line every few seconds. A quick command prints nothing.
/// Threads: one.
class Progress {
 public:
  explicit Progress(std::string command);
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// As ProgressText::at; costs a reading of the clock where no line is due.
  void show(double share, const std::string& detail = "");
  /// Of `count` equal steps `done` are done.
  void show_step(std::size_t done, std::size_t count, const std::string& detail = "");
  /// Removes the line, so that something else can be printed.
  void finish();

 private:
  const bool is_redrawn_;
  ProgressText text_;
  const std::int64_t begin_ns_;
  bool is_shown_ = false;
};

}  // namespace brachy
