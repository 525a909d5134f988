// Parsed requests: a line for each relevant field. Only permitted requests are accepted.
#include "net/http/http_answer.h"

#include "net/http/request_origin.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {
namespace {

using namespace net;

std::string_view next_line(std::string_view& text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

bool names_this_machine(std::string_view host) {
  constexpr std::string_view kLetters = "lL[1:0";
  return !host.empty() && kLetters.find(host.front()) != std::string_view::npos;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ServedFiles files;
  Script script(data, size);
  const std::uint8_t flags = script.u8();
  const std::string text = text_of(script.rest());
  std::string_view lines = text;
  HttpQuery query;
  query.bound = boost::asio::ip::address_v4::loopback();
  query.is_tls = (flags & 16) != 0;
  query.method = next_line(lines);
  query.target = next_line(lines);
  if (const auto host = next_line(lines); flags & 1) query.host = host;
  if (const auto origin = next_line(lines); flags & 2) query.origin = origin;
  query.accept_encoding = next_line(lines);
  query.if_none_match = next_line(lines);
  query.has_body = (flags & 4) != 0;
  query.is_upgrade = (flags & 8) != 0;
  const HttpAnswer answer = answer_to(query, files);
  EXPECT_EQ(answer.sends_body, query.method != "HEAD");
  if (answer.status == 101 || answer.status == 200 || answer.status == 304) {
    EXPECT_TRUE(query.host && (query.is_tls || names_this_machine(*query.host)))
        << query.host.value_or("none");
    if (query.origin) {  // http://HOST or https://HOST, over TLS the latter
      EXPECT_TRUE(!query.is_tls || query.origin->size() == query.host->size() + 8);
      EXPECT_TRUE(query.origin->size() == query.host->size() + 7 ||
                  query.origin->size() == query.host->size() + 8);
    }
    EXPECT_TRUE(query.method == "GET" || query.method == "HEAD");
    EXPECT_FALSE(query.has_body);
  } else {
    EXPECT_TRUE(answer.text.ends_with(".\n")) << answer.text;
  }
  return 0;
}

}  // namespace brachy::fuzz
