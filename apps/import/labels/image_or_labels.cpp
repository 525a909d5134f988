#include "apps/import/labels/image_or_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "core/brachytherapy/structures/name_words.h"

namespace brachy {
namespace {

constexpr std::size_t kFewValues = 8, kManyValues = 128;
constexpr double kLeastBackground = 0.05;
// As name_words writes them: without digits, which are words of their own.
constexpr std::array<std::string_view, 15> kImageWords = {"ct",    "cbct", "mr",     "mri", "us",
                                                          "trus",  "pet",  "pt",     "adc", "dwi",
                                                          "image", "img",  "volume", "vol", "scan"};
constexpr std::array<std::string_view, 10> kLabelWords = {
    "seg", "segs", "segmentation", "segmentations", "label", "labels", "labelmap", "mask", "masks", "lbl"};
constexpr double kShareOfFew = 0.3, kShareOfMany = 0.55, kShareBeyond = 0.8;

struct NeighbourPairs {
  std::size_t equal = 0, all = 0;

  void count(std::uint16_t a, std::uint16_t b) {
    if (a == 0 && b == 0) return;
    ++all;
    equal += a == b ? 1 : 0;
  }
  double share() const { return all == 0 ? 1 : static_cast<double>(equal) / static_cast<double>(all); }
};

NeighbourPairs pairs_of(const LabelMap& map) {
  const auto [nx, ny, nz] = map.grid.size;
  NeighbourPairs pairs;
  for (const auto& labels : map.layers)
    for (std::size_t k = 0; k < nz; ++k)
      for (std::size_t j = 0; j < ny; ++j) {
        const std::size_t row = map.grid.index(0, j, k);
        for (std::size_t i = 0; i + 1 < nx; ++i) pairs.count(labels[row + i], labels[row + i + 1]);
        if (j + 1 < ny)
          for (std::size_t i = 0; i < nx; ++i) pairs.count(labels[row + i], labels[row + nx + i]);
        if (k + 1 < nz)
          for (std::size_t i = 0; i < nx; ++i) pairs.count(labels[row + i], labels[row + nx * ny + i]);
      }
  return pairs;
}

double background_share(const LabelMap& map) {
  std::size_t zeros = 0, all = 0;
  for (const auto& labels : map.layers) {
    zeros += static_cast<std::size_t>(std::ranges::count(labels, 0));
    all += labels.size();
  }
  return all == 0 ? 1 : static_cast<double>(zeros) / static_cast<double>(all);
}

bool has_word(const std::string& file, std::span<const std::string_view> words) {
  const std::string name = std::filesystem::path(file).filename().string();
  const std::vector<std::string> own = name_words(name.substr(0, name.find('.')));
  return std::ranges::any_of(
      own, [&](const std::string& word) { return std::ranges::find(words, word) != words.end(); });
}

}  // namespace

std::string image_reason(const LabelMap& map, const std::string& file) {
  if (map.is_declared || map.segments.size() <= 1) return {};
  if (has_word(file, kLabelWords)) return {};
  if (has_word(file, kImageWords)) return "by its name";
  const std::size_t values = map.segments.size();
  const double least = background_share(map) < kLeastBackground ? kShareBeyond
                       : values <= kFewValues                   ? kShareOfFew
                       : values <= kManyValues                  ? kShareOfMany
                                                                : kShareBeyond;
  const double share = pairs_of(map).share();
  if (share >= least) return {};
  return std::to_string(values) + " values, and " + std::to_string(std::lround(100 * share)) +
         " % of neighbours are equal";
}

}  // namespace brachy
