#include "net/http/request_origin.h"

#include <algorithm>
#include <string>

namespace brachy::net {
namespace asio = boost::asio;
namespace {

std::string lower(std::string_view s) {
  std::string result(s);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

bool is_port(std::string_view s) {
  return !s.empty() && s.size() <= 5 &&
         std::all_of(s.begin(), s.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// The host of "host", "host:port", "[v6]" or "[v6]:port", without brackets; nullopt: none of these.
std::optional<std::string> host_of(std::string_view authority) {
  const bool is_v6 = authority.starts_with('[');
  const std::size_t end = is_v6 ? authority.find(']') : authority.find(':');
  if (is_v6 && end == std::string_view::npos) return std::nullopt;
  const std::string_view rest =
      end == std::string_view::npos ? std::string_view() : authority.substr(end + (is_v6 ? 1 : 0));
  if (!rest.empty() && !(rest.starts_with(':') && is_port(rest.substr(1)))) return std::nullopt;
  const std::string_view host = is_v6 ? authority.substr(1, end - 1) : authority.substr(0, end);
  if (host.empty()) return std::nullopt;
  return lower(host);
}

}  // namespace

std::string_view refusal_of_origin(std::string_view host, std::optional<std::string_view> origin,
                                   const asio::ip::address& bound, bool is_tls) {
  const auto name = host_of(host);
  if (!name) return "The Host header is not HOST or HOST:PORT.";
  boost::system::error_code error;
  const auto address = asio::ip::make_address(*name, error);
  const bool is_address = !error && (address.is_loopback() || address == bound);
  if (!is_tls && !is_address && *name != "localhost") {
    return "The Host header names another machine: open the viewer as http://127.0.0.1:PORT/, or under the "
           "address "
           "that brachyd listens on.";
  }
  if (!origin) return "";
  const std::string page = lower(*origin), authority = lower(host);
  const bool is_http = !is_tls && page == "http://" + authority;
  if (!is_http && page != "https://" + authority) {
    return "The request comes from a page of another site (Origin): only the viewer that this server serves "
           "may "
           "connect from a browser.";
  }
  return "";
}

}  // namespace brachy::net
