#include <algorithm>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom_out/rt_objects.h"
#include "core/geometry/contours/mesh_contours.h"

namespace brachy {
namespace {

constexpr const char* kRtStructureSetStorage = "1.2.840.10008.5.1.4.1.1.481.3";

void put_contour(DicomWriter roi, const Polygon& polygon, double z) {
  DicomWriter contour = roi.item(tag::kContours);
  contour.put(tag::kContourType, "CLOSED_PLANAR").put_count(tag::kContourPointCount, polygon.size());
  std::string data;
  for (const Vec2& p : polygon)
    data.append(data.empty() ? "" : "\\").append(decimal_string(Vec3(p.x(), p.y(), z)));
  contour.put(tag::kContourData, data);
}

}  // namespace

void write_rt_structure(const std::filesystem::path& file, const ExportIds& ids,
                        const std::vector<Structure>& structures, const std::vector<Rgb>& colours,
                        double slice_mm) {
  DicomObject object(ids, kRtStructureSetStorage, ids.structure_set, "RTSTRUCT");
  DicomWriter data = object.data();
  data.put({0x3006, 0x0002}, "brachyd").put({0x3006, 0x0008}, "").put({0x3006, 0x0009}, "");
  data.item({0x3006, 0x0010}).put(tag::kFrameOfReference, ids.frame);
  for (std::size_t n = 0; n < structures.size(); ++n) {
    const Structure& structure = structures[n];
    const std::string number = std::to_string(n + 1);
    DicomWriter roi = data.item(tag::kStructureSetRois);
    roi.put(tag::kRoiNumber, number)
        .put(tag::kRoiFrame, ids.frame)
        .put(tag::kRoiName, structure.shown_name());
    roi.put({0x3006, 0x0036}, "");  // generation algorithm
    DicomWriter contours = data.item(tag::kRoiContours);
    const auto [red, green, blue] = colours[n];
    contours.put(tag::kRoiColour,
                 std::to_string(red) + "\\" + std::to_string(green) + "\\" + std::to_string(blue));
    contours.put(tag::kReferencedRoi, number);
    double least = 1e300, most = -1e300;
    for (const Vec3& v : structure.mesh.vertices) {
      least = std::min(least, v.z());
      most = std::max(most, v.z());
    }
    for (const double z : contour_heights(least, most, slice_mm))
      for (const Polygon& polygon : with_keyholes(mesh_contours(structure.mesh, z)))
        put_contour(contours, polygon, z);
    DicomWriter observation = data.item({0x3006, 0x0080});
    observation.put({0x3006, 0x0082}, number).put(tag::kReferencedRoi, number);
    observation.put({0x3006, 0x00a4}, n == 0 ? "CTV" : "ORGAN").put({0x3006, 0x00a6}, "");
  }
  object.save(file);
}

}  // namespace brachy
