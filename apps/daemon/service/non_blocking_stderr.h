#pragma once

#include <cstdint>
#include <streambuf>
#include <string_view>

namespace brachy {

/// Standard error that never blocks: on a pipe or a socket that is full because its reader stalled, output is
/// dropped, and the amount dropped is written once it is writable again. Not for terminals: its lines have no
/// colours.
/// Threads: one at a time (spdlog's _mt sinks lock).
class NonBlockingStderr final : public std::streambuf {
 public:
  explicit NonBlockingStderr(int descriptor);

  /// It is a pipe or a socket.
  bool is_needed() const { return may_block_; }

 private:
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int_type overflow(int_type character) override;

  bool write(std::string_view text);
  bool is_writable();

  const int descriptor_;
  const bool may_block_;
  std::uint64_t left_out_ = 0;  // pieces, since the last that was written
};

}  // namespace brachy
