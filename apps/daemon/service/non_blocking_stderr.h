#pragma once

#include <cstdint>
#include <deque>
#include <streambuf>
#include <string>
#include <string_view>

namespace brachy {

/// Standard error that never blocks. On a pipe or a socket that is full because its reader stalled, lines about safety
/// wait, and others are dropped; once it is writable again, those that waited are written, and the number of those
/// dropped. Not for terminals: its lines have no colours. Threads: one at a time (StderrSink locks).
class NonBlockingStderr final : public std::streambuf {
 public:
  /// Lines about safety that wait, 10 a second at most (SafetyNotices); more are dropped and counted.
  static constexpr std::size_t kMostWaiting = 4096;

  explicit NonBlockingStderr(int descriptor);

  /// It is a pipe or a socket.
  bool is_needed() const { return may_block_; }

  /// A line about safety, with its line end.
  void write_safety(std::string_view line);
  /// Writes what waits, as far as its reader takes it. To be called a few times a second.
  void update() { has_written_waiting(); }

 private:
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int_type overflow(int_type character) override;

  bool has_written_waiting();
  bool has_written(std::string_view& text);
  bool is_writable();

  const int descriptor_;
  const bool may_block_;
  std::deque<std::string> waiting_;                    // about safety; the first may be the rest of a line
  std::uint64_t dropped_ = 0, dropped_of_safety_ = 0;  // pieces, since the last that was written
};

}  // namespace brachy
