#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "core/realtime/histogram.h"
#include "net/wire/messages.h"

namespace brachy {

// Quantiles of durations in ns, printed by every program in ms.

inline std::string quantile_text(const Histogram& ns) {
  const auto ms = [&](double q) { return 1e-6 * static_cast<double>(ns.quantile(q)); };
  return fmt::format("p50 {:.3f}, p99 {:.3f}, p99.9 {:.3f}, max {:.3f}", ms(0.5), ms(0.99), ms(0.999), ms(1));
}

inline nlohmann::ordered_json to_json_ms(const Histogram& ns) {
  const auto ms = [&](double q) { return 1e-6 * static_cast<double>(ns.quantile(q)); };
  return {{"p50", ms(0.5)}, {"p99", ms(0.99)}, {"p999", ms(0.999)}, {"max", ms(1)}};
}

inline nlohmann::ordered_json to_json_ms(const net::Quantiles& q) {
  return {{"p50", q.p50}, {"p99", q.p99}, {"p999", q.p999}, {"max", q.max}};
}

}  // namespace brachy
