#include "apps/import/case/case_volume.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/voxels/image_series.h"
#include "core/base/error.h"
#include "core/geometry/volume/volume.h"

namespace brachy {
namespace {

constexpr double kDisplayedDb = 60;  // as of ultrasound.volume_db_per_value

/// Why the values are no echoes in dB; empty where they are.
std::string echo_fault(const DicomItem& image, double db_per_value, bool meets_gland) {
  if (!meets_gland) return "they do not meet the gland";
  if (image.text(tag::kPhotometric) == "MONOCHROME1")
    return tag::kPhotometric.text() + " shows low values bright";
  if (!(db_per_value >= 1e-6 && db_per_value <= 100))
    return tag::kRescaleSlope.text() + " leaves no scale in dB";
  return {};
}

/// The display of a scanner: its whole scale of grey for some 60 dB.
double displayed_db_per_value(const DicomItem& image) {
  const double bits = image.optional_number(tag::kBitsStored).value_or(8);
  const double slope = std::abs(image.optional_number(tag::kRescaleSlope).value_or(1));
  return kDisplayedDb / (slope * (std::exp2(std::clamp(bits, 1.0, 32.0)) - 1));
}

}  // namespace

std::string ImageSeries::frame() const {
  return images.front()->data().text(tag::kFrameOfReference);
}

const ImageSeries* add_volume(const SeriesByUid& series, const std::string& frame, ImportedCase& imported) {
  std::vector<const ImageSeries*> near;
  const auto leave = [&](const ImageSeries& one, const std::string& why) {
    const std::size_t more = one.images.size() - 1;
    imported.left.push_back(one.first_file + ": " + why +
                            (more > 0 ? ", with " + std::to_string(more) + " more" : ""));
  };
  for (const auto& [uid, one] : series) {
    const std::string own = one.frame();
    if (own.empty() || frame.empty() || own == frame)
      near.push_back(&one);
    else
      leave(one, "a series of images in another frame of reference");
  }
  std::ranges::stable_sort(near, std::greater<>(), [](const ImageSeries* s) { return s->images.size(); });
  for (std::size_t n = 0; n < near.size(); ++n) {
    std::vector<const DicomFile*> images;
    for (const auto& image : near[n]->images) images.push_back(image.get());
    std::vector<std::string> left;
    try {
      imported.volume = read_image_series(images, left);
    } catch (const UserError& e) {
      imported.left.insert(imported.left.end(), left.begin(), left.end());
      imported.left.push_back(e.what() + (images.size() > 1
                                              ? " (a series of " + std::to_string(images.size()) + " images)"
                                              : std::string()));
      continue;
    }
    for (const std::string& what : left) imported.left.push_back(what);
    for (std::size_t k = n + 1; k < near.size(); ++k) leave(*near[k], "a shorter series of images");
    return near[n];
  }
  return nullptr;
}

void add_echoes(const ImageSeries& series, ImportedCase& imported) {
  std::vector<const DicomFile*> slices;
  for (const auto& image : series.images) slices.push_back(image.get());
  imported.volume_modality = slices.front()->modality();
  imported.taken.push_back("volume from a series of " + std::to_string(slices.size()) + " images");
  if (imported.volume_modality != "US") {
    imported.left.push_back(
        "the " + imported.volume_modality +
        " images are no echoes: the ultrasound image is made of the structures; to use them all "
        "the same, add under [ultrasound] in scene.toml: volume = \"volume.nrrd\"");
    return;
  }
  const Volume image(imported.volume->grid, imported.volume->values);
  const bool meets_gland = std::ranges::any_of(imported.structures.front().mesh.vertices,
                                               [&](const Vec3& v) { return image.contains(v); });
  const DicomItem first = slices.front()->data();
  const double db_per_value = displayed_db_per_value(first);
  const std::string fault = echo_fault(first, db_per_value, meets_gland);
  if (fault.empty())
    imported.echo_db_per_value = db_per_value;
  else
    imported.left.push_back("the US images are not used for the ultrasound image: " + fault);
}

}  // namespace brachy
