#include "apps/import/labels/label_nrrd.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "apps/import/labels/inflate.h"
#include "apps/import/labels/label_values.h"
#include "apps/import/labels/voxel_values.h"
#include "core/base/error.h"

namespace brachy {
namespace {

struct NrrdHeader {
  std::map<std::string, std::string> fields, keys;  ///< "type: int", "Segment0_Name:=prostate"
  std::size_t data_begin = 0;
};

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

NrrdHeader parse_header(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with("NRRD000"))
    throw UserError(name + ": is no NRRD file; its first line must be NRRD0001 … 5");
  NrrdHeader header;
  for (std::size_t at = bytes.find('\n'); at != std::string_view::npos;) {
    const std::size_t end = bytes.find('\n', at + 1);
    if (end == std::string_view::npos || end > (std::size_t{1} << 20)) break;
    const std::string_view line = bytes.substr(at + 1, end - at - 1);
    at = end;
    if (line.empty() || line == "\r") {
      header.data_begin = end + 1;
      return header;
    }
    if (line.starts_with('#')) continue;
    const auto key = line.find(":="), field = line.find(": ");
    if (key != std::string_view::npos && (field == std::string_view::npos || key < field))
      header.keys[std::string(line.substr(0, key))] = trimmed(line.substr(key + 2));
    else if (field != std::string_view::npos)
      header.fields[std::string(line.substr(0, field))] = trimmed(line.substr(field + 2));
    else
      throw UserError(
          name + ": a line of its header is neither \"field: value\" nor \"key:=value\"; write it again");
  }
  throw UserError(name + ": its header has no end, a blank line; copy the file again");
}

class NrrdReader {
 public:
  NrrdReader(std::string_view bytes, const std::string& name)
      : bytes_(bytes), name_(name), header_(parse_header(bytes, name)) {}

  LabelMap read();

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& what) const {
    throw UserError(name_ + ": " + field + ": " + what);
  }
  const std::string& field(const std::string& key) const {
    const auto found = header_.fields.find(key);
    if (found == header_.fields.end()) refuse(key, "is missing; write the file again, with its geometry");
    return found->second;
  }
  std::vector<double> numbers(const std::string& key, std::string text) const;
  VoxelType type() const;
  void read_sizes();
  void read_geometry();
  std::string data(const VoxelType& type) const;
  void read_segments();

  std::string_view bytes_;
  const std::string& name_;
  NrrdHeader header_;
  LabelMap map_;
  std::size_t layers_ = 1;
  bool layers_last_ = false;
};

std::vector<double> NrrdReader::numbers(const std::string& key, std::string text) const {
  for (char& c : text)
    if (c == '(' || c == ')' || c == ',') c = ' ';
  std::vector<double> values;
  const char* at = text.data();
  const char* end = at + text.size();
  for (;;) {
    while (at != end && (*at == ' ' || *at == '\t')) ++at;
    if (at == end) return values;
    double value = 0;
    const auto [after, error] = std::from_chars(*at == '+' ? at + 1 : at, end, value);
    if (error != std::errc() || !std::isfinite(value))
      refuse(key, "\"" + text + "\" is no list of numbers; write the file again");
    values.push_back(value);
    at = after;
  }
}

