#include "apps/command_line/option_groups.h"

#include <charconv>

#include "core/base/escaped.h"

namespace brachy {
namespace {

/// The port of HOST:PORT; none where the text is not that. An IPv6 address stands in brackets.
std::optional<std::uint16_t> port_of(const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  const bool is_bracketed = text.front() == '[' && text[colon - 1] == ']' && colon > 2;
  if (!is_bracketed && text.find(':') != colon) return std::nullopt;
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, port);
  if (error != std::errc() || rest != end || port == 0) return std::nullopt;
  return port;
}

/// Without port and brackets.
std::string host_of(const std::string& text) {
  const std::string host = text.substr(0, text.rfind(':'));
  return host.front() == '[' ? host.substr(1, host.size() - 2) : host;
}

}  // namespace

Option add_connect_options(OptionList& list, ConnectOptions& connect, const std::string& help) {
  const auto split = [&connect](const std::string& text) {
    connect.host = host_of(text);
    connect.port = *port_of(text);
  };
  const Option daemon = list.add_text("--connect", split, help)
                            .check(
                                [](const std::string& text) -> std::string {
                                  if (text.find("://") != std::string::npos)
                                    return "needs HOST:PORT of the native protocol, such as 127.0.0.1:18950, "
                                           "not '" +
                                           text + "': http:// is the viewer's, for a browser";
                                  if (port_of(text)) return "";
                                  return "needs HOST:PORT, such as 127.0.0.1:18950, not '" + text +
                                         "'; an IPv6 address in brackets: [::1]:18950";
                                },
                                "HOST:PORT");
  list.add("--token-file", connect.token_file, "token to send to the daemon, where it requires one")
      .needs(daemon);
  list.add_flag("--tls", connect.tls,
                "use TLS; the daemon's certificate is checked against this system's CAs")
      .needs(daemon);
  list.add("--tls-ca", connect.tls_ca,
           "use TLS; the daemon's certificate is checked against this CA or equals it (PEM)")
      .needs(daemon);
  const Option certificate = list.add("--tls-certificate", connect.tls_certificate,
                                      "client certificate to send, where the daemon asks for one (PEM)")
                                 .needs(daemon);
  certificate.needs(
      list.add("--tls-key", connect.tls_key, "the client certificate's key (PEM)").needs(certificate));
  return daemon;
}

void add_mesh_options(OptionList& list, MeshFileFormat& format) {
  list.add("--units", format.units, "length unit of a mesh file").one_of({"mm", "m"}).show_default();
  list.add("--frame", format.frame, "coordinate frame of a mesh file").one_of({"RAS", "LPS"}).show_default();
}

Option as_duration(Option option) {
  return option.range(0.001, 1e7);
}

Option as_short_name(Option option) {
  return option.check(
      [](const std::string& text) -> std::string {
        constexpr std::size_t kLongest = 100;
        if (!text.empty() && text.size() <= kLongest && escaped(text) == text) return "";
        return "needs a name of 1 to 100 letters on one line";
      },
      "NAME");
}

Option as_simd(Option option) {
  return option.one_of({"auto", "generic", "sse4", "avx2", "avx512"});
}

}  // namespace brachy
