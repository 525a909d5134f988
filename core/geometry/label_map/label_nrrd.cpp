#include "core/geometry/label_map/label_nrrd.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/geometry/volume/nrrd_data.h"
#include "core/geometry/volume/place_fault.h"

namespace brachy {
namespace {

constexpr std::size_t kMostSegments = 4096;

/// The segments of the header's key/value pairs.
class SegmentKeys {
 public:
  SegmentKeys(const NrrdHeader& header, const std::string& name) : header_(header), name_(name) {}

  /// Nothing: there are no more.
  std::optional<LabelMap::Segment> segment(std::size_t n) {
    prefix_ = "Segment" + std::to_string(n) + "_";
    const std::string* id = find("ID");
    const std::string* called = find("Name");
    if (!id && !called) return std::nullopt;
    LabelMap::Segment segment;
    if (called) segment.name = *called;
    // Files of Slicer before 4.11 have neither: a layer for each segment, with 1.
    segment.value = static_cast<std::uint16_t>(whole("LabelValue", 1));
    segment.layer = static_cast<std::size_t>(whole("Layer", header_.layers > 1 ? static_cast<double>(n) : 0));
    if (segment.layer >= header_.layers)
      refuse("Layer", "there are " + std::to_string(header_.layers) + " layers; save it again");
    if (find("Color")) {
      const std::vector<double> rgb = numbers("Color");
      if (rgb.size() == 3) {
        segment.colour.emplace();
        for (std::size_t c = 0; c < 3; ++c) (*segment.colour)[c] = std::clamp(rgb[c], 0.0, 1.0);
      }
    }
    return segment;
  }

 private:
  const std::string* find(const char* key) const {
    const auto found = header_.keys.find(prefix_ + key);
    return found == header_.keys.end() ? nullptr : &found->second;
  }
  [[noreturn]] void refuse(const char* key, const std::string& what) const {
    const std::string* value = find(key);
    throw UserError(name_ + ": \"" + prefix_ + key + (value ? ":=" + one_short_line(*value) : std::string()) +
                    "\": " + what);
  }
  std::vector<double> numbers(const char* key) const {
    const std::string& text = *find(key);
    std::vector<double> values;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
      while (at != end && (*at == ' ' || *at == '\t')) ++at;
      if (at == end) return values;
      double value = 0;
      const auto [after, error] = std::from_chars(*at == '+' ? at + 1 : at, end, value);
      if (error != std::errc() || !std::isfinite(value)) refuse(key, "is no list of numbers; save it again");
      values.push_back(value);
      at = after;
    }
  }
  double whole(const char* key, double otherwise) const {
    if (!find(key)) return otherwise;
    const std::vector<double> values = numbers(key);
    if (values.size() != 1 || !(values[0] >= 0 && values[0] <= 65535) || values[0] != std::floor(values[0]))
      refuse(key, "must be a whole number, 0 … 65535; save it again");
    return values[0];
  }

  const NrrdHeader& header_;
  const std::string& name_;
  std::string prefix_;
};

}  // namespace

LabelMap parse_label_nrrd(std::string_view bytes, const std::string& name, const NrrdLimits& limits) {
  return read_label_volume(parse_nrrd_header(bytes, name, limits), bytes, name);
}

LabelMap read_label_volume(const NrrdHeader& header, std::string_view bytes, const std::string& name) {
  if (const std::string fault = place_fault(header.grid, kLabelIndependence); !fault.empty())
    throw UserError(name + ": \"space directions\": " + fault);
  LabelMap map;
  map.grid = header.grid;
  // Before the values, which are longer.
  SegmentKeys keys(header, name);
  while (auto segment = keys.segment(map.segments.size())) {
    map.segments.push_back(std::move(*segment));
    if (map.segments.size() > kMostSegments) throw UserError(name + ": has over 4096 segments; export fewer");
  }
  map.is_declared = !map.segments.empty();
  std::vector<std::uint16_t> all = parse_nrrd_labels(header, bytes, name);
  if (header.layers == 1) {
    map.layers.push_back(std::move(all));
  } else {
    const std::size_t count = map.grid.count();
    for (std::size_t layer = 0; layer < header.layers; ++layer) {
      auto& labels = map.layers.emplace_back(count);
      for (std::size_t n = 0; n < count; ++n)
        labels[n] = header.are_layers_last ? all[layer * count + n] : all[n * header.layers + layer];
    }
  }
  if (map.segments.empty()) add_segments_by_value(map);
  return map;
}

}  // namespace brachy
