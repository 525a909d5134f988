#include "apps/import/voxels/dicom_plane.h"

#include <cmath>

#include "apps/import/dicom/dicom_tags.h"
#include "core/geometry/label_map/label_map.h"
#include "core/geometry/volume/place_fault.h"

namespace brachy {
namespace {

constexpr double kFarthestCornerMm = 1e6, kLargestValue = 1e30;

}  // namespace

DicomPlane dicom_plane(const DicomItem& data) {
  return dicom_plane(data, data, data);
}

DicomPlane dicom_plane(const DicomItem& position, const DicomItem& orientation, const DicomItem& measures) {
  const std::vector<double> o = orientation.numbers(tag::kImageOrientation, 6);
  const std::vector<double> spacing = measures.numbers(tag::kPixelSpacing, 2);
  DicomPlane plane{position.point(tag::kImagePosition),
                   ras_of_lps({o[0], o[1], o[2]}),
                   ras_of_lps({o[3], o[4], o[5]}),
                   Vec3::Zero(),
                   spacing[1],
                   spacing[0]};
  if (!(plane.corner.cwiseAbs().maxCoeff() <= kFarthestCornerMm))
    position.refuse(tag::kImagePosition, "lies farther than 1 km away; export it in mm");
  if (!(std::abs(plane.along_row.norm() - 1) <= 1e-3 && std::abs(plane.along_column.norm() - 1) <= 1e-3 &&
        std::abs(plane.along_row.dot(plane.along_column)) <= 1e-3))
    orientation.refuse(tag::kImageOrientation,
                       "must be two directions at right angles, of length 1; export it again");
  plane.normal = plane.along_row.cross(plane.along_column);
  if (!(spacing[0] > 0 && spacing[1] > 0))
    measures.refuse(tag::kPixelSpacing, "must be above 0; export it again");
  return plane;
}

VoxelGrid grid_of(const DicomItem& data, const DicomPlane& plane, const DicomFile::Pixels& pixels,
                  const Vec3& step, const DicomTag& step_tag) {
  VoxelGrid grid{{pixels.columns, pixels.rows, pixels.frames}, plane.corner, Mat3::Identity()};
  grid.steps.col(0) = plane.column_spacing * plane.along_row;
  grid.steps.col(1) = plane.row_spacing * plane.along_column;
  grid.steps.col(2) = plane.normal;
  if (const std::string fault = place_fault(grid, kLabelIndependence); !fault.empty())
    data.refuse(tag::kPixelSpacing, fault);
  grid.steps.col(2) = step;
  if (const std::string fault = place_fault(grid, kLabelIndependence); !fault.empty())
    data.refuse(step_tag, fault);
  return grid;
}

double slice_thickness(const DicomItem& data) {
  const double thickness = data.optional_number(tag::kSliceThickness).value_or(0);
  return thickness > 0 ? thickness : 1;
}

void check_scale(const DicomItem& data, const DicomTag& tag, double slope, double intercept) {
  if (!(std::abs(slope) * std::exp2(32) + std::abs(intercept) <= kLargestValue))
    data.refuse(tag, "makes values beyond 1e30; export it again");
}

}  // namespace brachy
