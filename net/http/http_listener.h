#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "net/http/dynamic_pages.h"
#include "net/http/served_files.h"
#include "net/server/server.h"

namespace brachy::net {

struct HttpOptions {
  std::uint16_t port = 0;                            ///< 0 = any free one
  std::chrono::milliseconds request_timeout{10000};  ///< until a request's header is complete
  std::chrono::milliseconds answer_timeout{60000};   ///< until an answer has left
  DynamicPages pages;                                ///< beside the files
};

/// Serves the viewer's files and dynamic pages over HTTP/1.1 and, at /ws, the native protocol over WebSocket
/// (net/PROTOCOL.md). Its sessions are those of `server`, on its address and with its limits; its connections count
/// towards max_clients. A peer can use only a bounded amount of memory, and a stalled one a bounded amount of time.
///
/// Threads: the one that runs `io`, or any while nothing runs it; it makes none.
class HttpListener {
 public:
  using Log = std::function<void(const std::string&)>;

  /// Binds, listens and accepts from here on. `server` must outlive it, or until stop().
  /// Throws UserError: port in use or forbidden.
  HttpListener(boost::asio::io_context& io, Server& server, HttpOptions options, ServedFiles files, Log log);
  ~HttpListener();  ///< as stop()
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  std::uint16_t port() const;

  /// Stops listening and closes connections that have not become sessions; sessions belong to the server.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy::net
