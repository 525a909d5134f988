#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "core/geometry/volume/volume.h"
#include "core/geometry/volume/voxel_values.h"

namespace brachy {

enum class NrrdEncoding : std::uint8_t { kRaw, kGzip, kText };

/// What is read is bounded by these.
struct NrrdLimits {
  std::size_t max_values = std::size_t{1} << 27;  ///< 512 MiB in memory
  std::size_t max_bytes = std::size_t{1} << 30;   ///< of the file
  std::size_t max_layers = 1;                     ///< over 1: a fourth axis may be a list of layers
};

/// What the header of an NRRD says of scalars that have their place in the patient.
struct NrrdHeader {
  VoxelType type;
  NrrdEncoding encoding = NrrdEncoding::kRaw;
  VoxelGrid grid;                ///< in RAS, whatever space the file names
  std::size_t layers = 1;        ///< volumes on the grid
  bool are_layers_last = false;  ///< volume after volume; else a voxel's values stand together
  std::size_t line_skip = 0;     ///< lines of the data before it begins
  std::size_t byte_skip = 0;     ///< bytes after those, of what is decompressed
  bool is_at_end = false;        ///< "byte skip: -1": the data are the file's last bytes
  std::size_t data_begin = 0;    ///< byte of the file
  std::map<std::string, std::string>
      keys;  ///< of the key/value pairs, "Segment0_Name:=prostate"; the last of a key

  std::size_t count() const { return grid.count() * layers; }      ///< values
  std::size_t data_bytes() const { return count() * type.bytes; }  ///< not those of text
};

/// Reads the header at the beginning of `bytes` (Teem's format, NRRD0001 to NRRD0005,
/// https://teem.sourceforge.net/nrrd/format.html). Accepts three-dimensional volumes of integers to 64 bits, float and
/// double with "space directions" in LPS, RAS or LAS and "space origin", of finite, independent steps; and, where
/// limits.max_layers allows, a list of them along the first or last of four axes, the one whose direction is "none".
/// Keeps nothing of kinds, content and other fields. `name`: the file's, for messages.
/// Errors: UserError "name: what; fix", one line, also where more than limits.max_values are declared.
/// Threads: any.
NrrdHeader parse_nrrd_header(std::string_view bytes, const std::string& name, const NrrdLimits& limits = {});

}  // namespace brachy
