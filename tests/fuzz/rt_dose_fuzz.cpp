// An RTDOSE, an image or a segmentation, from behind "DICM" on, read as each.
#include "apps/import/voxels/image_series.h"
#include "apps/import/voxels/rt_dose.h"
#include "apps/import/voxels/segmentation.h"
#include "tests/fuzz/fuzzed_dicom.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  reads_dicom(data, size, [](const DicomFile& file) {
    reads("file: ", [&] {
      const VoxelVolume dose = read_rt_dose(file);
      EXPECT_EQ(dose.values.size(), dose.grid.count());
    });
    reads("file: ", [&] {
      std::vector<std::string> left;
      const VoxelVolume image = read_image_series({&file}, left);
      EXPECT_EQ(image.values.size(), image.grid.count());
    });
    reads("file: ", [&] {
      const LabelMap map = read_segmentation(file);
      for (const auto& layer : map.layers) EXPECT_EQ(layer.size(), map.grid.count());
      for (const LabelMap::Segment& segment : map.segments) EXPECT_LT(segment.layer, map.layers.size());
    });
  });
  return 0;
}

}  // namespace brachy::fuzz
