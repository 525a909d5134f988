#include <algorithm>
#include <cmath>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom_out/rt_objects.h"

namespace brachy {

void write_rt_dose(const std::filesystem::path& file, const ExportIds& ids, const DoseGrid& grid,
                   bool has_plan, int bits) {
  DicomObject object(ids, "1.2.840.10008.5.1.4.1.1.481.2", ids.dose, "RTDOSE");
  DicomWriter data = object.data();
  const auto [nx, ny, nz] = grid.size();
  // Rows and columns run along LPS, against x and y of the grid: the first voxel is that with the largest x and y.
  const Vec3 first = grid.position(nx - 1, ny - 1, 0);
  data.put({0x0020, 0x0013}, "1");
  data.put(tag::kImagePosition, decimal_string(first)).put(tag::kImageOrientation, "1\\0\\0\\0\\1\\0");
  data.put(tag::kPixelSpacing, decimal_string(grid.spacing_mm()) + "\\" + decimal_string(grid.spacing_mm()));
  data.put(tag::kSliceThickness, grid.spacing_mm());
  data.put_word(tag::kSamples, 1).put({0x0028, 0x0004}, "MONOCHROME2").put_count(tag::kFrames, nz);
  data.put_tag({0x0028, 0x0009}, tag::kGridFrameOffsets);
  data.put_word(tag::kRows, static_cast<unsigned short>(ny))
      .put_word(tag::kColumns, static_cast<unsigned short>(nx));
  const auto word = static_cast<unsigned short>(bits);
  data.put_word(tag::kBitsAllocated, word).put_word(tag::kBitsStored, word);
  data.put_word(tag::kHighBit, static_cast<unsigned short>(bits - 1));
  data.put_word(tag::kPixelRepresentation, 0);
  data.put(tag::kDoseUnits, "GY").put(tag::kDoseType, "PHYSICAL").put({0x3004, 0x000a}, "PLAN");
  std::string offsets;
  for (std::size_t k = 0; k < nz; ++k)
    offsets.append(k == 0 ? "" : "\\").append(decimal_string(static_cast<double>(k) * grid.spacing_mm()));
  data.put(tag::kGridFrameOffsets, offsets);
  if (has_plan)
    data.item({0x300c, 0x0002})
        .put({0x0008, 0x1150}, "1.2.840.10008.5.1.4.1.1.481.5")
        .put({0x0008, 0x1155}, ids.plan);
  const std::vector<float>& dose = grid.dose_gy();
  const double most = std::max(1e-6, static_cast<double>(*std::ranges::max_element(dose)));
  const double largest = bits == 16 ? 65535 : 4294967295.0;
  // The scaling as the file has it, so that the voxels are scaled by the same number that readers use.
  const std::string scaling = decimal_string(most / (0.9999999 * largest));
  data.put(tag::kDoseGridScaling, scaling);
  const double unit = std::stod(scaling);
  std::vector<std::uint32_t> values;
  values.reserve(dose.size());
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = ny; j-- > 0;)
      for (std::size_t i = nx; i-- > 0;)
        values.push_back(static_cast<std::uint32_t>(
            std::min(largest, std::round(double{dose[grid.index(i, j, k)]} / unit))));
  data.put_pixels(values, bits);
  object.save(file);
}

}  // namespace brachy
