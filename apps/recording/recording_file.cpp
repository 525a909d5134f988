#include "apps/recording/recording_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr std::string_view kMagicOfAnyVersion = kRecordingMagic.substr(0, kRecordingMagic.size() - 1);
constexpr std::size_t kReadPiece = 1 << 20;  // bytes: a false length allocates no more than this

std::uint32_t crc_of(std::span<const std::byte> bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

std::ifstream open(const std::filesystem::path& file) {
  std::error_code error;
  const auto type = std::filesystem::status(file, error).type();
  if (type == std::filesystem::file_type::not_found)
    throw UserError(file.string() + ": no such file; `brachy record --out " + file.string() + "` makes one");
  std::ifstream in(file, std::ios::binary);
  if (type != std::filesystem::file_type::regular || !in)
    throw UserError(file.string() + ": cannot be read; give a recording that `brachy record` made");
  return in;
}

OpenFile create(const std::string& name) {
  OpenFile file(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!file.is_open() && errno == EEXIST)
    throw UserError(name + ": exists already; give another name, nothing is overwritten");
  if (!file.is_open())
    throw UserError(name + ": cannot be created: " + std::strerror(errno) + "; give another directory");
  return file;
}

}  // namespace

bool is_recording_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  std::ifstream in(file, std::ios::binary);
  std::string start(kMagicOfAnyVersion.size(), '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return in && start == kMagicOfAnyVersion;
}

RecordingWriter::RecordingWriter(const std::filesystem::path& file)
    : RecordingWriter(create(file.string()), file.string()) {}

RecordingWriter::RecordingWriter(OpenFile file, std::string name)
    : name_(std::move(name)), file_(std::move(file)) {
  const auto magic = std::as_bytes(std::span(kRecordingMagic));
  if (::write(file_.get(), magic.data(), magic.size()) != static_cast<ssize_t>(magic.size()))
    throw UserError(name_ + ": cannot be written: " + std::strerror(errno) +
                    "; free some space or give another directory");
  bytes_ = magic.size();
}

void RecordingWriter::add(const net::Header& header, std::span<const std::byte> body) {
  buffer_.clear();
  net::encode_header(header, buffer_);
  buffer_.insert(buffer_.end(), body.begin(), body.end());
  net::ByteWriter(buffer_).u32(crc_of(buffer_));
  errno = 0;
  if (::write(file_.get(), buffer_.data(), buffer_.size()) != static_cast<ssize_t>(buffer_.size())) {
    const int reason = errno ? errno : ENOSPC;
    // A reader stops at a truncated message; without it the file is whole.
    const bool is_whole = ::ftruncate(file_.get(), static_cast<off_t>(bytes_)) == 0;
    throw std::runtime_error(name_ + ": cannot be written any more: " + std::strerror(reason) +
                             "; everything recorded before is intact" +
                             (is_whole ? "" : ", its last message is truncated"));
  }
  bytes_ += buffer_.size();
}

RecordingReader::RecordingReader(const std::filesystem::path& file)
    : file_(open(file)), stream_(file_), name_(file.string()) {
  check_magic();
}

RecordingReader::RecordingReader(std::istream& stream, std::string name)
    : stream_(stream), name_(std::move(name)) {
  check_magic();
}

void RecordingReader::check_magic() {
  std::string magic(kRecordingMagic.size(), '\0');
  stream_.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  magic.resize(static_cast<std::size_t>(stream_.gcount()));
  if (magic == kRecordingMagic) {
    offset_ = magic.size();
    return;
  }
  if (magic.size() == kRecordingMagic.size() && magic.starts_with(kMagicOfAnyVersion))
    throw UserError(name_ + ": a recording of another version (" + magic.substr(4) +
                    "); this program reads REC1, use a newer one");
  throw UserError(name_ + ": not a recording: it does not begin with " + std::string(kRecordingMagic) +
                  "; give a file that `brachy record --out FILE.brachy` made");
}

bool RecordingReader::stop(const std::string& what) {
  damage_ = "from byte " + std::to_string(offset_) + " on it is damaged: " + what;
  return false;
}

std::size_t RecordingReader::append(std::size_t count) {
  const std::size_t before = buffer_.size();
  buffer_.resize(before + count);
  stream_.read(reinterpret_cast<char*>(buffer_.data()) + before, static_cast<std::streamsize>(count));
  const auto got = static_cast<std::size_t>(stream_.gcount());
  buffer_.resize(before + got);
  return got;
}

bool RecordingReader::next(Message& message) {
  if (!damage_.empty()) return false;
  buffer_.clear();
  if (append(net::kHeaderSize) == 0) return false;
  const net::DecodeResult result = net::decode_header(buffer_, kMaxBodyBytes, message.header);
  if (result.is_bad()) return stop("no message begins there (" + std::string(result.reason) + ")");
  if (!result.is_good()) return stop("the file ends within a message");
  std::size_t left = message.header.length + sizeof(std::uint32_t);
  while (left > 0) {
    const std::size_t piece = std::min(left, kReadPiece);
    if (append(piece) < piece) return stop("the file ends within a message");
    left -= piece;
  }
  const auto content = std::span<const std::byte>(buffer_).first(buffer_.size() - sizeof(std::uint32_t));
  net::ByteReader crc(std::span<const std::byte>(buffer_).last(sizeof(std::uint32_t)));
  if (crc.u32() != crc_of(content)) return stop("the message there is not the one that was written (CRC)");
  message.body = content.subspan(net::kHeaderSize);
  message.offset = offset_;
  offset_ += buffer_.size();
  return true;
}

}  // namespace brachy
