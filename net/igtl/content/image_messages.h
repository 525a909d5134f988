#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/igtl/codec/codec.h"
#include "net/igtl/content/needle_name.h"
#include "net/wire/messages.h"

namespace brachy::net::igtl {

/// Device name of an array's IMAGE: "UltrasoundTransverse", "UltrasoundSagittal", "UltrasoundEndFire".
std::string_view image_name(ScannerArray array);
/// Whether a client that asks for `device` wants it: by its name; without one, or by "Ultrasound", any.
bool is_image_of(std::string_view device, ScannerArray array);

/// The newest ultrasound image of each array: encoded once for each header version, when the first client wants it, and
/// shared by all. One thread.
class ImageMessages {
 public:
  /// `naming`: the frame that images are in.
  explicit ImageMessages(Naming naming = {}) : naming_(std::move(naming)) {}

  /// Its pixels are not compressed.
  void update(std::shared_ptr<const ImageMessage> image, std::int64_t utc_ns);

  /// Arrays that have an image, ascending.
  std::vector<ScannerArray> arrays() const;
  /// Null: the array has none.
  std::shared_ptr<const ImageMessage> newest(ScannerArray array) const;
  /// Precondition: newest(array).
  std::shared_ptr<const Bytes> encoded(ScannerArray array, std::uint16_t version);

 private:
  struct Newest {
    std::shared_ptr<const ImageMessage> image;
    std::uint64_t timestamp = 0;
    std::array<std::shared_ptr<const Bytes>, 2> encoded_as;  // by version
  };
  Naming naming_;
  std::map<ScannerArray, Newest> all_;
};

}  // namespace brachy::net::igtl
