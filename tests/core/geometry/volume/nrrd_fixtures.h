#pragma once

#include <zlib.h>

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace brachy::test {

/// A header of a small volume, to be changed field by field.
struct NrrdText {
  std::string type = "uint8", sizes = "2 3 4", encoding = "raw", space = "right-anterior-superior",
              directions = "(1,0,0) (0,2,0) (0,0,3)", origin = "(10,20,30)", more;
  std::string dimension = "3";

  std::string header() const {
    const auto field = [](const char* name, const std::string& value) {
      return value.empty() ? std::string() : std::string(name) + ": " + value + "\n";
    };
    return "NRRD0005\n# by a test\n" + field("type", type) + field("dimension", dimension) +
           field("space", space) + field("sizes", sizes) + field("space directions", directions) +
           field("space origin", origin) + "kinds: domain domain domain\n" + field("encoding", encoding) +
           more + "\n";
  }
};

/// Words of `size` bytes of the values' low bits.
template <class Word>
std::string words(const std::vector<Word>& values, bool is_big_endian) {
  std::string bytes;
  for (const Word value : values)
    for (std::size_t k = 0; k < sizeof(Word); ++k) {
      const std::size_t byte = is_big_endian ? sizeof(Word) - 1 - k : k;
      bytes += static_cast<char>(value >> (8 * byte) & 0xFFU);
    }
  return bytes;
}

/// A gzip member.
inline std::string gzipped(const std::string& bytes, int level = 6) {
  z_stream stream{};
  deflateInit2(&stream, level, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string in = bytes, out(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.erase(stream.total_out);
  deflateEnd(&stream);
  return out;
}

}  // namespace brachy::test
