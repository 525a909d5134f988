#include "tests/fuzz/fuzzing.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "core/base/error.h"

namespace brachy::fuzz {
namespace {

/// libFuzzer keeps an input that aborts; it does not handle the trap that GoogleTest uses to break.
class AbortOnFailure : public ::testing::EmptyTestEventListener {
  void OnTestPartResult(const ::testing::TestPartResult& result) override {
    if (result.failed()) std::abort();
  }
};

/// The message of the UserError that `read` throws, checked; empty: none.
std::string refusal(std::string_view start, const std::function<void()>& read) {
  try {
    read();
    return {};
  } catch (const UserError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with(start)) << message;
    EXPECT_GT(message.size(), start.size());
    EXPECT_LT(message.size(), start.size() + 600) << "holds the file: " << message;
    const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
    EXPECT_FALSE(std::ranges::any_of(message, is_control)) << "not one printable line: " << message;
    return message;
  }
}

}  // namespace

std::uint8_t Script::u8() {
  const auto byte = take(1);
  return byte.empty() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(byte[0]);
}

std::uint16_t Script::u16() {
  const unsigned low = u8();
  return static_cast<std::uint16_t>(low | unsigned{u8()} << 8);
}

std::span<const std::byte> Script::take(std::size_t size) {
  const auto head = left_.first(std::min(size, left_.size()));
  left_ = left_.subspan(head.size());
  return head;
}

std::string text_of(std::span<const std::byte> bytes) {
  std::string text(bytes.size(), '\0');
  std::ranges::transform(bytes, text.begin(), [](std::byte b) { return std::to_integer<char>(b); });
  return text;
}

void feed_in_pieces(std::span<const std::byte> bytes,
                    const std::function<void(std::span<const std::byte>)>& feed) {
  constexpr std::array<std::size_t, 6> kSizes = {1, 7, 2, 64, 1, 300};
  for (std::size_t i = 0; !bytes.empty(); ++i) {
    const std::size_t size = std::min(kSizes[i % kSizes.size()], bytes.size());
    feed(bytes.first(size));
    bytes = bytes.subspan(size);
  }
}

bool reads(std::string_view start, const std::function<void()>& read) {
  return refusal(start, read).empty();
}

bool reads_lines(const std::string& name, const std::function<void()>& read) {
  const std::string message = refusal(name + ":", read);
  if (message.empty()) return true;
  const auto digits = message.find_first_not_of("0123456789", name.size() + 1);
  EXPECT_GT(digits, name.size() + 1) << message;
  EXPECT_EQ(message.substr(digits, 2), ": ") << message;
  return false;
}

}  // namespace brachy::fuzz

/// libFuzzer calls it once, at start-up.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  ::testing::UnitTest::GetInstance()->listeners().Append(new brachy::fuzz::AbortOnFailure);
  return 0;
}
