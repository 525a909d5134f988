#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "net/igtl/codec/codec.h"
#include "net/igtl/content/needle_name.h"
#include "net/wire/messages.h"

namespace brachy::net::igtl {

inline constexpr std::array<ScannerArray, 3> kImageArrays = {ScannerArray::kTransverse,
                                                             ScannerArray::kSagittal, ScannerArray::kEndFire};

/// Device name of an array's IMAGE: "UltrasoundTransverse", "UltrasoundSagittal", "UltrasoundEndFire".
std::string_view image_name(ScannerArray array);
/// Whether a client that asks for `device` wants it: by its name; without one, or by "Ultrasound", any.
bool is_image_of(std::string_view device, ScannerArray array);

/// The newest ultrasound image of each array: encoded once for each header version, when the first client wants it, and
/// shared by all; and what is set at the scanner, which says whether it still shows them. One thread.
class ImageMessages {
 public:
  /// `naming`: the frame that images are in.
  explicit ImageMessages(Naming naming = {}) : naming_(std::move(naming)) {}

  /// Its pixels are not compressed.
  void update(std::shared_ptr<const ImageMessage> image, std::int64_t utc_ns);

  /// What is in use from now on; until it is known every array is, and live.
  void set_scanner(const ScannerMessage& scanner);

  /// The image for a client that asks for `device`, one that the scanner shows now: of an array in use, flagged frozen
  /// while it is, else at most a second old. nullopt: none yet. `now_ns` of the server's clock.
  std::optional<ScannerArray> current(std::string_view device, std::int64_t now_ns) const;
  /// Why no image of that name can come while the scanner is set as it is; "": one can.
  std::string why_none(std::string_view device) const;

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
  std::vector<ScannerArray> in_use_{kImageArrays.begin(), kImageArrays.end()};
  bool is_frozen_ = false;
};

}  // namespace brachy::net::igtl
