#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace brachy::net {

/// A page generated for each request, such as metrics; on the io thread, so it must be quick.
struct DynamicPage {
  struct Content {
    int status = 200;
    std::string content_type = "text/plain; charset=utf-8";
    std::string text;
    std::shared_ptr<const std::string> shared = {};  ///< in place of `text`: one body for all answers
  };
  bool needs_token = true;  ///< a viewer's token, where the server has tokens
  std::function<Content()> make;
};

/// By path ("/metrics").
using DynamicPages = std::map<std::string, DynamicPage, std::less<>>;

}  // namespace brachy::net
