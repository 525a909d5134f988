#include "apps/import/voxels/image_series.h"

#include <algorithm>
#include <cmath>

#include "apps/import/dicom/dicom_file.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/labels/import_limits.h"
#include "apps/import/voxels/dicom_plane.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr double kSlackMm = 1e-3;  // positions are decimal strings

struct Slice {
  double height;  ///< along the first image's normal, mm
  DicomPlane plane;
  const DicomFile* file;
};

void check_is_grey(const DicomItem& data) {
  const std::string kind = data.text(tag::kPhotometric);
  if (!kind.empty() && !kind.starts_with("MONOCHROME"))
    data.refuse(tag::kPhotometric, "is " + one_short_line(kind) + "; export grey images, MONOCHROME2");
  if (data.has(tag::kFrames) && data.number(tag::kFrames) != 1)
    data.refuse(tag::kFrames, "is " + one_short_line(data.text(tag::kFrames)) +
                                  "; export a series of images of one frame each");
}

void check_is_of_stack(const DicomItem& data, const DicomPlane& plane, const DicomPlane& first,
                       const std::string& frame) {
  if (!((plane.along_row - first.along_row).norm() <= 1e-3 &&
        (plane.along_column - first.along_column).norm() <= 1e-3))
    data.refuse(tag::kImageOrientation, "differs from the series' other images; import one stack of slices");
  if (!(std::abs(plane.row_spacing / first.row_spacing - 1) <= 1e-3 &&
        std::abs(plane.column_spacing / first.column_spacing - 1) <= 1e-3))
    data.refuse(tag::kPixelSpacing, "differs from the series' other images; import one stack of slices");
  if (data.text(tag::kFrameOfReference) != frame)
    data.refuse(tag::kFrameOfReference, "differs from the series' other images; import one stack of slices");
}

/// The images by their height.
std::vector<Slice> stack_of(const std::vector<const DicomFile*>& files) {
  const DicomItem first = files.front()->data();
  const DicomPlane plane = dicom_plane(first);
  const std::string frame = first.text(tag::kFrameOfReference);
  std::vector<Slice> slices;
  for (const DicomFile* file : files) {
    const DicomItem data = file->data();
    check_is_grey(data);
    const DicomPlane own = dicom_plane(data);
    check_is_of_stack(data, own, plane, frame);
    slices.push_back({plane.normal.dot(own.corner), own, file});
  }
  std::ranges::stable_sort(slices, {}, &Slice::height);
  return slices;
}

void check_gaps(const std::vector<Slice>& slices, double usual, double slack) {
  for (std::size_t s = 1; s < slices.size(); ++s) {
    const double gap = slices[s].height - slices[s - 1].height;
    const DicomItem data = slices[s].file->data();
    if (gap <= kSlackMm)
      data.refuse(tag::kImagePosition,
                  "is in one place with another image of the series; import one image for each slice");
    if (std::abs(gap - usual) > slack)
      data.refuse(tag::kImagePosition, "lies " + text_of(gap) +
                                           " mm from the slice before it, and others are " + text_of(usual) +
                                           " mm apart; one is missing or elsewhere: export the series again");
  }
}

/// From one slice to the next: all of them lie on a line, at equal distances.
Vec3 step_of(const std::vector<Slice>& slices) {
  const Slice& first = slices.front();
  if (slices.size() == 1) return slice_thickness(first.file->data()) * first.plane.normal;
  std::vector<double> gaps;
  for (std::size_t s = 1; s < slices.size(); ++s) gaps.push_back(slices[s].height - slices[s - 1].height);
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::ranges::nth_element(gaps, middle);
  const double slack = 0.1 * *middle + kSlackMm;
  check_gaps(slices, *middle, slack);
  const Vec3 step = (slices.back().plane.corner - first.plane.corner) / static_cast<double>(gaps.size());
  for (std::size_t s = 1; s < slices.size(); ++s) {
    const double off = (slices[s].plane.corner - first.plane.corner - static_cast<double>(s) * step).norm();
    if (off > slack)
      slices[s].file->data().refuse(
          tag::kImagePosition,
          "lies " + text_of(off) + " mm beside the line of the other slices; import one stack of slices");
  }
  return step;
}

}  // namespace

VoxelVolume read_image_series(const std::vector<const DicomFile*>& files) {
  const std::vector<Slice> slices = stack_of(files);
  const Vec3 step = step_of(slices);
  VoxelVolume volume;
  for (const Slice& slice : slices) {
    const DicomItem data = slice.file->data();
    const double slope = data.optional_number(tag::kRescaleSlope).value_or(1);
    const double intercept = data.optional_number(tag::kRescaleIntercept).value_or(0);
    check_scale(data, tag::kRescaleSlope, slope, intercept);
    const DicomFile::Pixels pixels = slice.file->pixels();
    if (volume.values.empty()) {
      volume.grid = grid_of(data, slice.plane, pixels, step,
                            slices.size() > 1 ? tag::kImagePosition : tag::kSliceThickness);
      volume.grid.size[2] = slices.size();
      if (volume.grid.count() > kMostVoxels)
        data.refuse(tag::kRows, "the series has over 2^29 voxels; crop it");
      volume.frame = data.text(tag::kFrameOfReference);
      volume.values.reserve(volume.grid.count());
    }
    if (pixels.columns != volume.grid.size[0] || pixels.rows != volume.grid.size[1])
      data.refuse(tag::kRows, "differs from the series' other images; import one stack of slices");
    for (const std::int64_t value : pixels.values)
      volume.values.push_back(static_cast<float>(slope * static_cast<double>(value) + intercept));
  }
  return volume;
}

}  // namespace brachy
