#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/base/set_up.h"

namespace brachy {

/// When and what a program says while it sets up a model: nothing in the first second, then at most one line a second.
/// Pure: the caller passes the time.
class SetUpText {
 public:
  /// At `t_s` since the beginning `share` (0 … 1) is done: the line to print, without its end, if it is time for one.
  std::optional<std::string> at(double t_s, double share);

 private:
  static constexpr double kBetweenS = 1;
  double last_s_ = 0;
};

/// A set-up that begins now and passes such lines to `print` ("set-up: boundary and regions, 40 %").
SetUp announced_set_up(std::function<void(const std::string&)> print);
/// The same on standard error, after "brachy: ".
SetUp announced_set_up();

}  // namespace brachy
