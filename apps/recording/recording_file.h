#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <span>
#include <string>
#include <string_view>

#include "apps/forces/open_file.h"
#include "net/wire/codec.h"

namespace brachy {

/// A recording: what a server sent, message after message, each with a CRC-32 ("Recording file" in net/PROTOCOL.md).

/// The first bytes of a recording file.
inline constexpr std::string_view kRecordingMagic = "BRCYREC1";

/// Extension by which `brachy record --out` distinguishes a file from a directory.
inline constexpr std::string_view kRecordingExtension = ".brachy";

/// A message on disk without its body: header and CRC.
inline constexpr std::size_t kRecordedOverhead = net::kHeaderSize + sizeof(std::uint32_t);

/// Whether the file begins with the magic of a recording, of any version. False also where it cannot be read.
bool is_recording_file(const std::filesystem::path& file);

/// Writes a recording. Each message is one write(2) and nothing is buffered in this process: after kill −9 the file has
/// every message for which add() has returned.
/// Threads: one.
class RecordingWriter {
 public:
  /// Creates the file. Throws UserError where it exists already or cannot be created.
  explicit RecordingWriter(const std::filesystem::path& file);
  /// Into a file that was created; `name`: for messages. Throws UserError where it cannot be written.
  RecordingWriter(OpenFile file, std::string name);
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  /// Throws std::runtime_error, naming the file and the reason, where that cannot be done (full disk): the file then
  /// ends with the message before.
  void add(const net::Header& header, std::span<const std::byte> body);

  std::uint64_t bytes() const { return bytes_; }  ///< of whole messages, the magic included

 private:
  std::string name_;
  OpenFile file_;
  std::uint64_t bytes_ = 0;
  net::Bytes buffer_;
};

/// Reads a recording from front to back. Memory: the largest message, and never more than the file's size.
/// Threads: one.
class RecordingReader {
 public:
  struct Message {
    net::Header header;
    std::span<const std::byte> body;  ///< valid until the next call of next()
    std::uint64_t offset = 0;         ///< of its first byte in the file
  };

  static constexpr std::uint32_t kMaxBodyBytes = 256u << 20;

  /// Throws UserError where it cannot be read or is not a recording.
  explicit RecordingReader(const std::filesystem::path& file);
  /// `stream` outlives the reader; `name` is used in error messages.
  RecordingReader(std::istream& stream, std::string name);

  /// The next message, of any type; false at the end, or where damage() begins.
  bool next(Message& message);

  /// Where and how the recording is damaged: it ends within a message, or a message differs from what was written.
  /// Empty: it is not.
  const std::string& damage() const { return damage_; }
  std::uint64_t offset() const { return offset_; }  ///< end of the part that has been read and is valid
  const std::string& name() const { return name_; }

 private:
  void check_magic();
  bool stop(const std::string& what);
  std::size_t append(std::size_t count);  // from the stream to buffer_

  std::ifstream file_;
  std::istream& stream_;
  std::string name_;
  std::uint64_t offset_ = 0;
  std::string damage_;
  net::Bytes buffer_;
};

}  // namespace brachy
