#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "net/wire/messages.h"

namespace brachy::net {

/// The image's gray values, rows from the top, into `pixels`: width × height of them. Returns "" or why not, a literal:
/// compressed data that is not zlib's (RFC 1950), or brings more or less than that. Untrusted input: it holds no more
/// than the image's size. Threads: any.
std::string_view read_pixels(const ImageMessage& image, std::vector<std::uint8_t>& pixels);

/// Compresses pixels of images (zlib, its fastest level), one after the other.
/// Threads: one. Does not allocate once constructed, where `out` has most_bytes() of capacity.
class PixelPacker {
 public:
  /// Throws std::bad_alloc.
  explicit PixelPacker(std::size_t most_pixels);
  ~PixelPacker();
  PixelPacker(const PixelPacker&) = delete;
  PixelPacker& operator=(const PixelPacker&) = delete;

  /// Replaces what is in `out`.
  void pack(std::span<const std::uint8_t> pixels, std::vector<std::uint8_t>& out);
  std::size_t most_bytes() const;

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;
  std::size_t most_bytes_ = 0;
};

}  // namespace brachy::net
