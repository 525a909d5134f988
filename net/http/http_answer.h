#pragma once

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/http/made_pages.h"
#include "net/http/served_files.h"

namespace brachy::net {

/// The path of the WebSocket.
constexpr std::string_view kWebSocketPath = "/ws";

/// What of a request matters; views into it.
struct HttpQuery {
  boost::asio::ip::address bound;  ///< that the connection came in on
  bool is_tls = false;             ///< the connection is
  std::string_view method, target;
  std::optional<std::string_view> host;  ///< nullopt: no Host header, or several
  std::optional<std::string_view> origin;
  std::string_view accept_encoding, if_none_match;
  bool has_body = false;
  bool is_upgrade = false;  ///< to WebSocket
};

struct HttpAnswer {
  int status = 200;  ///< 101: go on as WebSocket, nothing else is set
  std::vector<std::pair<std::string, std::string>> headers;
  std::string text;                  ///< the body, where `file` is null
  const ServedFile* file = nullptr;  ///< the body, of the files given
  const MadePage* page = nullptr;    ///< of the pages given: the answer is what it makes, for who may have it
  bool sends_body = true;            ///< false: only its length is told (HEAD)
  bool closes = false;               ///< the connection is of no further use

  std::string_view body() const { return file ? std::string_view(file->content) : text; }
};

/// What is answered to a request. Pure.
HttpAnswer answer_to(const HttpQuery& query, const ServedFiles& files, const MadePages& pages = {});

/// What a page has made, as an answer.
HttpAnswer page_answer(MadePage::Content content);

/// An answer that says what is wrong with the request, as text.
HttpAnswer refusal(int status, std::string_view text);

}  // namespace brachy::net
