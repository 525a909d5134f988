#include "net/igtl/codec/text_codec.h"

#include "net/igtl/codec/message_builder.h"
#include "net/wire/text.h"

namespace brachy::net::igtl {
namespace {

constexpr std::size_t kCommandNameBytes = 128, kCommandHeaderBytes = 4 + kCommandNameBytes + 2 + 4;
constexpr std::uint16_t kUsAscii = 3;  // IANA's MIBenum

std::string text_of(std::span<const std::byte> bytes) {
  return to_wire_text(get_name(bytes), kLongestText);
}

/// As the value of an XML attribute in double quotes.
std::string as_attribute(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace

std::optional<std::string> decode_string(std::span<const std::byte> content) {
  constexpr std::size_t kHeaderBytes = 4;  // encoding and length
  if (content.size() < kHeaderBytes) return std::nullopt;
  if (get<std::uint16_t>(content.subspan(2)) != content.size() - kHeaderBytes) return std::nullopt;
  return text_of(content.subspan(kHeaderBytes));
}

std::optional<CommandText> decode_command(std::span<const std::byte> content) {
  if (content.size() < kCommandHeaderBytes) return std::nullopt;
  const std::uint64_t length = get<std::uint32_t>(content.subspan(4 + kCommandNameBytes + 2));
  if (length != content.size() - kCommandHeaderBytes) return std::nullopt;
  return CommandText{get<std::uint32_t>(content), text_of(content.subspan(4, kCommandNameBytes)),
                     text_of(content.subspan(kCommandHeaderBytes))};
}

Bytes encode_command_answer(const Label& label, std::uint32_t id, std::uint16_t code,
                            std::string_view error) {
  std::string result = "<Command><Result success=\"true\"/></Command>";
  if (!error.empty())
    result = "<Command><Result success=\"false\"><Parameter Name=\"Code\" Value=\"" + std::to_string(code) +
             "\"/><Parameter Name=\"Reason\" Value=\"" + as_attribute(error) + "\"/></Result></Command>";
  MessageBuilder message("RTS_COMMAND", label, kCommandHeaderBytes + result.size());
  Bytes& out = message.bytes();
  put(out, id);
  put_name(out, error.substr(0, kCommandNameBytes - 1), kCommandNameBytes);
  put(out, kUsAscii);
  put(out, static_cast<std::uint32_t>(result.size()));
  put_name(out, result, result.size());
  return message.finish();
}

}  // namespace brachy::net::igtl
