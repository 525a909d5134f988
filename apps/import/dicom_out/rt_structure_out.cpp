#include <algorithm>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom_out/rt_objects.h"
#include "core/geometry/contours/mesh_contours.h"

namespace brachy {
namespace {

constexpr const char* kRtStructureSetStorage = "1.2.840.10008.5.1.4.1.1.481.3";

void put_contour(DicomWriter roi, const char* type, const std::vector<Vec3>& points) {
  DicomWriter contour = roi.item(tag::kContours);
  contour.put(tag::kContourType, type).put_count(tag::kContourPointCount, points.size());
  std::string data;
  for (const Vec3& p : points) data.append(data.empty() ? "" : "\\").append(decimal_string(p));
  contour.put(tag::kContourData, data);
}

std::vector<Vec3> in_plane(const Polygon& polygon, double z) {
  std::vector<Vec3> points;
  for (const Vec2& p : polygon) points.emplace_back(p.x(), p.y(), z);
  return points;
}

/// The items of a structure; returns that of its contours.
DicomWriter put_roi(DicomWriter data, const ExportIds& ids, std::size_t number, const std::string& name,
                    const Rgb& colour, const char* type) {
  const std::string text = std::to_string(number);
  DicomWriter roi = data.item(tag::kStructureSetRois);
  roi.put(tag::kRoiNumber, text).put(tag::kRoiFrame, ids.frame).put(tag::kRoiName, name);
  roi.put({0x3006, 0x0036}, "");  // generation algorithm
  DicomWriter observation = data.item({0x3006, 0x0080});
  observation.put({0x3006, 0x0082}, text).put(tag::kReferencedRoi, text);
  observation.put({0x3006, 0x00a4}, type).put({0x3006, 0x00a6}, "");
  DicomWriter contours = data.item(tag::kRoiContours);
  const auto [red, green, blue] = colour;
  contours.put(tag::kRoiColour,
               std::to_string(red) + "\\" + std::to_string(green) + "\\" + std::to_string(blue));
  contours.put(tag::kReferencedRoi, text);
  return contours;
}

}  // namespace

void write_rt_structure(const std::filesystem::path& file, const ExportIds& ids,
                        const std::vector<Structure>& structures, const std::vector<Rgb>& colours,
                        double slice_mm, const HdrPlan* catheters) {
  DicomObject object(ids, kRtStructureSetStorage, ids.structure_set, "RTSTRUCT");
  DicomWriter data = object.data();
  data.put({0x3006, 0x0002}, "brachyd").put({0x3006, 0x0008}, "").put({0x3006, 0x0009}, "");
  data.item({0x3006, 0x0010}).put(tag::kFrameOfReference, ids.frame);
  for (std::size_t n = 0; n < structures.size(); ++n) {
    const Structure& structure = structures[n];
    const DicomWriter contours =
        put_roi(data, ids, n + 1, structure.shown_name(), colours[n], n == 0 ? "CTV" : "ORGAN");
    double least = 1e300, most = -1e300;
    for (const Vec3& v : structure.mesh.vertices) {
      least = std::min(least, v.z());
      most = std::max(most, v.z());
    }
    for (const double z : contour_heights(least, most, slice_mm))
      for (const Polygon& polygon : with_keyholes(mesh_contours(structure.mesh, z)))
        put_contour(contours, "CLOSED_PLANAR", in_plane(polygon, z));
  }
  constexpr Rgb kCatheters{230, 159, 0};
  for (std::size_t c = 0; catheters && c < catheters->catheters.size(); ++c)
    if (const PlanCatheter& catheter = catheters->catheters[c]; catheter.has_course())
      put_contour(
          put_roi(data, ids, catheter_roi(structures.size(), c), catheter.name, kCatheters, "BRACHY_CHANNEL"),
          "OPEN_NONPLANAR", catheter.course);
  object.save(file);
}

}  // namespace brachy
