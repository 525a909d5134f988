#include "apps/import/voxels/rt_dose.h"

#include <cmath>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/voxels/dicom_plane.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

/// From one frame to the next, mm, RAS. The offsets run along the normal from the first frame, at 0, or are the
/// frames' coordinates along the patient's axis that the normal lies on (PS3.3, C.8.8.3.2, which has that for z): then
/// the first one is the first frame's coordinate, and the step does not turn with the normal.
Vec3 frame_step(const DicomItem& data, const DicomPlane& plane, std::size_t frames) {
  if (frames == 1) return slice_thickness(data) * plane.normal;
  const std::vector<double> offsets = data.numbers(tag::kGridFrameOffsets, frames);
  const double step = offsets[1] - offsets[0];
  for (std::size_t f = 1; f < frames; ++f)
    if (!(std::abs(offsets[f] - offsets[f - 1] - step) <= 0.01 * std::abs(step) + 1e-6))
      data.refuse(tag::kGridFrameOffsets, "must be evenly spaced; export the dose on a regular grid");
  const double even = (offsets.back() - offsets.front()) / static_cast<double>(frames - 1);
  if (offsets.front() == 0) return even * plane.normal;
  Eigen::Index axis = 0;
  const double along = ras_of_lps(plane.normal).cwiseAbs().maxCoeff(&axis);
  const double coordinate = ras_of_lps(plane.corner)[axis];
  constexpr double kOfRounding = 0.01, kAlongAxis = 0.9999;
  if (along < kAlongAxis || std::abs(offsets.front() - coordinate) > kOfRounding)
    data.refuse(
        tag::kGridFrameOffsets,
        "begins with " + text_of(offsets.front()) +
            ", which is neither 0 nor the first frame's coordinate along its normal; export it again");
  return ras_of_lps(even * Vec3::Unit(axis));
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
  dose.grid = grid_of(data, plane, pixels, frame_step(data, plane, pixels.frames),
                      pixels.frames > 1 ? tag::kGridFrameOffsets : tag::kSliceThickness);
  dose.values.reserve(pixels.values.size());
  for (const std::int64_t value : pixels.values)
    dose.values.push_back(static_cast<float>(scaling * static_cast<double>(value)));
  return dose;
}

}  // namespace brachy
