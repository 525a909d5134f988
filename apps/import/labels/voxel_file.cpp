#include "apps/import/labels/voxel_file.h"

#include "apps/import/labels/label_nifti.h"
#include "apps/import/labels/meta_image.h"
#include "core/geometry/label_map/label_nrrd.h"
#include "core/geometry/volume/nrrd_data.h"

namespace brachy {
namespace {

/// Values of an image: 512 MiB as floats.
constexpr NrrdLimits kImageLimits{std::size_t{1} << 27, kLabelLimits.max_bytes, 1};

NrrdHeader header_of(VoxelFormat format, std::string_view bytes, const std::string& name,
                     const NrrdLimits& limits) {
  return format == VoxelFormat::kNrrd ? parse_nrrd_header(bytes, name, limits)
                                      : parse_meta_header(bytes, name, limits);
}

}  // namespace

std::optional<VoxelFormat> voxel_format(std::string_view bytes, std::string_view name) {
  if (bytes.starts_with("NRRD")) return VoxelFormat::kNrrd;
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) return VoxelFormat::kNifti;
  if (is_meta_image(bytes)) return VoxelFormat::kMetaImage;
  return std::nullopt;
}

const char* VoxelFile::label_map() const {
  return format == VoxelFormat::kNrrd    ? "an NRRD label map"
         : format == VoxelFormat::kNifti ? "a NIfTI label map"
                                         : "a MetaImage label map";
}

LabelMap VoxelFile::read_labels(std::string_view bytes) const {
  if (format == VoxelFormat::kNifti) return parse_label_nifti(bytes, path);
  return read_label_volume(header_of(format, bytes, path, kLabelLimits), bytes, path);
}

ImageVoxels VoxelFile::read_image(std::string_view bytes) const {
  if (format == VoxelFormat::kNifti) return parse_image_nifti(bytes, path, kImageLimits.max_values);
  const NrrdHeader header = header_of(format, bytes, path, kImageLimits);
  return {header.grid, parse_nrrd_data(header, bytes, path)};
}

}  // namespace brachy
