#include "apps/command_line_parts.h"

namespace brachy {

void add_mesh_options(CLI::App& command, std::string& units, std::string& frame) {
  command.add_option("--units", units, "of a mesh")->check(CLI::IsMember({"mm", "m"}))->capture_default_str();
  command.add_option("--frame", frame, "of a mesh")
      ->check(CLI::IsMember({"RAS", "LPS"}))
      ->capture_default_str();
}

CLI::Validator host_port() {
  return {[](const std::string& text) -> std::string {
            const auto colon = text.rfind(':');
            int port = 0;
            if (colon == std::string::npos || colon == 0 ||
                !CLI::detail::lexical_cast(text.substr(colon + 1), port) || port < 1 || port > 65535)
              return "needs HOST:PORT, such as 127.0.0.1:18950, not '" + text + "'";
            return "";
          },
          "HOST:PORT"};
}

HostPort host_port_of(const std::string& text) {
  const auto colon = text.rfind(':');
  return {text.substr(0, colon), static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1)))};
}

// CLI::Range lets NaN through: no comparison holds for it.
CLI::Validator between(double least, double most) {
  const CLI::Range range(least, most);
  return {[range](std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && !(value == value))
              return "needs a number, not '" + text + "'";
            return range(text);
          },
          range.get_description()};
}

CLI::Validator durations() {
  return between(0.001, 1e7);
}

CLI::Validator simd_choices() {
  return CLI::IsMember({"auto", "generic", "sse4", "avx2", "avx512"});
}

}  // namespace brachy
