#include "core/geometry/volume/nrrd_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/geometry/volume/place_fault.h"

namespace brachy {
namespace {

constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20;

[[noreturn]] void refuse(const std::string& name, const std::string& what) {
  throw UserError(name + ": " + what);
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  while (!text.empty() && kSpace.find(text.back()) != std::string_view::npos) text.remove_suffix(1);
  return text;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  constexpr std::string_view kSpace = " \t\r";
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
    if (text.empty()) return words;
    words.push_back(text.substr(0, text.find_first_of(kSpace)));
    text.remove_prefix(words.back().size());
  }
}

template <class Number>
std::optional<Number> number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// The fields by their names in lower case, and the key/value pairs.
class Fields {
 public:
  Fields(std::string_view bytes, const std::string& name) : name_(name) {
    if (!bytes.starts_with("NRRD000") || bytes.size() < 9 || bytes[7] < '1' || bytes[7] > '5')
      refuse(name,
             "is not an NRRD file (it does not begin with NRRD0001 to NRRD0005); save the volume as .nrrd");
    const std::string_view head = bytes.substr(0, kMaxHeaderBytes);
    std::size_t at = 0;
    for (std::size_t line_number = 1;; ++line_number) {
      const std::size_t end = head.find('\n', at);
      if (end == std::string_view::npos)
        refuse(name,
               "the header has no end (an empty line) within 1 MiB; the file is damaged or an .nhdr: save it "
               "as .nrrd");
      const std::string_view line = trimmed(head.substr(at, end - at));
      at = end + 1;
      if (line_number == 1 || line.starts_with('#')) continue;
      if (line.empty()) break;
      const std::size_t colon = line.find(':');
      if (colon == std::string_view::npos)
        refuse(name, "line " + std::to_string(line_number) + " of the header, \"" +
                         one_short_line(std::string(line)) +
                         "\", is no \"field: value\"; save the volume again");
      if (line.substr(colon + 1).starts_with('=')) {
        keys_.insert_or_assign(std::string(line.substr(0, colon)), trimmed(line.substr(colon + 2)));
        continue;
      }
      const std::string field = lower_case(trimmed(line.substr(0, colon)));
      if (!values_.emplace(field, trimmed(line.substr(colon + 1))).second)
        refuse(name, "the header has \"" + one_short_line(field) + "\" twice; save the volume again");
    }
    end_ = at;
  }

  std::size_t end() const { return end_; }
  std::map<std::string, std::string> take_keys() { return std::move(keys_); }
  std::optional<std::string_view> find(std::initializer_list<const char*> spellings) const {
    for (const char* spelling : spellings)
      if (const auto it = values_.find(spelling); it != values_.end()) return it->second;
    return std::nullopt;
  }
  std::string_view need(const char* field, const char* fix) const {
    const auto value = find({field});
    if (!value) refuse(name_, std::string("the header has no \"") + field + "\"; " + fix);
    return *value;
  }
  [[noreturn]] void bad(const char* field, std::string_view value, const std::string& fix) const {
    refuse(name_, std::string("\"") + field + ": " + one_short_line(std::string(value)) + "\": " + fix);
  }

