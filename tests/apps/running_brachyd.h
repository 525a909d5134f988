#pragma once

#include <gtest/gtest.h>

#include "tests/apps/apps_testing.h"

namespace brachy::test {

/// A brachyd process on a free port. It ends by itself after kDeadline, even if the test crashes.
class RunningBrachyd {
 public:
  /// `before`: a program, with its arguments, that executes brachyd.
  explicit RunningBrachyd(const std::string& scene, const std::vector<std::string>& more = {},
                          const std::vector<std::string>& before = {})
      : process(line(scene, more, before)) {
    const auto first = process.read_line();
    constexpr std::string_view kSays = "{\"listening_on\":\"127.0.0.1:", kEnd = "\"}";
    if (!first || !first->starts_with(kSays)) {
      ADD_FAILURE() << "brachyd's first line: " << first.value_or("none") << "\n" << process.wait().err;
      return;
    }
    const std::size_t begin = kSays.size() - std::string_view("127.0.0.1:").size();
    address = first->substr(begin, first->size() - begin - kEnd.size());
    port = static_cast<std::uint16_t>(std::stoi(first->substr(kSays.size())));
  }

  ChildProcess process;
  std::string address;  ///< HOST:PORT
  std::uint16_t port = 0;

 private:
  static std::vector<std::string> line(const std::string& scene, const std::vector<std::string>& more,
                                       std::vector<std::string> before) {
    std::vector<std::string> arguments = {"--config", scene, "--port", "0", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (std::find(more.begin(), more.end(), "--duration") == more.end())
      arguments.insert(arguments.end(), {"--duration", std::to_string(kDeadline / std::chrono::seconds(1))});
    const auto all = brachyd_line(arguments);
    before.insert(before.end(), all.begin(), all.end());
    return before;
  }
};

}  // namespace brachy::test
