#include "core/geometry/volume/gzip.h"

#include <zlib.h>

#include <algorithm>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr int kGzipOrZlib = 32;  // as inflateInit2 documents it: either header
// A byte of deflate's stream makes at most 1032 (zlib's technical notes), and its headers take 20.
constexpr std::size_t kMostInflation = 1032, kGzipOverhead = 20;
constexpr std::size_t kMostIn = std::size_t{1} << 16, kMostOut = std::size_t{1} << 30;  // of a call of zlib's

}  // namespace

GzipReader::GzipReader(std::string_view data, Format format)
    : stream_(std::make_unique<z_stream>()), format_(format), left_(data) {
  if (inflateInit2(stream_.get(), format == Format::kGzip ? kGzipOrZlib + MAX_WBITS : -MAX_WBITS) != Z_OK)
    throw UserError("zlib cannot be started; free some memory");
}

GzipReader::~GzipReader() {
  inflateEnd(stream_.get());
}

std::optional<std::size_t> GzipReader::read(std::span<char> out) {
  std::size_t done = 0;
  while (done < out.size() && !is_at_end_) {
    const auto in = static_cast<uInt>(std::min(left_.size(), kMostIn));
    // zlib does not write to its input.
    stream_->next_in = reinterpret_cast<Bytef*>(const_cast<char*>(left_.data()));
    stream_->avail_in = in;
    stream_->next_out = reinterpret_cast<Bytef*>(out.data() + done);
    stream_->avail_out = static_cast<uInt>(std::min(out.size() - done, kMostOut));
    const uInt space = stream_->avail_out;
    const int result = inflate(stream_.get(), Z_NO_FLUSH);
    left_.remove_prefix(in - stream_->avail_in);
    done += space - stream_->avail_out;
    if (result == Z_STREAM_END) {
      left_.remove_prefix(std::min(left_.find_first_not_of('\0'), left_.size()));
      is_at_end_ = left_.empty() || format_ == Format::kRawDeflate;
      if (!is_at_end_ && inflateReset(stream_.get()) != Z_OK) return std::nullopt;
    } else if (result != Z_OK || (in == stream_->avail_in && space == stream_->avail_out)) {
      return std::nullopt;
    }
  }
  return done;
}

bool can_inflate_to(std::size_t compressed_bytes, std::size_t bytes) {
  return bytes / kMostInflation <= compressed_bytes + kGzipOverhead;
}

}  // namespace brachy
