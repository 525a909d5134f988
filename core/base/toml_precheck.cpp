#include "core/base/toml_precheck.h"

#include <algorithm>
#include <utility>

namespace brachy {
namespace {

/// Passes over TOML, of which it knows comments, strings, brackets, dots and separators.
class TomlScan {
 public:
  explicit TomlScan(std::string_view text) : text_(text) {}

  std::optional<TomlExcess> run() {
    while (at_ < text_.size() && !excess_ && !is_broken_) step();
    return excess_;
  }

 private:
  void step() {
    switch (text_[at_]) {
      case '#':
        at_ = std::min(text_.find('\n', at_), text_.size());
        return;
      case '"':
      case '\'':
        return pass_string(text_[at_]);
      case '[':
      case '{':
        dots_ = 0;
        if (++brackets_ > TomlLimits::kMaxDepth) report_depth("brackets");
        break;
      case ']':
      case '}':
        dots_ = 0;
        if (brackets_ > 0) --brackets_;
        break;
      case '.':
        if (++dots_ >= TomlLimits::kMaxDepth) report_depth("names between dots");
        break;
      case '=':
      case ',':
        dots_ = 0;
        if (++values_ > TomlLimits::kMaxValues)
          report("more than " + std::to_string(TomlLimits::kMaxValues) +
                 " values; such a file is a page of TOML");
        break;
      case '\n':
        dots_ = 0;
        ++line_;
        break;
      default:
        break;
    }
    ++at_;
  }

  void pass_string(char quote) {
    const std::string_view triple = quote == '"' ? "\"\"\"" : "'''";
    const bool is_multi_line = text_.substr(at_, 3) == triple;
    at_ += is_multi_line ? 3 : 1;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n') {
        ++line_;
        if (!is_multi_line) break;  // the parser ends here
      } else if (c == '\\' && quote == '"') {
        ++at_;
        if (at_ < text_.size() && text_[at_] == '\n') ++line_;
      } else if (c == quote && !is_multi_line) {
        ++at_;
        return;
      } else if (c == quote && text_.substr(at_, 3) == triple) {
        at_ += 3;  // two more quotes may belong to the string
        for (int more = 0; more < 2 && at_ < text_.size() && text_[at_] == quote; ++more) ++at_;
        return;
      }
    }
    is_broken_ = true;
  }

  void report_depth(const char* of_what) {
    report("nested deeper than " + std::to_string(TomlLimits::kMaxDepth) + " " + of_what +
           "; no key of such a file lies that deep");
  }
  void report(std::string what) { excess_ = TomlExcess{line_, std::move(what)}; }

  std::string_view text_;
  std::size_t at_ = 0, line_ = 1, brackets_ = 0, dots_ = 0, values_ = 0;
  bool is_broken_ = false;  // an unfinished string
  std::optional<TomlExcess> excess_;
};

}  // namespace

std::optional<TomlExcess> find_toml_excess(std::string_view text) {
  if (text.size() > TomlLimits::kMaxBytes)
    return TomlExcess{1, "larger than 1 MiB; such a file is a page of TOML"};
  return TomlScan(text).run();
}

}  // namespace brachy
