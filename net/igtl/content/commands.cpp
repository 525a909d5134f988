#include "net/igtl/content/commands.h"

#include <charconv>
#include <optional>
#include <sstream>
#include <vector>

namespace brachy::net::igtl {
namespace {

constexpr const char* kUsage =
    "commands are reset, play, play loop, stop, model NAME [SUPPORT_MM], arm N and drop N";

std::vector<std::string> words_of(std::string_view text) {
  std::istringstream in{std::string(text)};
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

template <class Number>
std::optional<Number> number_of(const std::string& word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// As if the message had come over the native protocol.
template <WireMessage Message>
Refusal carry_out(const Message& message, const CommandSource& source, const Sender& sender) {
  const auto body = encoded_body(message);
  net::Header header;
  header.type = Message::kType;
  header.length = static_cast<std::uint32_t>(body->size());
  Request* const request = find_request(Message::kType);
  return request({header, *body, source.received_ns, sender, source.rates, source.server, true});
}

Refusal press(std::uint16_t needle, const CommandSource& source, const Sender& sender) {
  if (auto refusal = carry_out(DropMessage{needle, true}, source, sender)) return refusal;
  return carry_out(DropMessage{needle, false}, source, sender);
}

Refusal no_command() {
  return ErrorMessage{ErrorCode::kProtocol, false, 0, 0, kUsage};
}

}  // namespace

Refusal execute_command(std::string_view text, const CommandSource& source) {
  const std::vector<std::string> words = words_of(text);
  if (words.empty()) return no_command();
  const std::string& verb = words.front();
  ControlMessage control;
  if (verb == "arm" || verb == "drop") {
    const auto needle = words.size() < 2 ? std::uint16_t{0} : number_of<std::uint16_t>(words[1]);
    if (words.size() > 2 || !needle) return no_command();
    Sender sender = source.sender;
    if (source.is_held(*needle)) {
      sender.role = Role::kDevice;
      sender.needle = *needle;
    }
    return verb == "drop" ? press(*needle, source, sender) : carry_out(ArmMessage{*needle}, source, sender);
  }
  if (verb == "reset" && words.size() == 1) {
    control.action = ControlAction::kReset;
  } else if (verb == "stop" && words.size() == 1) {
    control.action = ControlAction::kStop;
  } else if (verb == "play" && (words.size() == 1 || (words.size() == 2 && words[1] == "loop"))) {
    control.action = ControlAction::kPlay;
    control.loop = words.size() == 2;
  } else if (verb == "model" && (words.size() == 2 || words.size() == 3)) {
    control.action = ControlAction::kModel;
    control.kernel = words[1];
    if (words.size() == 3) {
      const auto support = number_of<double>(words[2]);
      if (!support) return no_command();
      control.support_radius_mm = *support;
    }
  } else {
    return no_command();
  }
  return carry_out(control, source, source.sender);
}

}  // namespace brachy::net::igtl