VoxelType NrrdReader::type() const {
  static const std::map<std::string, VoxelType> types = [] {
    std::map<std::string, VoxelType> all;
    const auto add = [&](std::size_t bytes, bool is_signed, std::initializer_list<const char*> names) {
      for (const char* name : names) all[name] = {bytes, is_signed, false, false};
    };
    add(1, true, {"signed char", "int8", "int8_t"});
    add(1, false, {"uchar", "unsigned char", "uint8", "uint8_t"});
    add(2, true, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"});
    add(2, false, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"});
    add(4, true, {"int", "signed int", "int32", "int32_t"});
    add(4, false, {"uint", "unsigned int", "uint32", "uint32_t"});
    add(8, true, {"longlong", "long long", "int64", "int64_t"});
    add(8, false, {"ulonglong", "unsigned long long", "uint64", "uint64_t"});
    all["float"] = {4, true, true, false};
    all["double"] = {8, true, true, false};
    return all;
  }();
  const auto found = types.find(field("type"));
  if (found == types.end()) refuse("type", "\"" + field("type") + "\" is not known; use unsigned char");
  VoxelType type = found->second;
  if (type.bytes > 1 && header_.fields.contains("endian")) type.is_big_endian = field("endian") == "big";
  return type;
}

void NrrdReader::read_sizes() {
  const std::vector<double> dimension = numbers("dimension", field("dimension"));
  std::vector<double> sizes = numbers("sizes", field("sizes"));
  if (dimension.size() != 1 || (dimension[0] != 3 && dimension[0] != 4) || sizes.size() != dimension[0])
    refuse(
        "sizes",
        "must be those of three axes, or of layers and three axes; export it as a segmentation or label map");
  std::size_t total = 1;
  for (const double size : sizes) {
    if (!(size >= 1 && size <= 1e6) || size != std::floor(size))
      refuse("sizes", "must be whole numbers from 1 on; write the file again");
    total *= static_cast<std::size_t>(size);
    if (total > kMostVoxels) refuse("sizes", "are over 2^29 voxels; crop the map");
  }
  if (sizes.size() == 4) {
    // The axis of layers is the one without a direction; Slicer writes it first.
    const std::string& directions = field("space directions");
    layers_last_ = !directions.starts_with("none");
    if (layers_last_ && !directions.ends_with("none"))
      refuse("space directions", "must be none for the axis of layers");
    layers_ = static_cast<std::size_t>(layers_last_ ? sizes.back() : sizes.front());
    if (layers_ > 64) refuse("sizes", "are over 64 layers; export fewer segments");
    sizes.erase(layers_last_ ? sizes.end() - 1 : sizes.begin());
  }
  for (std::size_t a = 0; a < 3; ++a) map_.grid.size[a] = static_cast<std::size_t>(sizes[a]);
}

void NrrdReader::read_geometry() {
  std::string space = field("space");
  static const std::map<std::string, std::string> abbreviations = {{"RAS", "right-anterior-superior"},
                                                                   {"LAS", "left-anterior-superior"},
                                                                   {"LPS", "left-posterior-superior"}};
  if (const auto found = abbreviations.find(space); found != abbreviations.end()) space = found->second;
  Vec3 sign;
  if (space == "right-anterior-superior")
    sign = {1, 1, 1};
  else if (space == "left-posterior-superior")
    sign = {-1, -1, 1};
  else if (space == "left-anterior-superior")
    sign = {-1, 1, 1};
  else
    refuse("space", "\"" + space + "\" is no patient space; save it as left-posterior-superior");
  std::string directions = field("space directions");
  for (std::size_t at = directions.find("none"); at != std::string::npos; at = directions.find("none"))
    directions.erase(at, 4);
  const std::vector<double> steps = numbers("space directions", directions);
  const std::vector<double> origin = numbers("space origin", field("space origin"));
  if (steps.size() != 9) refuse("space directions", "must be three vectors; write the file again");
  if (origin.size() != 3) refuse("space origin", "must be one vector; write the file again");
  for (int a = 0; a < 3; ++a)
    map_.grid.steps.col(a) = sign.cwiseProduct(Vec3(steps[static_cast<std::size_t>(3 * a)],
                                                    steps[static_cast<std::size_t>(3 * a + 1)],
                                                    steps[static_cast<std::size_t>(3 * a + 2)]));
  map_.grid.origin = sign.cwiseProduct(Vec3(origin[0], origin[1], origin[2]));
  if (const std::string fault = fault_of(map_.grid); !fault.empty()) refuse("space directions", fault);
}

std::string NrrdReader::data(const VoxelType& type) const {
  if (header_.fields.contains("data file") || header_.fields.contains("datafile"))
    refuse("data file", "the data lies in a file of its own; save it as one .nrrd file");
  const std::size_t voxels = map_.grid.count() * layers_, size = voxels * type.bytes;
  std::string_view stored = bytes_.substr(header_.data_begin);
  const std::string& encoding = field("encoding");
  std::string bytes;
  if (encoding == "raw") {
    bytes = stored;
  } else if (encoding == "gzip" || encoding == "gz") {
    bytes = inflated(stored, name_, size);
  } else if (encoding == "ascii" || encoding == "text" || encoding == "txt") {
    if (type.bytes != 1 || type.is_signed)
      refuse("encoding", "ascii is read of unsigned char alone; save it as raw or gzip");
    std::string text(stored);
    std::ranges::replace(text, '\n', ' ');
    std::ranges::replace(text, '\r', ' ');
    for (const double value : numbers("data", text)) {
      if (!(value >= 0 && value <= 255))
        refuse("data", "an unsigned char is 0 … 255; save it as raw or gzip");
      bytes += static_cast<char>(static_cast<unsigned char>(value));
    }
  } else {
    refuse("encoding", "\"" + encoding + "\" is not known; save it as raw or gzip");
  }
  if (bytes.size() < size)
    refuse("sizes", "are of " + std::to_string(size) + " bytes, but the file has " +
                        std::to_string(bytes.size()) + "; it is cut off, copy it again");
  return bytes;
}

void NrrdReader::read_segments() {
  for (std::size_t n = 0; n < 4096; ++n) {
    const std::string prefix = "Segment" + std::to_string(n) + "_";
    const auto find = [&](const char* key) { return header_.keys.find(prefix + key); };
    if (find("ID") == header_.keys.end() && find("Name") == header_.keys.end()) break;
    LabelMap::Segment segment;
    if (find("Name") != header_.keys.end()) segment.name = find("Name")->second;
    const auto whole = [&](const char* key, double otherwise) {
      if (find(key) == header_.keys.end()) return otherwise;
      const std::vector<double> values = numbers(prefix + key, find(key)->second);
      if (values.size() != 1 || !(values[0] >= 0 && values[0] <= 65535))
        refuse(prefix + key, "must be 0 … 65535; save it again");
      return values[0];
    };
    // Files of Slicer before 4.11 have neither: a layer for each segment, with 1.
    segment.value = static_cast<std::uint16_t>(whole("LabelValue", 1));
    segment.layer = static_cast<std::size_t>(whole("Layer", layers_ > 1 ? static_cast<double>(n) : 0));
    if (segment.layer >= layers_)
      refuse(prefix + "Layer", "there are " + std::to_string(layers_) + " layers; save it again");
    if (find("Color") != header_.keys.end()) {
      const std::vector<double> rgb = numbers(prefix + "Color", find("Color")->second);
      if (rgb.size() == 3)
        segment.colour = {std::clamp(rgb[0], 0.0, 1.0), std::clamp(rgb[1], 0.0, 1.0),
                          std::clamp(rgb[2], 0.0, 1.0)};
    }
    map_.segments.push_back(std::move(segment));
  }
  if (map_.segments.empty()) add_segments_by_value(map_);
}

LabelMap NrrdReader::read() {
  read_sizes();
  read_geometry();
  const VoxelType voxel = type();
  const std::string bytes = data(voxel);
  const std::size_t count = map_.grid.count();
  if (layers_ == 1) {
    map_.layers.push_back(to_labels(bytes, count, voxel, name_));
  } else {
    const std::vector<std::uint16_t> all = to_labels(bytes, count * layers_, voxel, name_);
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      auto& labels = map_.layers.emplace_back(count);
      for (std::size_t n = 0; n < count; ++n)
        labels[n] = layers_last_ ? all[layer * count + n] : all[n * layers_ + layer];
    }
  }
  read_segments();
  return std::move(map_);
}

}  // namespace

LabelMap parse_label_nrrd(std::string_view bytes, const std::string& name) {
  return NrrdReader(bytes, name).read();
}

}  // namespace brachy
