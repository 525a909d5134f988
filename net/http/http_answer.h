#pragma once

#include <boost/asio/ip/address.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/http/dynamic_pages.h"
#include "net/http/served_files.h"

namespace brachy::net {

/// The path of the WebSocket.
constexpr std::string_view kWebSocketPath = "/ws";

/// The parts of a request that matter; views into it.
struct HttpQuery {
  boost::asio::ip::address bound;  ///< local address of the connection
  bool is_tls = false;             ///< of the connection
  std::string_view method, target;
  std::optional<std::string_view> host;  ///< nullopt: no Host header, or several
  std::optional<std::string_view> origin;
  std::string_view accept_encoding, if_none_match;
  bool has_body = false;
  bool is_upgrade = false;  ///< to WebSocket
};

struct HttpAnswer {
  int status = 200;  ///< 101: continue as WebSocket, nothing else is set
  std::vector<std::pair<std::string, std::string>> headers;
  std::string text;  ///< the body, where `file` and `shared` are null
  std::shared_ptr<const std::string> shared = {};
  const ServedFile* file = nullptr;   ///< the body, of the files given
  const DynamicPage* page = nullptr;  ///< of the pages given: generates the answer, for an authorised client
  std::string_view below = {};        ///< of the target, what `page` is asked for; empty: itself
  bool sends_body = true;             ///< false: its length alone is sent (HEAD)
  bool closes = false;                ///< of the connection of no further use

  std::string_view body() const {
    if (file) return file->content;
    return shared ? *shared : text;
  }
};

/// The answer to a request. Pure.
HttpAnswer answer_to(const HttpQuery& query, const ServedFiles& files, const DynamicPages& pages = {});

/// An answer with the content of a dynamic page.
HttpAnswer page_answer(DynamicPage::Content content);

/// An error answer; `text` says what is wrong with the request.
HttpAnswer refusal(int status, std::string_view text);

}  // namespace brachy::net
