#include "apps/import/labels/meta_image.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/geometry/label_map/label_map.h"
#include "core/geometry/volume/place_fault.h"

namespace brachy {
namespace {

constexpr std::size_t kMostHeader = 65536;

std::string_view stripped(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

struct ElementType {
  const char* name;
  VoxelType type;
};
constexpr std::array kTypes = {ElementType{"MET_UCHAR", {1, false, false, false}},
                               ElementType{"MET_CHAR", {1, true, false, false}},
                               ElementType{"MET_USHORT", {2, false, false, false}},
                               ElementType{"MET_SHORT", {2, true, false, false}},
                               ElementType{"MET_UINT", {4, false, false, false}},
                               ElementType{"MET_INT", {4, true, false, false}},
                               ElementType{"MET_ULONG_LONG", {8, false, false, false}},
                               ElementType{"MET_LONG_LONG", {8, true, false, false}},
                               ElementType{"MET_FLOAT", {4, true, true, false}},
                               ElementType{"MET_DOUBLE", {8, true, true, false}}};

class MetaHeader {
 public:
  MetaHeader(std::string_view bytes, const std::string& name) : name_(name) {
    std::size_t at = 0;
    while (at < std::min(bytes.size(), kMostHeader)) {
      const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
      const std::string_view line = bytes.substr(at, end - at);
      const std::size_t equals = line.find('=');
      if (equals == line.npos) refuse("its header has a line without =; write the file again");
      const std::string key(stripped(line.substr(0, equals)));
      values_[key] = stripped(line.substr(equals + 1));
      at = std::min(end + 1, bytes.size());
      if (key == "ElementDataFile") {
        data_begin_ = at;
        return;
      }
    }
    refuse("its header has no ElementDataFile; is it whole?");
  }

  [[noreturn]] void refuse(const std::string& what) const { throw UserError(name_ + ": " + what); }
  std::size_t data_begin() const { return data_begin_; }
  std::optional<std::string> find(std::initializer_list<const char*> keys) const {
    for (const char* key : keys)
      if (const auto found = values_.find(key); found != values_.end()) return found->second;
    return std::nullopt;
  }
  bool is_true(const char* key) const {
    const std::string value = find({key}).value_or("False");
    return value.starts_with('T') || value.starts_with('t') || value == "1";
  }
  /// `count` finite numbers; nothing where the header has none of the keys.
  std::optional<std::vector<double>> numbers(std::initializer_list<const char*> keys,
                                             std::size_t count) const {
    const auto text = find(keys);
    if (!text) return std::nullopt;
    std::vector<double> values;
    std::string_view rest = *text;
    while (!(rest = stripped(rest)).empty()) {
      const std::string_view word = rest.substr(0, rest.find_first_of(" \t"));
      double value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
        refuse(std::string(*keys.begin()) + " is no list of numbers; write the file again");
      values.push_back(value);
      rest.remove_prefix(word.size());
    }
    if (values.size() != count)
      refuse(std::string(*keys.begin()) + " has " + std::to_string(values.size()) + " numbers, not " +
             std::to_string(count) + "; save one 3-D volume");
    return values;
  }

 private:
  const std::string& name_;
  std::map<std::string, std::string> values_;
  std::size_t data_begin_ = 0;
};

}  // namespace

bool is_meta_image(std::string_view bytes) {
  const std::string_view first = bytes.substr(0, bytes.substr(0, 256).find('\n'));
  return first.starts_with("ObjectType") || first.starts_with("NDims") || first.starts_with("Comment");
}

NrrdHeader parse_meta_header(std::string_view bytes, const std::string& name, const NrrdLimits& limits) {
  const MetaHeader meta(bytes, name);
  if (meta.find({"NDims"}).value_or("") != "3") meta.refuse("NDims must be 3; save one 3-D volume");
  if (meta.find({"ElementNumberOfChannels"}).value_or("1") != "1")
    meta.refuse("ElementNumberOfChannels must be 1; save a volume of scalars");
  if (meta.find({"ElementDataFile"}) != "LOCAL") meta.refuse("its data are in another file; save it as .mha");
  NrrdHeader header;
  const std::string type = meta.find({"ElementType"}).value_or("");
  const auto known = std::ranges::find(kTypes, std::string_view(type),
                                       [](const ElementType& t) { return std::string_view(t.name); });
  if (known == kTypes.end())
    meta.refuse("ElementType " + one_short_line(type) +
                " is not read; save it as MET_UCHAR, MET_SHORT or MET_FLOAT");
  header.type = known->type;
  header.type.is_big_endian = meta.is_true("BinaryDataByteOrderMSB") || meta.is_true("ElementByteOrderMSB");
  header.encoding = meta.is_true("CompressedData") ? NrrdEncoding::kGzip : NrrdEncoding::kRaw;
  const auto size = meta.numbers({"DimSize"}, 3);
  const auto spacing = meta.numbers({"ElementSpacing", "ElementSize"}, 3);
  const auto offset = meta.numbers({"Offset", "Position", "Origin"}, 3);
  const auto directions = meta.numbers({"TransformMatrix", "Rotation", "Orientation"}, 9);
  if (!size || !spacing || !offset)
    meta.refuse("DimSize, ElementSpacing and Offset must be there; write it again");
  double count = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!((*size)[a] >= 1 && (*size)[a] <= 1e6 && (*size)[a] == std::floor((*size)[a])))
      meta.refuse("DimSize must be three sizes from 1 on; write it again");
    header.grid.size[a] = static_cast<std::size_t>((*size)[a]);
    count *= (*size)[a];
  }
  if (count > static_cast<double>(limits.max_values))
    meta.refuse("DimSize are over " + std::to_string(limits.max_values) + " voxels; crop the volume");
  for (int a = 0; a < 3; ++a) {
    const auto at = static_cast<std::size_t>(a);
    Vec3 direction = Vec3::Unit(a);
    if (directions)
      direction = Vec3((*directions)[3 * at], (*directions)[3 * at + 1], (*directions)[3 * at + 2]);
    header.grid.steps.col(a) = (*spacing)[at] * Vec3(-direction.x(), -direction.y(), direction.z());
  }
  header.grid.origin = Vec3(-(*offset)[0], -(*offset)[1], (*offset)[2]);
  if (const std::string fault = place_fault(header.grid, kLabelIndependence); !fault.empty())
    meta.refuse("TransformMatrix: " + fault);
  header.data_begin = meta.data_begin();
  return header;
}

}  // namespace brachy
