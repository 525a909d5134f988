#include "core/geometry/volume/nrrd_data.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/geometry/volume/gzip.h"

namespace brachy {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 16;  // whole values of any type
constexpr double kLargestWhole = 16777216;            // 2^24: every float below is exact

[[noreturn]] void refuse_data(const std::string& name, const std::string& what) {
  throw UserError(name + ": " + what);
}

[[noreturn]] void refuse_size(const std::string& name, const std::string& holds, std::size_t needed) {
  refuse_data(name, std::string("holds ")
                        .append(holds)
                        .append(" of data where its \"sizes\" and \"type\" need ")
                        .append(std::to_string(needed))
                        .append("; it is damaged, save it again"));
}

/// Takes values one after another, as floats that hold them exactly.
class FloatValues {
 public:
  FloatValues(const NrrdHeader& header, const std::string& name) : header_(header), name_(name) {}
  // Not before it is known that the data can hold them.
  void reserve() { values_.reserve(header_.count()); }
  void add(double value) {
    if (!header_.type.is_real && std::abs(value) > kLargestWhole)
      refuse_data(name_,
                  "has the value " + text_of(value) +
                      ", and whole numbers beyond 16777216 are not read; convert it to int16 or uint16");
    const auto single = static_cast<float>(value);
    if (!std::isfinite(single))
      refuse_data(name_, "value " + std::to_string(values_.size()) +
                             " is not a finite number; replace it in the volume");
    values_.push_back(single);
  }
  void add_bytes(std::string_view bytes) {
    const std::size_t size = header_.type.bytes;
    for (std::size_t at = 0; at + size <= bytes.size(); at += size) add(voxel_value(bytes, at, header_.type));
  }
  std::vector<float> take() { return std::move(values_); }
  std::size_t count() const { return values_.size(); }

 private:
  const NrrdHeader& header_;
  const std::string& name_;
  std::vector<float> values_;
};

/// Takes values one after another, as labels.
class LabelValues {
 public:
  LabelValues(const NrrdHeader& header, const std::string& name) : header_(header), name_(name) {}
  void reserve() { values_.reserve(header_.count()); }
  void add(double value) { values_.push_back(label_of(value, name_)); }
  void add_bytes(std::string_view bytes) { append_labels(values_, bytes, header_.type, name_); }
  std::vector<std::uint16_t> take() { return std::move(values_); }
  std::size_t count() const { return values_.size(); }

 private:
  const NrrdHeader& header_;
  const std::string& name_;
  std::vector<std::uint16_t> values_;
};

template <class Values>
void read_raw(const NrrdHeader& header, std::string_view data, const std::string& name, Values& values) {
  const std::size_t needed = header.data_bytes();
  if (header.is_at_end)
    data.remove_prefix(data.size() - std::min(needed, data.size()));
  else
    data.remove_prefix(std::min(header.byte_skip, data.size()));
  if (data.size() != needed) refuse_size(name, std::to_string(data.size()) + " bytes", needed);
  values.reserve();
  values.add_bytes(data);
}

template <class Values>
void read_gzip(const NrrdHeader& header, std::string_view data, const std::string& name, Values& values) {
  const std::size_t needed = header.data_bytes();
  if (!can_inflate_to(data.size(), needed))
    refuse_size(name, std::to_string(data.size()) + " compressed bytes", needed);
  GzipReader gzip(data);
  std::array<char, kChunk> chunk;
  const auto read = [&](std::size_t size) {
    const auto got = gzip.read({chunk.data(), size});
    if (!got) refuse_data(name, "its compressed data are damaged or cut short; save it again");
    return *got;
  };
  std::size_t skip = header.byte_skip;
  while (skip > 0) {
    const std::size_t got = read(std::min(skip, kChunk));
    if (got == 0) refuse_data(name, "\"byte skip\" goes beyond its data; save it again");
    skip -= got;
  }
  values.reserve();
  std::size_t done = 0;
  while (done < needed) {
    const std::size_t wanted = std::min(kChunk, needed - done), got = read(wanted);
    values.add_bytes({chunk.data(), got});
    done += got;
    if (got < wanted) refuse_size(name, std::to_string(done) + " bytes", needed);
  }
  if (read(1) != 0) refuse_size(name, "more bytes", needed);
}

template <class Values>
void read_text(const NrrdHeader& header, std::string_view data, const std::string& name, Values& values) {
  const std::size_t needed = header.count();
  data.remove_prefix(std::min(header.byte_skip, data.size()));
  if (data.size() / 2 + 1 < needed)
    refuse_size(name, "at most " + std::to_string(data.size() / 2 + 1) + " numbers", needed);
  values.reserve();
  constexpr std::string_view kSpace = " \t\r\n,";
  while (true) {
    data.remove_prefix(std::min(data.find_first_not_of(kSpace), data.size()));
    if (data.empty()) break;
    const std::string_view word = data.substr(0, data.find_first_of(kSpace));
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || end != word.data() + word.size())
      refuse_data(name, std::string("among its data \"")
                            .append(one_short_line(std::string(word)))
                            .append("\" is no number; save it again"));
    if (error != std::errc()) value = std::numeric_limits<double>::infinity();
    if (values.count() == needed) refuse_size(name, "more numbers", needed);
    values.add(value);
    data.remove_prefix(word.size());
  }
  if (values.count() != needed) refuse_size(name, std::to_string(values.count()) + " numbers", needed);
}

template <class Values>
auto values_of(const NrrdHeader& header, std::string_view bytes, const std::string& name) {
  std::string_view data = bytes.substr(std::min(header.data_begin, bytes.size()));
  for (std::size_t line = 0; line < header.line_skip; ++line) {
    const std::size_t end = data.find('\n');
    if (end == std::string_view::npos) refuse_data(name, "\"line skip\" goes beyond its data; save it again");
    data.remove_prefix(end + 1);
  }
  Values values(header, name);
  if (header.encoding == NrrdEncoding::kRaw)
    read_raw(header, data, name, values);
  else if (header.encoding == NrrdEncoding::kGzip)
    read_gzip(header, data, name, values);
  else
    read_text(header, data, name, values);
  return values.take();
}

}  // namespace

std::uint16_t label_of(double value, const std::string& name) {
  if (!(value >= 0 && value <= 65535) || value != std::floor(value))
    throw NoLabels(name + ": has the voxel value " + text_of(value) +
                   ", so it is an image, not a label map; give a segmentation with whole labels 0 … 65535");
  return static_cast<std::uint16_t>(value);
}

void append_labels(std::vector<std::uint16_t>& labels, std::string_view bytes, const VoxelType& type,
                   const std::string& name) {
  if (type.bytes == 1 && !type.is_signed) {
    for (const char byte : bytes) labels.push_back(static_cast<unsigned char>(byte));
    return;
  }
  for (std::size_t at = 0; at + type.bytes <= bytes.size(); at += type.bytes)
    labels.push_back(label_of(voxel_value(bytes, at, type), name));
}

std::vector<float> parse_nrrd_data(const NrrdHeader& header, std::string_view bytes,
                                   const std::string& name) {
  return values_of<FloatValues>(header, bytes, name);
}

std::vector<std::uint16_t> parse_nrrd_labels(const NrrdHeader& header, std::string_view bytes,
                                             const std::string& name) {
  return values_of<LabelValues>(header, bytes, name);
}

}  // namespace brachy
