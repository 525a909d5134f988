#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/geometry/volume/nrrd_header.h"
#include "core/geometry/volume/volume.h"

namespace brachy {

/// A volume and what its file stored it as.
struct NrrdVolume {
  Volume volume;
  VoxelType type;
  bool is_integer() const { return !type.is_real; }
};

/// Reads an attached NRRD of scalars (parse_nrrd_header), with limits.max_layers = 1, of encoding raw, gzip or
/// ascii and either byte order. The values become floats, which must hold them: whole numbers to ±2²⁴ (labels),
/// finite ones. Memory: the values' and 64 KiB; of gzip no more is decompressed than the sizes need, and none where
/// so few bytes cannot hold them.
/// `name`: for messages. Errors: UserError "name: what; fix", one line.
/// Threads: any, independent calls. Not real-time.
NrrdVolume parse_nrrd(std::string_view bytes, const std::string& name, const NrrdLimits& limits = {});

/// parse_nrrd of a file; UserError also where it is missing, no regular file, empty or larger than limits.max_bytes.
NrrdVolume read_nrrd_file(const std::filesystem::path& file, const NrrdLimits& limits = {});

}  // namespace brachy
