#include "apps/import/dicom/rt_dose.h"

#include <algorithm>
#include <cmath>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/labels/import_limits.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/geometry/volume/place_fault.h"

namespace brachy {
namespace {

/// Columns i, j and the normal, of unit length, and the spacing, of an image plane (PS3.3, C.7.6.2).
struct ImagePlane {
  Vec3 along_row, along_column, normal;
  double column_spacing, row_spacing;  ///< between columns (along i), between rows (along j)
};

ImagePlane plane_of(const DicomItem& data) {
  const std::vector<double> o = data.numbers(tag::kImageOrientation, 6);
  const std::vector<double> spacing = data.numbers(tag::kPixelSpacing, 2);
  ImagePlane plane{ras_of_lps({o[0], o[1], o[2]}), ras_of_lps({o[3], o[4], o[5]}), Vec3::Zero(), spacing[1],
                   spacing[0]};
  if (std::abs(plane.along_row.norm() - 1) > 1e-3 || std::abs(plane.along_column.norm() - 1) > 1e-3 ||
      std::abs(plane.along_row.dot(plane.along_column)) > 1e-3)
    data.refuse(tag::kImageOrientation,
                "must be two directions at right angles, of length 1; export it again");
  plane.normal = plane.along_row.cross(plane.along_column);
  if (!(spacing[0] > 0 && spacing[1] > 0))
    data.refuse(tag::kPixelSpacing, "must be above 0; export it again");
  return plane;
}

VoxelGrid grid_of(const DicomItem& data, const ImagePlane& plane, const DicomFile::Pixels& pixels,
                  double slice_mm) {
  VoxelGrid grid{
      {pixels.columns, pixels.rows, pixels.frames}, data.point(tag::kImagePosition), Mat3::Identity()};
  grid.steps.col(0) = plane.column_spacing * plane.along_row;
  grid.steps.col(1) = plane.row_spacing * plane.along_column;
  grid.steps.col(2) = slice_mm * plane.normal;
  if (const std::string fault = place_fault(grid, kLabelIndependence); !fault.empty())
    data.refuse(tag::kPixelSpacing, fault);
  return grid;
}

double frame_distance(const DicomItem& data, std::size_t frames) {
  if (frames == 1) return data.optional_number(tag::kSliceThickness).value_or(1);
  const std::vector<double> offsets = data.numbers(tag::kGridFrameOffsets, frames);
  const double step = offsets[1] - offsets[0];
  for (std::size_t f = 1; f < frames; ++f)
    if (std::abs(offsets[f] - offsets[f - 1] - step) > 0.01 * std::abs(step) + 1e-6)
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
  const DicomFile::Pixels pixels = file.pixels();
  VoxelVolume dose;
  dose.frame = data.text(tag::kFrameOfReference);
  dose.grid = grid_of(data, plane_of(data), pixels, frame_distance(data, pixels.frames));
  dose.values.reserve(pixels.values.size());
  for (const std::int64_t value : pixels.values)
    dose.values.push_back(static_cast<float>(scaling * static_cast<double>(value)));
  return dose;
}

VoxelVolume read_image_series(const std::vector<const DicomFile*>& files) {
  struct Slice {
    double height;
    const DicomFile* file;
  };
  const DicomItem first = files.front()->data();
  const ImagePlane plane = plane_of(first);
  std::vector<Slice> slices;
  for (const DicomFile* file : files) {
    const DicomItem data = file->data();
    if ((plane_of(data).normal - plane.normal).norm() > 1e-3)
      data.refuse(tag::kImageOrientation,
                  "differs from the series' other images; import one stack of slices");
    slices.push_back({plane.normal.dot(data.point(tag::kImagePosition)), file});
  }
  std::ranges::stable_sort(slices, {}, &Slice::height);
  const double step = slices.size() > 1 ? (slices.back().height - slices.front().height) /
                                              static_cast<double>(slices.size() - 1)
                                        : first.optional_number(tag::kSliceThickness).value_or(1);
  VoxelVolume volume;
  for (std::size_t s = 0; s < slices.size(); ++s) {
    const DicomItem data = slices[s].file->data();
    if (std::abs(slices[s].height - slices[0].height - static_cast<double>(s) * step) > 0.1 * step + 1e-3)
      data.refuse(tag::kImagePosition,
                  "the slices are not " + text_of(step) +
                      " mm apart throughout; one is missing or there twice: export the series again");
    const DicomFile::Pixels pixels = slices[s].file->pixels();
    if (s == 0) {
      volume.grid = grid_of(data, plane, pixels, step);
      volume.grid.size[2] = slices.size();
      if (volume.grid.count() > kMostVoxels)
        data.refuse(tag::kRows, "the series has over 2^29 voxels; crop it");
      volume.frame = data.text(tag::kFrameOfReference);
    }
    if (pixels.frames != 1 || pixels.columns != volume.grid.size[0] || pixels.rows != volume.grid.size[1])
      data.refuse(tag::kRows, "differs from the series' other images; import one stack of slices");
    const double slope = data.optional_number(tag::kRescaleSlope).value_or(1);
    const double intercept = data.optional_number(tag::kRescaleIntercept).value_or(0);
    for (const std::int64_t value : pixels.values)
      volume.values.push_back(static_cast<float>(slope * static_cast<double>(value) + intercept));
  }
  return volume;
}

}  // namespace brachy
