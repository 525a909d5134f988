#include "apps/terminal/set_up_progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

#include "core/realtime/deadline.h"

namespace brachy {

std::optional<std::string> SetUpText::at(double t_s, double share) {
  if (t_s - last_s_ < kBetweenS) return std::nullopt;
  last_s_ = t_s;
  return fmt::format("set-up: boundary and regions, {:.0f} %", std::floor(100 * std::clamp(share, 0.0, 1.0)));
}

SetUp announced_set_up(std::function<void(const std::string&)> print) {
  SetUp set_up;
  set_up.progress = [print = std::move(print), text = SetUpText(),
                     begin_ns = monotonic_ns()](double share) mutable {
    if (const auto line = text.at(1e-9 * static_cast<double>(monotonic_ns() - begin_ns), share)) print(*line);
  };
  return set_up;
}

SetUp announced_set_up() {
  return announced_set_up([](const std::string& line) {
    std::cerr << "brachy: " << line << "\n" << std::flush;
  });
}

}  // namespace brachy
