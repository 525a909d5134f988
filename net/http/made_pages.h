#pragma once

#include <functional>
#include <map>
#include <string>

namespace brachy::net {

/// A page that is made anew for each request, such as metrics; on the io thread, and at once.
struct MadePage {
  struct Content {
    int status = 200;
    std::string content_type = "text/plain; charset=utf-8";
    std::string text;
  };
  bool needs_token = true;  ///< a viewer's, where the server has tokens
  std::function<Content()> make;
};

/// By path ("/metrics").
using MadePages = std::map<std::string, MadePage, std::less<>>;

}  // namespace brachy::net
