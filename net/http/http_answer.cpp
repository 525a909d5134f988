#include "net/http/http_answer.h"

#include "net/http/request_origin.h"

namespace brachy::net {
namespace {

// One page with everything in it: its own scripts and styles, pictures and workers that it makes itself, and
// connections to daemons. Nobody may show it in a frame: clicks in it steer a needle.
constexpr const char* kContentSecurityPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src 'self' ws: wss:; worker-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors "
    "'none'";

HttpAnswer with_common_headers(HttpAnswer answer) {
  answer.headers.emplace_back("X-Content-Type-Options", "nosniff");
  answer.headers.emplace_back("Content-Security-Policy", kContentSecurityPolicy);
  answer.headers.emplace_back("Referrer-Policy", "no-referrer");
  answer.headers.emplace_back("Cross-Origin-Resource-Policy", "same-origin");
  return answer;
}

/// The page of a path, and what below it is asked for; null: there is none.
std::pair<const DynamicPage*, std::string_view> page_of(const DynamicPages& pages, std::string_view path) {
  if (const auto page = pages.find(path); page != pages.end() && page->second.make)
    return {&page->second, {}};
  const std::size_t end = path.find('/', 1);
  if (end == path.npos) return {};
  const auto page = pages.find(path.substr(0, end + 1));
  if (page == pages.end() || !page->second.make_below) return {};
  return {&page->second, path.substr(end + 1)};
}

HttpAnswer file_answer(const ServedFile& file, const HttpQuery& query) {
  HttpAnswer answer;
  answer.headers = {{"ETag", file.etag}, {"Cache-Control", "no-cache"}, {"Vary", "Accept-Encoding"}};
  if (query.if_none_match.find(file.etag) != std::string_view::npos) {
    answer.status = 304;
    return answer;
  }
  answer.headers.emplace_back("Content-Type", file.content_type);
  if (!file.encoding.empty()) answer.headers.emplace_back("Content-Encoding", file.encoding);
  answer.file = &file;
  return answer;
}

}  // namespace

HttpAnswer refusal(int status, std::string_view text) {
  HttpAnswer answer;
  answer.status = status;
  answer.headers = {{"Content-Type", "text/plain; charset=utf-8"}, {"Cache-Control", "no-store"}};
  answer.text = std::string(text) + "\n";
  answer.closes = status == 400 || status == 413 || status == 431;
  return with_common_headers(std::move(answer));
}

HttpAnswer page_answer(DynamicPage::Content content) {
  HttpAnswer answer;
  answer.status = content.status;
  answer.headers = {{"Content-Type", std::move(content.content_type)}, {"Cache-Control", "no-store"}};
  answer.text = std::move(content.text);
  answer.shared = std::move(content.shared);
  return with_common_headers(std::move(answer));
}

HttpAnswer answer_to(const HttpQuery& query, const ServedFiles& files, const DynamicPages& pages) {
  const bool is_head = query.method == "HEAD";
  HttpAnswer answer = [&] {
    if (!query.host) return refusal(400, "A request has one Host header.");
    if (!query.target.starts_with('/')) return refusal(400, "A request target starts with /.");
    if (const auto reason = refusal_of_origin(*query.host, query.origin, query.bound, query.is_tls);
        !reason.empty())
      return refusal(403, reason);
    if (query.has_body) return refusal(413, "A request has no body here.");
    if (!is_head && query.method != "GET") {
      HttpAnswer other = refusal(405, "Only GET and HEAD are answered.");
      other.headers.emplace_back("Allow", "GET, HEAD");
      return other;
    }
    const std::string_view path = query.target.substr(0, query.target.find('?'));
    if (path == kWebSocketPath) {
      if (query.is_upgrade) return HttpAnswer{101, {}, {}};
      HttpAnswer other =
          refusal(426, "This is the WebSocket of brachyd's native protocol (net/PROTOCOL.md).");
      other.headers.emplace_back("Upgrade", "websocket");
      return other;
    }
    if (const auto [page, below] = page_of(pages, path); page) {
      HttpAnswer made;
      made.page = page;
      made.below = below;
      return made;
    }
    const ServedFile* file = files.find(query.target, takes_gzip(query.accept_encoding));
    if (!file) return refusal(404, "There is nothing here; the viewer is at /.");
    return with_common_headers(file_answer(*file, query));
  }();
  answer.sends_body = !is_head;
  return answer;
}

}  // namespace brachy::net
