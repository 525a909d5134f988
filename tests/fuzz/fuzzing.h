#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

/// Common parts of the fuzz targets. A target is a program: the function LLVMFuzzerTestOneInput, which libFuzzer calls
/// with one input after the other, under AddressSanitizer and UndefinedBehaviorSanitizer. Properties are checked by
/// EXPECT_…, as in tests; the first failure ends the program, and the input is kept.
namespace brachy::fuzz {

/// An input read from its front as a script of numbers and pieces; zeros and nothing once it has ended.
class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) : left_(std::as_bytes(std::span(data, size))) {}

  bool is_over() const { return left_.empty(); }
  std::uint8_t u8();
  std::uint16_t u16();  ///< little-endian
  /// The next `size` bytes, fewer at the end.
  std::span<const std::byte> take(std::size_t size);
  /// A u16 and as many bytes.
  std::span<const std::byte> piece() { return take(u16()); }
  std::span<const std::byte> rest() { return take(left_.size()); }

 private:
  std::span<const std::byte> left_;
};

std::string text_of(std::span<const std::byte> bytes);

/// Calls `feed` with all of `bytes`, cut into pieces of a few lengths in turn.
void feed_in_pieces(std::span<const std::byte> bytes,
                    const std::function<void(std::span<const std::byte>)>& feed);

/// Whether `read` accepts its input; if it throws a UserError instead, that must be one printable line which begins
/// with `start`. Any other exception ends the program.
bool reads(std::string_view start, const std::function<void()>& read);

/// reads(), and the message must continue with a line number: "NAME:12: …".
bool reads_lines(const std::string& name, const std::function<void()>& read);

}  // namespace brachy::fuzz
