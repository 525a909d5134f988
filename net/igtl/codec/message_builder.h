#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/crc64.h"
#include "net/igtl/codec/messages.h"

namespace brachy::net::igtl {

/// A message whose content is appended to bytes() between construction and finish().
class MessageBuilder {
 public:
  static constexpr std::size_t kCrcOffset = 50, kSizeOffset = 42;  ///< in the header
  using Metadata = std::pair<std::string_view, std::string_view>;  ///< key and value

  MessageBuilder(std::string_view type, const Label& label, std::size_t content_bytes)
      : version_(label.version) {
    bytes_.reserve(kHeaderSize + kExtendedHeaderSize + content_bytes + kCountBytes);
    put(bytes_, label.version);
    put_name(bytes_, type, kTypeBytes);
    put_name(bytes_, label.device, kNameBytes);
    put(bytes_, label.timestamp);
    bytes_.resize(kHeaderSize);  // size and CRC: finish()
    if (version_ >= 2) bytes_.resize(kHeaderSize + kExtendedHeaderSize);
  }

  Bytes& bytes() { return bytes_; }

  /// `metadata` goes into header version 2 only.
  Bytes finish(std::span<const Metadata> metadata = {}) {
    if (version_ >= 2) put_metadata(metadata);
    const auto body = std::span<const std::byte>(bytes_).subspan(kHeaderSize);
    patch(kSizeOffset, body.size(), 8);
    patch(kCrcOffset, crc64(body), 8);
    return std::move(bytes_);
  }

 private:
  static constexpr std::size_t kCountBytes = 2, kEntryBytes = 8;
  static constexpr std::uint16_t kAscii = 3;  // IANA's MIBenum

  /// The extended header is written here, when the metadata's size is known; the message's id stays 0.
  void put_metadata(std::span<const Metadata> metadata) {
    std::size_t size = 0;
    put(bytes_, static_cast<std::uint16_t>(metadata.size()));
    for (const auto& [key, value] : metadata) {
      put(bytes_, static_cast<std::uint16_t>(key.size()));
      put(bytes_, kAscii);
      put(bytes_, static_cast<std::uint32_t>(value.size()));
      size += key.size() + value.size();
    }
    for (const auto& [key, value] : metadata) {
      put_name(bytes_, key, key.size());
      put_name(bytes_, value, value.size());
    }
    patch(kHeaderSize, kExtendedHeaderSize, 2);
    patch(kHeaderSize + 2, kCountBytes + kEntryBytes * metadata.size(), 2);
    patch(kHeaderSize + 4, size, 4);
  }

  void patch(std::size_t offset, std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i)
      bytes_[offset + i] = static_cast<std::byte>(value >> (8 * (bytes - 1 - i)));
  }

  std::uint16_t version_;
  Bytes bytes_;
};

}  // namespace brachy::net::igtl
