#include "net/wire/image_pixels.h"

#define ZLIB_CONST  // inputs are const
#include <zlib.h>

#include <cassert>
#include <new>

namespace brachy::net {

std::string_view read_pixels(const ImageMessage& image, std::vector<std::uint8_t>& pixels) {
  const std::size_t size = std::size_t{image.width} * image.height;
  pixels.resize(size);
  if ((image.flags & kImageZlib) == 0) {
    if (image.data.size() != size) return "an image has not as many pixels as its size says";
    pixels = image.data;
    return {};
  }
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  std::uint8_t beyond = 0;  // where an image of no pixels would be written
  stream.next_in = image.data.data();
  stream.avail_in = static_cast<uInt>(image.data.size());
  stream.next_out = size > 0 ? pixels.data() : &beyond;
  stream.avail_out = static_cast<uInt>(size);
  const int result = inflate(&stream, Z_FINISH);
  const bool is_whole = result == Z_STREAM_END && stream.avail_out == 0 && stream.avail_in == 0;
  inflateEnd(&stream);
  if (!is_whole) return "an image's compressed pixels are damaged, or not as many as its size says";
  return {};
}

class PixelPacker::Stream {
 public:
  Stream() {
    if (deflateInit(&z, Z_BEST_SPEED) != Z_OK) throw std::bad_alloc();
  }
  ~Stream() { deflateEnd(&z); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  z_stream z{};
};

PixelPacker::PixelPacker(std::size_t most_pixels) : stream_(std::make_unique<Stream>()) {
  most_bytes_ = deflateBound(&stream_->z, most_pixels);
}
PixelPacker::~PixelPacker() = default;

std::size_t PixelPacker::most_bytes() const {
  return most_bytes_;
}

void PixelPacker::pack(std::span<const std::uint8_t> pixels, std::vector<std::uint8_t>& out) {
  z_stream& z = stream_->z;
  deflateReset(&z);
  out.resize(most_bytes_);
  z.next_in = pixels.data();
  z.avail_in = static_cast<uInt>(pixels.size());
  z.next_out = out.data();
  z.avail_out = static_cast<uInt>(out.size());
  const int result = deflate(&z, Z_FINISH);
  assert(result == Z_STREAM_END && "more pixels than promised");
  out.resize(result == Z_STREAM_END ? out.size() - z.avail_out : 0);
}

}  // namespace brachy::net
