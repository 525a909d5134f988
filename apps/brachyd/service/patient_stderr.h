#pragma once

#include <cstdint>
#include <streambuf>
#include <string_view>

namespace brachy {

/// Standard error that never keeps anybody waiting: on a pipe or a socket that nobody reads any more, what would have to wait
/// is left out, and how much was left out is said once there is room again. A terminal is not to be written to by this: its lines have no colours.
/// Threads: one at a time (spdlog's _mt sinks lock).
class PatientStderr final : public std::streambuf {
 public:
  explicit PatientStderr(int descriptor);

  /// It is a pipe or a socket.
  bool is_needed() const { return may_block_; }

 private:
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int_type overflow(int_type character) override;

  bool write(std::string_view text);
  bool has_room();

  const int descriptor_;
  const bool may_block_;
  std::uint64_t left_out_ = 0;  // pieces, since the last that was written
};

}  // namespace brachy
