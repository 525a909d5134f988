#pragma once

#include "apps/import/dicom/dicom_file.h"
#include "core/geometry/volume/voxel_grid.h"

namespace brachy {

/// Where the pixels of an image lie: Image Plane Module, PS3.3, C.7.6.2; RAS, mm.
struct DicomPlane {
  Vec3 corner;                           ///< middle of the first pixel
  Vec3 along_row, along_column, normal;  ///< of length 1, at right angles
  double column_spacing, row_spacing;    ///< between columns (along a row), between rows
};

/// Errors: UserError "FILE: tag: what; fix" where a tag is missing, directions are not at right angles, or a length is
/// not one of a patient.
DicomPlane dicom_plane(const DicomItem& data);

/// Of a frame, whose position, orientation and spacing may be in items of their own.
DicomPlane dicom_plane(const DicomItem& position, const DicomItem& orientation, const DicomItem& measures);

/// The grid of `pixels`, whose frames follow each other by `step` (mm, RAS; `step_tag`: where it comes from). Errors:
/// UserError where it is no step between slices.
VoxelGrid grid_of(const DicomItem& data, const DicomPlane& plane, const DicomFile::Pixels& pixels,
                  const Vec3& step, const DicomTag& step_tag);

/// Slice Thickness where it says something, else 1 mm: for a single slice.
double slice_thickness(const DicomItem& data);

/// What stored values of at most 32 bits become is finite in 32 bits too. Errors: UserError that names `tag`.
void check_scale(const DicomItem& data, const DicomTag& tag, double slope, double intercept);

}  // namespace brachy
