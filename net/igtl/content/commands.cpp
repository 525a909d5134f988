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

}  // namespace

std::string execute_command(std::string_view text, std::size_t needles, const RequestHandlers& handlers,
                            const std::string& client) {
  const std::vector<std::string> words = words_of(text);
  if (words.empty()) return kUsage;
  const std::string& verb = words.front();
  const Sender sender{client, Role::kOperator};
  ControlMessage control;
  if (verb == "arm" || verb == "drop") {
    const auto needle = words.size() < 2 ? std::uint16_t{0} : number_of<std::uint16_t>(words[1]);
    if (words.size() > 2 || !needle) return kUsage;
    if (*needle >= needles) return "there is no needle " + words.back();
    if (verb == "arm") {
      handlers.call(ArmMessage{*needle}, sender);
    } else {
      handlers.call(DropMessage{*needle, true}, sender);
      handlers.call(DropMessage{*needle, false}, sender);
    }
    return {};
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
      if (!support) return kUsage;
      control.support_radius_mm = *support;
    }
  } else {
    return kUsage;
  }
  return handlers.call(control, sender, "this server has no controls");
}

}  // namespace brachy::net::igtl
