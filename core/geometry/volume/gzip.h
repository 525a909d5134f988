#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

struct z_stream_s;

namespace brachy {

/// Decompresses a gzip file or zlib's stream, or a raw deflate stream, piece by piece, so that its reader takes no more
/// memory than its header asks for. Threads: one.
class GzipReader {
 public:
  enum class Format { kGzip, kRawDeflate };
  /// Refers to `data`, which must outlive it. Errors: UserError where zlib cannot start.
  explicit GzipReader(std::string_view data, Format format = Format::kGzip);
  ~GzipReader();
  GzipReader(const GzipReader&) = delete;
  GzipReader& operator=(const GzipReader&) = delete;

  /// Fills `out`; fewer bytes than it has: the data's end. Nothing: they are damaged or cut short. Files may be several
  /// streams, one after another; zeros after the last are padding. Of a raw stream what is behind is ignored.
  std::optional<std::size_t> read(std::span<char> out);

 private:
  std::unique_ptr<z_stream_s> stream_;
  Format format_;
  std::string_view left_;
  bool is_at_end_ = false;
};

/// Whether so many compressed bytes could hold so many: to be asked before memory is taken for them.
bool can_inflate_to(std::size_t compressed_bytes, std::size_t bytes);

}  // namespace brachy
