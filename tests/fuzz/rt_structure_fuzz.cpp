// An RTSTRUCT, from behind "DICM" on. Contours of few points become surfaces.
#include "apps/import/dicom/rt_structure.h"
#include "core/geometry/contours/contour_surface.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/fuzz/fuzzed_dicom.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  reads_dicom(data, size, [](const DicomFile& file) {
    const RtStructureSet set = read_rt_structure(file);
    EXPECT_FALSE(set.rois.empty());
    for (const RtRoi& roi : set.rois) {
      if (roi.contours.empty()) continue;
      reads("place: ", [&] {
        const ContourStack stack = stack_contours(roi.contours, "place");
        // Of the limit in use only the time is different.
        EXPECT_TRUE(test::is_closed_manifold(contour_surface(stack, "place").mesh));
      });
    }
  });
  return 0;
}

}  // namespace brachy::fuzz
