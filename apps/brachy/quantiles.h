#pragma once

#include <nlohmann/json.hpp>

#include "core/realtime/histogram.h"
#include "net/wire/messages.h"

namespace brachy {

/// p50, p99 and max in ms, as `watch` and `replay` print them.
inline nlohmann::ordered_json to_json_ms(const Histogram& ns) {
  const auto ms = [&](double q) { return 1e-6 * static_cast<double>(ns.quantile(q)); };
  return {{"p50", ms(0.5)}, {"p99", ms(0.99)}, {"max", 1e-6 * static_cast<double>(ns.max())}};
}

inline nlohmann::ordered_json to_json_ms(const net::Quantiles& q) {
  return {{"p50", q.p50}, {"p99", q.p99}, {"p999", q.p999}, {"max", q.max}};
}

}  // namespace brachy
