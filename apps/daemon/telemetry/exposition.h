#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/realtime/histogram.h"

namespace brachy {

/// Writes Prometheus' text format: each family is its HELP and TYPE and then its samples.
class Exposition {
 public:
  using Labels = std::vector<std::pair<std::string_view, std::string>>;

  void family(std::string_view name, std::string_view type, std::string_view help);
  void sample(double value, const Labels& labels = {});  ///< of the family that was begun last

  /// A family of one sample.
  void counter(std::string_view name, double value, std::string_view help);
  void gauge(std::string_view name, double value, std::string_view help);
  /// In seconds; bucket counts are exact to within 1/32 of the bound.
  void histogram(std::string_view name, const Histogram& ns, std::string_view help);

  std::string take() { return std::move(text_); }

 private:
  void sample(std::string_view name, double value, const Labels& labels);

  std::string text_, name_;
};

}  // namespace brachy
