#include "net/igtl/content/image_messages.h"

#include <algorithm>
#include <utility>

namespace brachy::net::igtl {
namespace {

constexpr std::int64_t kImageAgeNs = 1'000'000'000;  // of a live scanner: an older one is not what it shows

}  // namespace

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

void ImageMessages::set_scanner(const ScannerMessage& scanner) {
  in_use_ = {scanner.array};
  if (scanner.array == ScannerArray::kBiplane) in_use_ = {ScannerArray::kTransverse, ScannerArray::kSagittal};
  is_frozen_ = scanner.freeze == ScannerFreeze::kFrozen;
}

std::optional<ScannerArray> ImageMessages::current(std::string_view device, std::int64_t now_ns) const {
  for (const ScannerArray array : in_use_) {
    const auto found = all_.find(array);
    if (found == all_.end() || !is_image_of(device, array)) continue;
    const ImageMessage& image = *found->second.image;
    const bool is_frozen = (image.flags & kImageFrozen) != 0;
    if (is_frozen == is_frozen_ && (is_frozen || now_ns - image.publish_ns < kImageAgeNs)) return array;
  }
  return std::nullopt;
}

std::string ImageMessages::why_none(std::string_view device) const {
  const auto is_asked = [&](ScannerArray array) { return is_image_of(device, array); };
  if (std::ranges::any_of(in_use_, is_asked)) return {};
  const auto names = [](const auto& arrays) {
    std::string all;
    for (const ScannerArray array : arrays) all += (all.empty() ? "" : ", ") + std::string(image_name(array));
    return all;
  };
  if (std::ranges::any_of(kImageArrays, is_asked))
    return std::string(device) + " is of an array that is not in use: the scanner shows " + names(in_use_);
  return "there is no image " + std::string(device) + ": they are " + names(kImageArrays);
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