 private:
  const std::string& name_;
  std::map<std::string, std::string_view> values_;
  std::map<std::string, std::string> keys_;
  std::size_t end_ = 0;
};

VoxelType type_of(const Fields& fields) {
  const std::string_view value = fields.need("type", "save the volume again");
  const std::string type = lower_case(value);
  const auto is_one_of = [&](std::initializer_list<const char*> names) {
    return std::ranges::find(names, type) != names.end();
  };
  const auto whole = [](std::size_t bytes, bool is_signed) {
    return VoxelType{bytes, is_signed, false, false};
  };
  if (is_one_of({"signed char", "int8", "int8_t"})) return whole(1, true);
  if (is_one_of({"uchar", "unsigned char", "uint8", "uint8_t"})) return whole(1, false);
  if (is_one_of({"short", "short int", "signed short", "signed short int", "int16", "int16_t"}))
    return whole(2, true);
  if (is_one_of({"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}))
    return whole(2, false);
  if (is_one_of({"int", "signed int", "int32", "int32_t"})) return whole(4, true);
  if (is_one_of({"uint", "unsigned int", "uint32", "uint32_t"})) return whole(4, false);
  if (is_one_of({"longlong", "long long", "long long int", "signed long long", "signed long long int",
                 "int64", "int64_t"}))
    return whole(8, true);
  if (is_one_of({"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}))
    return whole(8, false);
  if (is_one_of({"float"})) return {4, true, true, false};
  if (is_one_of({"double"})) return {8, true, true, false};
  fields.bad("type", value, "not readable; convert it to uint8, int16, uint16 or float");
}

NrrdEncoding encoding_of(const Fields& fields) {
  const std::string_view value = fields.need("encoding", "save the volume again");
  const std::string encoding = lower_case(value);
  if (encoding == "raw") return NrrdEncoding::kRaw;
  if (encoding == "gzip" || encoding == "gz") return NrrdEncoding::kGzip;
  if (encoding == "ascii" || encoding == "text" || encoding == "txt") return NrrdEncoding::kText;
  fields.bad("encoding", value, "not readable; save it with encoding raw or gzip");
}

/// Of x and y, from the file's space to RAS.
Vec3 signs_of_space(const Fields& fields) {
  const std::string_view value =
      fields.need("space", "without it left is not known from right: save it in LPS or RAS");
  const std::string space = lower_case(value);
  if (space == "right-anterior-superior" || space == "ras") return {1, 1, 1};
  if (space == "left-anterior-superior" || space == "las") return {-1, 1, 1};
  if (space == "left-posterior-superior" || space == "lps") return {-1, -1, 1};
  fields.bad("space", value, "is no patient's space of three dimensions; save it in LPS or RAS");
}

/// "(x,y,z)" at the front of `text`, which is advanced past it.
std::optional<Vec3> next_vector(std::string_view& text) {
  text = trimmed(text);
  const std::size_t end = text.find(')');
  if (!text.starts_with('(') || end == std::string_view::npos) return std::nullopt;
  std::string_view inside = text.substr(1, end - 1);
  text.remove_prefix(end + 1);
  Vec3 v;
  for (int k = 0; k < 3; ++k) {
    const std::size_t comma = k < 2 ? inside.find(',') : inside.size();
    if (comma == std::string_view::npos) return std::nullopt;
    const auto number = number_of<double>(trimmed(inside.substr(0, comma)));
    if (!number) return std::nullopt;
    v[k] = *number;
    inside.remove_prefix(std::min(comma + 1, inside.size()));
  }
  return v;
}

/// The text of "space directions" without the "none" of the axis of layers.
std::string_view directions_of(const Fields& fields, NrrdHeader& header, bool has_layers) {
  const std::string_view text =
      fields.need("space directions", "its place in the patient is not known: save it with orientation");
  if (!has_layers) return text;
  std::string_view rest = trimmed(text);
  header.are_layers_last = !rest.starts_with("none");
  if (!header.are_layers_last)
    rest.remove_prefix(4);
  else if (rest.ends_with("none"))
    rest.remove_suffix(4);
  else
    fields.bad("space directions", text,
               "must be none for the axis of layers, the first or last; correct it");
  return rest;
}

void read_sizes(const Fields& fields, const std::string& name, const NrrdLimits& limits, bool has_layers,
                NrrdHeader& header) {
  const std::string_view text = fields.need("sizes", "save the volume again");
  const auto words = words_of(text);
  if (words.size() != (has_layers ? 4 : 3))
    fields.bad("sizes", text, has_layers ? "give four" : "give three");
  std::size_t count = 1;
  std::array<std::size_t, 4> sizes{};
  for (std::size_t k = 0; k < words.size(); ++k) {
    const auto size = number_of<std::size_t>(words[k]);
    if (!size || *size == 0) fields.bad("sizes", text, "each is a whole number of 1 or more");
    if (*size > limits.max_values / count)
      refuse(name, "\"sizes: " + one_short_line(std::string(text)) + "\" are more than the " +
                       std::to_string(limits.max_values) +
                       " values that are read; crop or resample the volume");
    sizes[k] = *size;
    count *= *size;
  }
  const std::size_t first = has_layers && !header.are_layers_last ? 1 : 0;
  if (has_layers) header.layers = sizes[first == 1 ? 0 : 3];
  if (header.layers > limits.max_layers)
    fields.bad("sizes", text,
               "more than " + std::to_string(limits.max_layers) + " layers; export fewer segments");
  for (std::size_t k = 0; k < 3; ++k) header.grid.size[k] = sizes[first + k];
}

void read_place(const Fields& fields, const std::string& name, std::string_view directions, VoxelGrid& grid) {
  const Vec3 signs = signs_of_space(fields);
  if (const auto units = fields.find({"space units"})) {
    const auto words = words_of(*units);
    if (std::ranges::any_of(words, [](std::string_view unit) { return unit != "\"mm\"" && unit != "mm"; }))
      fields.bad("space units", *units, "save it in mm");
  }
  std::string_view rest = directions;
  for (int k = 0; k < 3; ++k) {
    const auto step = next_vector(rest);
    if (!step)
      fields.bad("space directions", directions, "give three vectors (x,y,z), none of them \"none\"");
    grid.steps.col(k) = signs.cwiseProduct(*step);
  }
  if (!trimmed(rest).empty()) fields.bad("space directions", directions, "give three vectors (x,y,z)");
  const std::string_view origin =
      fields.need("space origin", "its place in the patient is not known: save it with orientation");
  rest = origin;
  const auto at = next_vector(rest);
  if (!at || !trimmed(rest).empty() || !at->allFinite())
    fields.bad("space origin", origin, "give one vector (x,y,z), mm");
  grid.origin = signs.cwiseProduct(*at);
  if (const std::string fault = place_fault(grid); !fault.empty())
    refuse(name, "\"space directions\" and \"space origin\": " + fault);
}

std::size_t skip_of(const Fields& fields, std::initializer_list<const char*> spellings) {
  const auto value = fields.find(spellings);
  if (!value) return 0;
  const auto count = number_of<std::size_t>(*value);
  if (!count) fields.bad(*spellings.begin(), *value, "give a whole number");
  return *count;
}

}  // namespace

NrrdHeader parse_nrrd_header(std::string_view bytes, const std::string& name, const NrrdLimits& limits) {
  Fields fields(bytes, name);
  if (fields.find({"data file", "datafile"}))
    refuse(name,
           "\"data file\": its data are in another file, which is not opened; save header and data as one "
           ".nrrd");
  NrrdHeader header;
  header.data_begin = fields.end();
  header.type = type_of(fields);
  header.encoding = encoding_of(fields);
  if (header.type.bytes > 1 && header.encoding != NrrdEncoding::kText) {
    const std::string_view endian = fields.need("endian", "save the volume again");
    header.type.is_big_endian = lower_case(endian) == "big";
    if (!header.type.is_big_endian && lower_case(endian) != "little")
      fields.bad("endian", endian, "give little or big");
  }
  const std::string_view dimension = fields.need("dimension", "save the volume again");
  const bool has_layers = dimension == "4" && limits.max_layers > 1;
  if (dimension != "3" && !has_layers)
    fields.bad("dimension", dimension,
               limits.max_layers > 1
                   ? "three axes are read, or layers and three axes; export it as a segmentation or label map"
                   : "only volumes of three dimensions are read; save one volume of it as 3-D");
  const std::string_view directions = directions_of(fields, header, has_layers);
  read_sizes(fields, name, limits, has_layers, header);
  read_place(fields, name, directions, header.grid);
  header.line_skip = skip_of(fields, {"line skip", "lineskip"});
  const auto byte_skip = fields.find({"byte skip", "byteskip"});
  header.is_at_end = byte_skip == "-1";
  if (header.is_at_end && header.encoding != NrrdEncoding::kRaw)
    fields.bad("byte skip", *byte_skip, "only raw data may have it; save the volume again");
  if (!header.is_at_end) header.byte_skip = skip_of(fields, {"byte skip", "byteskip"});
  header.keys = fields.take_keys();
  return header;
}

}  // namespace brachy
