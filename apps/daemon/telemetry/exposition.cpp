#include "apps/daemon/telemetry/exposition.h"

#include <fmt/format.h>

#include <cmath>

namespace brachy {
namespace {

// Around the periods of 1 kHz and 200 Hz.
constexpr double kBoundsS[] = {0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25};

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') out += '\\';
    out += c;
  }
  return out;
}

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

}  // namespace

void Exposition::family(std::string_view name, std::string_view type, std::string_view help) {
  name_ = name;
  text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
}

void Exposition::sample(double value, const Labels& labels) {
  sample(name_, value, labels);
}

void Exposition::sample(std::string_view name, double value, const Labels& labels) {
  text_ += name;
  for (std::size_t i = 0; i < labels.size(); ++i)
    text_ += fmt::format("{}{}=\"{}\"", i ? ',' : '{', labels[i].first, escaped(labels[i].second));
  text_ += fmt::format("{} {}\n", labels.empty() ? "" : "}", number(value));
}

void Exposition::counter(std::string_view name, double value, std::string_view help) {
  family(name, "counter", help);
  sample(value);
}

void Exposition::gauge(std::string_view name, double value, std::string_view help) {
  family(name, "gauge", help);
  sample(value);
}

void Exposition::histogram(std::string_view name, const Histogram& ns, std::string_view help) {
  family(name, "histogram", help);
  const std::string bucket = name_ + "_bucket";
  for (const double bound_s : kBoundsS)
    sample(bucket, static_cast<double>(ns.count_up_to(std::llround(1e9 * bound_s))),
           {{"le", number(bound_s)}});
  sample(bucket, static_cast<double>(ns.count()), {{"le", "+Inf"}});
  sample(name_ + "_sum", 1e-9 * static_cast<double>(ns.sum()), {});
  sample(name_ + "_count", static_cast<double>(ns.count()), {});
}

}  // namespace brachy
