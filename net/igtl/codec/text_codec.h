#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "net/igtl/codec/messages.h"
#include "net/wire/byte_io.h"

namespace brachy::net::igtl {

/// The content of a COMMAND.
struct CommandText {
  std::uint32_t id = 0;  ///< chosen by the sender, for the answer
  std::string name;      ///< of the command
  std::string content;   ///< XML as PLUS sends it, or what we make of it
};

// Untrusted input. nullopt: the sizes do not fit. Unprintable bytes become '?'; at most kLongestText are kept.
constexpr std::size_t kLongestText = 256;
std::optional<std::string> decode_string(std::span<const std::byte> content);
std::optional<CommandText> decode_command(std::span<const std::byte> content);

/// The answer to a COMMAND. As upstream's library has it, `error` stands in the name's place, cut to 127 bytes; empty:
/// done. The content has it whole, with the `code` of the native protocol's ERROR.
Bytes encode_command_answer(const Label& label, std::uint32_t id, std::uint16_t code, std::string_view error);

}  // namespace brachy::net::igtl
