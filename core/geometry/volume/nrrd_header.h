#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/geometry/volume/volume.h"

namespace brachy {

/// How the values of an NRRD are stored.
enum class NrrdType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
enum class NrrdEncoding : std::uint8_t { kRaw, kGzip, kText };

/// What is read is bounded by these.
struct NrrdLimits {
  std::size_t max_values = std::size_t{1} << 27;  ///< 512 MiB in memory
  std::size_t max_bytes = std::size_t{1} << 30;   ///< of the file
};

/// What the header of an NRRD says of one volume of scalars that has its place in the patient.
struct NrrdHeader {
  NrrdType type = NrrdType::kUint8;
  NrrdEncoding encoding = NrrdEncoding::kRaw;
  bool is_big_endian = false;
  VoxelGrid grid;              ///< in RAS, whatever space the file names
  std::size_t line_skip = 0;   ///< lines of the data before it begins
  std::size_t byte_skip = 0;   ///< bytes after those, of what is decompressed
  bool is_at_end = false;      ///< "byte skip: -1": the data are the file's last bytes
  std::size_t data_begin = 0;  ///< byte of the file
};

std::size_t size_of(NrrdType type);  ///< bytes

/// Reads the header at the beginning of `bytes` (Teem's format, NRRD0001 to NRRD0005,
/// https://teem.sourceforge.net/nrrd/format.html). Accepts three-dimensional volumes of integers to 32 bits, float and
/// double with "space directions" in LPS, RAS or LAS and "space origin", of finite, independent steps; keeps nothing of
/// kinds, content, key/value pairs and other fields. `name`: the file's, for messages.
/// Errors: UserError "name: what; fix", one line, also where more than limits.max_values are declared.
/// Threads: any.
NrrdHeader parse_nrrd_header(std::string_view bytes, const std::string& name, const NrrdLimits& limits = {});

}  // namespace brachy
