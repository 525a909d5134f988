#include "apps/import/voxels/rt_dose.h"

#include <cmath>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/voxels/dicom_plane.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

double frame_distance(const DicomItem& data, std::size_t frames) {
  if (frames == 1) return slice_thickness(data);
  const std::vector<double> offsets = data.numbers(tag::kGridFrameOffsets, frames);
  const double step = offsets[1] - offsets[0];
  for (std::size_t f = 1; f < frames; ++f)
    if (!(std::abs(offsets[f] - offsets[f - 1] - step) <= 0.01 * std::abs(step) + 1e-6))
      data.refuse(tag::kGridFrameOffsets, "must be evenly spaced; export the dose on a regular grid");
  return step;
}

}  // namespace

VoxelVolume read_rt_dose(const DicomFile& file) {
  const DicomItem data = file.data();
  if (data.text(tag::kDoseUnits) != "GY")
    data.refuse(tag::kDoseUnits,
                "is \"" + one_short_line(data.text(tag::kDoseUnits)) + "\"; export the dose in GY");
  const double scaling = data.number(tag::kDoseGridScaling);
  if (!(scaling > 0)) data.refuse(tag::kDoseGridScaling, "must be above 0; export it again");
  check_scale(data, tag::kDoseGridScaling, scaling, 0);
  const DicomFile::Pixels pixels = file.pixels();
  const DicomPlane plane = dicom_plane(data);
  VoxelVolume dose;
  dose.frame = data.text(tag::kFrameOfReference);
  dose.grid = grid_of(data, plane, pixels, frame_distance(data, pixels.frames) * plane.normal,
                      pixels.frames > 1 ? tag::kGridFrameOffsets : tag::kSliceThickness);
  dose.values.reserve(pixels.values.size());
  for (const std::int64_t value : pixels.values)
    dose.values.push_back(static_cast<float>(scaling * static_cast<double>(value)));
  return dose;
}

}  // namespace brachy
