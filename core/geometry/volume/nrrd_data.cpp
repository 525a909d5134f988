#include "core/geometry/volume/nrrd_data.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

// A byte of deflate's stream makes at most 1032 (zlib's technical notes), and its headers take 20.
constexpr std::size_t kMostInflation = 1032, kGzipOverhead = 20;
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

template <class Word>
Word word_at(const char* bytes, bool is_big_endian) {
  Word word = 0;
  for (std::size_t k = 0; k < sizeof(Word); ++k) {
    const auto byte =
        static_cast<Word>(static_cast<unsigned char>(bytes[is_big_endian ? sizeof(Word) - 1 - k : k]));
    word = static_cast<Word>(word | static_cast<Word>(byte << (8 * k)));
  }
  return word;
}

double value_at(const char* bytes, NrrdType type, bool big) {
  switch (type) {
    case NrrdType::kInt8:
      return std::bit_cast<std::int8_t>(bytes[0]);
    case NrrdType::kUint8:
      return static_cast<unsigned char>(bytes[0]);
    case NrrdType::kInt16:
      return std::bit_cast<std::int16_t>(word_at<std::uint16_t>(bytes, big));
    case NrrdType::kUint16:
      return word_at<std::uint16_t>(bytes, big);
    case NrrdType::kInt32:
      return std::bit_cast<std::int32_t>(word_at<std::uint32_t>(bytes, big));
    case NrrdType::kUint32:
      return word_at<std::uint32_t>(bytes, big);
    case NrrdType::kFloat:
      return static_cast<double>(std::bit_cast<float>(word_at<std::uint32_t>(bytes, big)));
    case NrrdType::kDouble:
      return std::bit_cast<double>(word_at<std::uint64_t>(bytes, big));
  }
  return 0;
}

/// Takes values one after another.
class Values {
 public:
  Values(const NrrdHeader& header, const std::string& name)
      : header_(header),
        name_(name),
        is_integer_(header.type != NrrdType::kFloat && header.type != NrrdType::kDouble) {}
  // Not before it is known that the data can hold them.
  void reserve() { values_.reserve(header_.grid.count()); }
  void add(double value) {
    if (is_integer_ && std::abs(value) > kLargestWhole)
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
    const std::size_t size = size_of(header_.type);
    for (std::size_t at = 0; at + size <= bytes.size(); at += size)
      add(value_at(&bytes[at], header_.type, header_.is_big_endian));
  }
  std::vector<float> take() { return std::move(values_); }
  std::size_t count() const { return values_.size(); }

 private:
  const NrrdHeader& header_;
  const std::string& name_;
  bool is_integer_;
  std::vector<float> values_;
};

std::vector<float> raw_values(const NrrdHeader& header, std::string_view data, const std::string& name) {
  const std::size_t needed = header.grid.count() * size_of(header.type);
  if (header.is_at_end)
    data.remove_prefix(data.size() - std::min(needed, data.size()));
  else
    data.remove_prefix(std::min(header.byte_skip, data.size()));
  if (data.size() != needed) refuse_size(name, std::to_string(data.size()) + " bytes", needed);
  Values values(header, name);
  values.reserve();
  values.add_bytes(data);
  return values.take();
}

/// zlib's stream of a gzip file.
class Inflater {
 public:
  explicit Inflater(std::string_view data) : left_(data) {
    if (inflateInit2(&stream_, 16 + MAX_WBITS) != Z_OK)
      throw UserError("zlib cannot be started; free some memory");
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Fills `out`; fewer bytes than it has: the data's end. Nothing: they are damaged.
  std::optional<std::size_t> read(std::span<char> out) {
    std::size_t done = 0;
    while (done < out.size() && !is_at_end_) {
      const auto in = static_cast<uInt>(std::min(left_.size(), kChunk));
      // zlib does not write to its input.
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(left_.data()));
      stream_.avail_in = in;
      stream_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
      stream_.avail_out = static_cast<uInt>(out.size() - done);
      const uInt space = stream_.avail_out;
      const int result = inflate(&stream_, Z_NO_FLUSH);
      left_.remove_prefix(in - stream_.avail_in);
      done += space - stream_.avail_out;
      if (result == Z_STREAM_END) {
        // Files may be several streams, one after another; zeros after the last are padding.
        left_.remove_prefix(std::min(left_.find_first_not_of('\0'), left_.size()));
        is_at_end_ = left_.empty();
        if (!is_at_end_ && inflateReset(&stream_) != Z_OK) return std::nullopt;
      } else if (result != Z_OK || (in == stream_.avail_in && space == stream_.avail_out)) {
        return std::nullopt;
      }
    }
    return done;
  }

 private:
  z_stream stream_{};
  std::string_view left_;
  bool is_at_end_ = false;
};

std::vector<float> gzip_values(const NrrdHeader& header, std::string_view data, const std::string& name) {
  const std::size_t needed = header.grid.count() * size_of(header.type);
  if (needed / kMostInflation > data.size() + kGzipOverhead)
    refuse_size(name, std::to_string(data.size()) + " compressed bytes", needed);
  Inflater inflater(data);
  std::array<char, kChunk> chunk;
  const auto read = [&](std::size_t size) {
    const auto got = inflater.read({chunk.data(), size});
    if (!got) refuse_data(name, "its compressed data are damaged or cut short; save it again");
    return *got;
  };
  std::size_t skip = header.byte_skip;
  while (skip > 0) {
    const std::size_t got = read(std::min(skip, kChunk));
    if (got == 0) refuse_data(name, "\"byte skip\" goes beyond its data; save it again");
    skip -= got;
  }
  Values values(header, name);
  values.reserve();
  std::size_t done = 0;
  while (done < needed) {
    const std::size_t wanted = std::min(kChunk, needed - done), got = read(wanted);
    values.add_bytes({chunk.data(), got});
    done += got;
    if (got < wanted) refuse_size(name, std::to_string(done) + " bytes", needed);
  }
  if (read(1) != 0) refuse_size(name, "more bytes", needed);
  return values.take();
}

std::vector<float> text_values(const NrrdHeader& header, std::string_view data, const std::string& name) {
  const std::size_t needed = header.grid.count();
  data.remove_prefix(std::min(header.byte_skip, data.size()));
  if (data.size() / 2 + 1 < needed)
    refuse_size(name, "at most " + std::to_string(data.size() / 2 + 1) + " numbers", needed);
  Values values(header, name);
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
  return values.take();
}

}  // namespace

std::vector<float> parse_nrrd_data(const NrrdHeader& header, std::string_view bytes,
                                   const std::string& name) {
  std::string_view data = bytes.substr(std::min(header.data_begin, bytes.size()));
  for (std::size_t line = 0; line < header.line_skip; ++line) {
    const std::size_t end = data.find('\n');
    if (end == std::string_view::npos) refuse_data(name, "\"line skip\" goes beyond its data; save it again");
    data.remove_prefix(end + 1);
  }
  if (header.encoding == NrrdEncoding::kRaw) return raw_values(header, data, name);
  if (header.encoding == NrrdEncoding::kGzip) return gzip_values(header, data, name);
  return text_values(header, data, name);
}

}  // namespace brachy
