#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

/// What the fuzz targets have in common. A target is a program: the function LLVMFuzzerTestOneInput, which libFuzzer calls
/// with one input after the other, under AddressSanitizer and UndefinedBehaviorSanitizer. What must hold is said by
/// EXPECT_…, as in tests; the first that does not ends the program, and the input is kept.
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

/// Whether `read` takes its input; if it throws a UserError instead, that must be one printable line which begins with
/// `start`. Anything else that it throws ends the program.
bool reads(std::string_view start, const std::function<void()>& read);

/// reads(), and the refusal must go on with a line's number: "NAME:12: …".
bool reads_lines(const std::string& name, const std::function<void()>& read);

}  // namespace brachy::fuzz
