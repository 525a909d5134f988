#include "apps/import/labels/inflate.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/base/denied_folder.h"
#include "core/base/error.h"

namespace brachy {
namespace {

struct InflateStream {
  z_stream z{};
  bool is_open = false;
  InflateStream() { is_open = inflateInit2(&z, 15 + 32) == Z_OK; }  // 32: gzip or zlib by the header
  ~InflateStream() {
    if (is_open) inflateEnd(&z);
  }
  InflateStream(const InflateStream&) = delete;
  InflateStream& operator=(const InflateStream&) = delete;
};

}  // namespace

std::string inflated(std::string_view bytes, const std::string& name, std::size_t most_bytes) {
  InflateStream stream;
  if (!stream.is_open) throw UserError(name + ": zlib cannot start; free some memory");
  std::string in(bytes), out, piece(std::size_t{1} << 20, '\0');
  stream.z.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.z.avail_in = static_cast<uInt>(in.size());
  int status = Z_OK;
  while (status != Z_STREAM_END) {
    stream.z.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.z.avail_out = static_cast<uInt>(piece.size());
    status = inflate(&stream.z, Z_NO_FLUSH);
    const std::size_t got = piece.size() - stream.z.avail_out;
    if (status != Z_OK && status != Z_STREAM_END)
      throw UserError(name + ": its compressed data is damaged or cut off; copy the file again");
    if (got == 0 && status != Z_STREAM_END)
      throw UserError(name + ": its compressed data is cut off; copy the file again");
    if (out.size() + got > most_bytes)
      throw UserError(name + ": its data is longer than its header says; write the file again");
    out.append(piece, 0, got);
  }
  return out;
}

std::string file_bytes(const std::string& file, std::size_t most_bytes) {
  refuse_denied_folder(file);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) throw UserError(file + ": no such file");
  const auto size = std::filesystem::file_size(file, ignored);
  if (size > most_bytes)
    throw UserError(file + ": has " + std::to_string(size >> 20) + " MB, too many to read");
  std::ifstream in(file, std::ios::binary);
  std::string bytes(size, '\0');
  if (!in || !in.read(bytes.data(), static_cast<std::streamsize>(size)))
    throw UserError(file + ": cannot be read");
  return bytes;
}

}  // namespace brachy
