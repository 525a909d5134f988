#pragma once

#include "net/wire/byte_io.h"

/// The list of optional sections that ends HELLO, WELCOME, TOPOLOGY, FRAME and STATE: count u16, reserved u16, then
/// {id u16, reserved u16, length u32, payload}. Later versions add sections; readers skip those they do not know.
namespace brachy::net {

inline void write_no_sections(ByteWriter& writer) {
  writer.u32(0);
}

inline void write_section_head(ByteWriter& writer, std::uint16_t id, std::size_t length) {
  writer.u16(id);
  writer.u16(0);
  writer.u32(static_cast<std::uint32_t>(length));
}

/// Calls on_section(id, payload) for each section, in order.
template <class OnSection>
void read_sections(ByteReader& reader, OnSection&& on_section) {
  const std::uint16_t count = reader.u16();
  reader.u16();
  for (std::uint16_t i = 0; i < count && reader.ok(); ++i) {
    const std::uint16_t id = reader.u16();
    reader.u16();
    const std::uint32_t length = reader.u32();
    const auto payload = reader.take(length);
    if (reader.ok()) on_section(id, payload);
  }
}

/// Reads the known sections: read(id, section) returns whether it knows the section, and reads all of its payload;
/// others are skipped.
template <class Read>
void read_known_sections(ByteReader& reader, Read&& read) {
  read_sections(reader, [&](std::uint16_t id, std::span<const std::byte> payload) {
    ByteReader section(payload);
    if (!read(id, section)) return;
    if (const std::string_view reason = section.finish(); !reason.empty()) reader.fail(reason);
  });
}

inline void skip_sections(ByteReader& reader) {
  read_sections(reader, [](std::uint16_t, std::span<const std::byte>) {});
}

}  // namespace brachy::net
