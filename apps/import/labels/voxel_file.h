#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "apps/import/labels/image_voxels.h"
#include "core/geometry/label_map/label_map.h"

namespace brachy {

enum class VoxelFormat { kNrrd, kNifti, kMetaImage };

/// By the first bytes, and NIfTI by its name in small letters too; nothing: it is another file.
std::optional<VoxelFormat> voxel_format(std::string_view bytes, std::string_view name);

/// A file of voxels, whose content is read once as labels and, where it is an image, again as that.
struct VoxelFile {
  VoxelFormat format = VoxelFormat::kNrrd;
  std::string path;
  std::string place;  ///< for messages that must not name it: "file 3 of 7"

  const char* label_map() const;  ///< "an NRRD label map"
  /// `bytes`: the file's. Errors: NoLabels where it is an image; else UserError "path: what; fix".
  LabelMap read_labels(std::string_view bytes) const;
  ImageVoxels read_image(std::string_view bytes) const;
};

}  // namespace brachy
