#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace brachy::net {

/// A page generated for each request, such as metrics; on the io thread, so it must be quick.
struct DynamicPage {
  struct Content {
    int status = 200;
    std::string content_type = "text/plain; charset=utf-8";
    std::string text;
    std::shared_ptr<const std::string> shared = {};  ///< in place of `text`: one body for all answers
  };
  /// Whose token a request needs, where the server has tokens.
  enum class Access { kAnyone, kViewer, kOperator };

  Access access = Access::kViewer;
  std::function<Content()> make;
  /// In place of `make`, of a page whose path ends with '/': of everything below it, by the rest of the path, as it
  /// came: percent-encoded.
  std::function<Content(std::string_view rest)> make_below = nullptr;
};

/// By path ("/metrics", "/sessions/").
using DynamicPages = std::map<std::string, DynamicPage, std::less<>>;

}  // namespace brachy::net
