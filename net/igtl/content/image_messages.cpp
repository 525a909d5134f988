#include "net/igtl/content/image_messages.h"

#include <utility>

namespace brachy::net::igtl {

std::string_view image_name(ScannerArray array) {
  switch (array) {
    case ScannerArray::kTransverse:
      return "UltrasoundTransverse";
    case ScannerArray::kSagittal:
      return "UltrasoundSagittal";
    default:
      return "UltrasoundEndFire";
  }
}

bool is_image_of(std::string_view device, ScannerArray array) {
  return device.empty() || device == "Ultrasound" || device == image_name(array);
}

void ImageMessages::update(std::shared_ptr<const ImageMessage> image, std::int64_t utc_ns) {
  const ScannerArray array = image->array;
  all_[array] = {std::move(image), to_timestamp(utc_ns), {}};
}

std::vector<ScannerArray> ImageMessages::arrays() const {
  std::vector<ScannerArray> arrays;
  for (const auto& [array, newest] : all_) arrays.push_back(array);
  return arrays;
}

std::shared_ptr<const ImageMessage> ImageMessages::newest(ScannerArray array) const {
  const auto found = all_.find(array);
  return found == all_.end() ? nullptr : found->second.image;
}

std::shared_ptr<const Bytes> ImageMessages::encoded(ScannerArray array, std::uint16_t version) {
  Newest& newest = all_.at(array);
  auto& message = newest.encoded_as[version - 1u];
  if (!message)
    message = std::make_shared<const Bytes>(encode_image({version, image_name(array), newest.timestamp},
                                                         *newest.image, naming_.to_peer(newest.image->X_WI)));
  return message;
}

}  // namespace brachy::net::igtl
