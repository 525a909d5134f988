#include "apps/command_line_parts.h"

namespace brachy {

void add_mesh_options(CLI::App& command, std::string& units, std::string& frame) {
  command.add_option("--units", units, "of a mesh")->check(CLI::IsMember({"mm", "m"}))->capture_default_str();
  command.add_option("--frame", frame, "of a mesh")
      ->check(CLI::IsMember({"RAS", "LPS"}))
      ->capture_default_str();
}

CLI::Option* add_connect_options(CLI::App& command, ConnectOptions& connect, const char* what) {
  const CLI::Validator host_port = {[](const std::string& text) -> std::string {
                                      const auto colon = text.rfind(':');
                                      int port = 0;
                                      if (colon == std::string::npos || colon == 0 ||
                                          !CLI::detail::lexical_cast(text.substr(colon + 1), port) ||
                                          port < 1 || port > 65535)
                                        return "needs HOST:PORT, such as 127.0.0.1:18950, not '" + text + "'";
                                      return "";
                                    },
                                    "HOST:PORT"};
  const auto split = [&connect](const std::string& text) {
    const auto colon = text.rfind(':');
    connect.host = text.substr(0, colon);
    connect.port = static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1)));
  };
  auto* daemon = command.add_option_function<std::string>("--connect", split, what)->check(host_port);
  command.add_option("--token-file", connect.token_file, "token to show to the daemon, where it wants one")
      ->needs(daemon);
  command.add_flag("--tls", connect.tls, "speak TLS; a CA of this system vouches for the daemon")
      ->needs(daemon);
  command
      .add_option("--tls-ca", connect.tls_ca,
                  "speak TLS; this CA vouches for the daemon, or is its own certificate (PEM)")
      ->needs(daemon);
  auto* certificate = command
                          .add_option("--tls-certificate", connect.tls_certificate,
                                      "certificate to show, where the daemon asks for one (PEM)")
                          ->needs(daemon);
  auto* key = command.add_option("--tls-key", connect.tls_key, "its key")->needs(certificate);
  certificate->needs(key);
  return daemon;
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
