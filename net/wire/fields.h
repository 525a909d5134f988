#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "net/wire/codec.h"

/// The fields of a message are listed once, for both directions:
///
///   void fields(auto& archive, MaybeConst<ArmMessage> auto& message) {
///     archive.u16(message.needle);
///     archive.reserved(6);
///   }
///   BRACHY_CODEC(ArmMessage);
///
/// FieldWriter is called with a const message, FieldReader with one to fill in. A list asks `Archive::kReads` only
/// where the two directions differ in more than that.
namespace brachy::net {

/// A number of the wire: an integer or an enumeration. bool has functions of its own.
template <class T>
concept WireInteger = (std::integral<T> || std::is_enum_v<T>)&&!std::same_as<std::remove_const_t<T>, bool>;

/// One entry of an optional list of sections: see FieldWriter::sections().
template <class Fields>
struct Section {
  std::uint16_t id;
  bool is_present;  ///< whether a writer writes it
  Fields fields;    ///< fields(archive): the fields of its payload
};
template <class Fields>
Section(std::uint16_t, bool, Fields) -> Section<Fields>;

/// Appends the fields of a message to its body.
class FieldWriter {
 public:
  static constexpr bool kReads = false;

  explicit FieldWriter(Bytes& out) : out_(out), writer_(out) {}

  void u8(WireInteger auto v) { writer_.u8(static_cast<std::uint8_t>(v)); }
  void u16(WireInteger auto v) { writer_.u16(static_cast<std::uint16_t>(v)); }
  void u32(WireInteger auto v) { writer_.u32(static_cast<std::uint32_t>(v)); }
  void u64(WireInteger auto v) { writer_.u64(static_cast<std::uint64_t>(v)); }
  void f64(double v) { writer_.f64(v); }
  /// Rounded to f32.
  void f32(double v) { writer_.f32(static_cast<float>(v)); }
  void time(std::int64_t ns) { writer_.time(ns); }
  void vec3(const Vec3& v) { writer_.vec3(v); }
  void pose(const RigidTransform& X) { writer_.pose(X); }
  void text(std::string_view s, std::size_t max_bytes) { writer_.text(s, max_bytes); }
  template <std::size_t kSize>
  void bytes(const std::array<std::byte, kSize>& v) {
    out_.insert(out_.end(), v.begin(), v.end());
  }
  void bytes(const std::vector<std::uint8_t>& v, std::uint64_t /*count*/) {
    const auto data = std::as_bytes(std::span(v));
    out_.insert(out_.end(), data.begin(), data.end());
  }
  /// Bytes without a meaning yet: written as 0, read and not looked at.
  void reserved(std::size_t size) { out_.insert(out_.end(), size, std::byte{0}); }

  /// A yes/no field of one byte.
  void u8_bool(bool v, std::string_view /*reason*/) { writer_.u8(v ? 1 : 0); }
  /// Yes/no fields as bits, the first as bit 0. A reader ignores the other bits.
  void u16_bits(std::same_as<bool> auto... flags) { writer_.u16(static_cast<std::uint16_t>(bits(flags...))); }
  void u32_bits(std::same_as<bool> auto... flags) { writer_.u32(bits(flags...)); }

  /// Makes a reader fail with `reason` (a literal) where the condition is false.
  void check(bool /*condition*/, std::string_view /*reason*/) {}

  /// The number of elements of `list`: written, or read and returned. Pass it to items() or floats() next, or once
  /// the fields between them are through.
  template <class List>
  std::uint16_t u16_count(const List& list) {
    writer_.u16(static_cast<std::uint16_t>(list.size()));
    return static_cast<std::uint16_t>(list.size());
  }
  template <class List>
  std::uint32_t u32_count(const List& list) {
    writer_.u32(static_cast<std::uint32_t>(list.size()));
    return static_cast<std::uint32_t>(list.size());
  }
  /// Calls item(element) for each of `count` elements, at least `min_bytes` on the wire each: a reader refuses a count
  /// that the rest of the body cannot hold before it allocates anything.
  template <class List, class Item>
  void items(const List& list, std::uint64_t /*count*/, std::size_t /*min_bytes*/, Item&& item) {
    for (const auto& element : list) item(element);
  }
  /// u16_count, two reserved bytes, items.
  template <class List, class Item>
  void u16_list(const List& list, std::size_t min_bytes, Item&& item) {
    const std::uint16_t count = u16_count(list);
    reserved(2);
    items(list, count, min_bytes, item);
  }
  /// u32_count, items.
  template <class List, class Item>
  void u32_list(const List& list, std::size_t min_bytes, Item&& item) {
    items(list, u32_count(list), min_bytes, item);
  }
  void floats(const std::vector<float>& v, std::uint64_t /*count*/) { writer_.floats(v); }
  void points(const std::vector<std::array<double, 2>>& v, std::uint64_t /*count*/) { writer_.points(v); }

  /// The list of optional sections that ends a body, in the order given: count u16, reserved u16, then {id u16,
  /// reserved u16, length u32, payload}. A reader takes them in any order, skips those that are not listed, which later
  /// versions add, and leaves the fields of those that are missing as they were.
  template <class... Fields>
  void sections(const Section<Fields>&... section) {
    writer_.u16(static_cast<std::uint16_t>((0 + ... + (section.is_present ? 1 : 0))));
    writer_.u16(0);
    (write_section(section), ...);
  }

 private:
  static std::uint32_t bits(std::same_as<bool> auto... flags) {
    std::uint32_t value = 0, bit = 1;
    ((value |= flags ? bit : 0, bit <<= 1), ...);
    return value;
  }

  template <class Fields>
  void write_section(const Section<Fields>& section) {
    if (!section.is_present) return;
    writer_.u16(section.id);
    writer_.u16(0);
    writer_.u32(0);  // the length, which is known below
    const std::size_t start = out_.size();
    section.fields(*this);
    const std::size_t length = out_.size() - start;
    for (std::size_t i = 0; i < 4; ++i)
      out_[start - 4 + i] = static_cast<std::byte>(length >> (8 * i) & 0xFF);
  }

  Bytes& out_;
  ByteWriter writer_;
};

/// Reads the fields of a message from its body. Function by function FieldWriter's counterpart, documented there.
class FieldReader {
 public:
  static constexpr bool kReads = true;

  explicit FieldReader(ByteReader& reader) : reader_(reader) {}

  /// False once something was missing or refused.
  bool ok() const { return reader_.ok(); }

  template <WireInteger T>
  void u8(T& v) {
    v = static_cast<T>(reader_.u8());
  }
  template <WireInteger T>
  void u16(T& v) {
    v = static_cast<T>(reader_.u16());
  }
  template <WireInteger T>
  void u32(T& v) {
    v = static_cast<T>(reader_.u32());
  }
  template <WireInteger T>
  void u64(T& v) {
    v = static_cast<T>(reader_.u64());
  }
  void f64(double& v) { v = reader_.f64(); }
  void f32(double& v) { v = static_cast<double>(reader_.f32()); }
  void time(std::int64_t& ns) { ns = reader_.time(); }
  void vec3(Vec3& v) { v = reader_.vec3(); }
  void pose(RigidTransform& X) { X = reader_.pose(); }
  void text(std::string& s, std::size_t max_bytes) { s = reader_.text(max_bytes); }
  template <std::size_t kSize>
  void bytes(std::array<std::byte, kSize>& v) {
    std::ranges::copy(reader_.take(kSize), v.begin());
  }
  void bytes(std::vector<std::uint8_t>& v, std::uint64_t count) {
    v.clear();
    if (!reader_.fits(count, 1)) return;
    const auto data = reader_.take(count);
    v.resize(data.size());
    std::ranges::transform(data, v.begin(), [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  }
  void reserved(std::size_t size) { reader_.take(size); }

  void u8_bool(bool& v, std::string_view reason) {
    const std::uint8_t value = reader_.u8();
    check(value <= 1, reason);
    v = value == 1;
  }
  void u16_bits(std::same_as<bool> auto&... flags) { bits(reader_.u16(), flags...); }
  void u32_bits(std::same_as<bool> auto&... flags) { bits(reader_.u32(), flags...); }

  void check(bool condition, std::string_view reason) {
    if (!condition) reader_.fail(reason);
  }

  template <class List>
  std::uint16_t u16_count(const List&) {
    return reader_.u16();
  }
  template <class List>
  std::uint32_t u32_count(const List&) {
    return reader_.u32();
  }
  template <class List, class Item>
  void items(List& list, std::uint64_t count, std::size_t min_bytes, Item&& item) {
    list.clear();
    if (reader_.fits(count, min_bytes)) list.resize(count);
    for (auto& element : list) item(element);
  }
  template <class List, class Item>
  void u16_list(List& list, std::size_t min_bytes, Item&& item) {
    const std::uint16_t count = reader_.u16();
    reserved(2);
    items(list, count, min_bytes, item);
  }
  template <class List, class Item>
  void u32_list(List& list, std::size_t min_bytes, Item&& item) {
    const std::uint32_t count = reader_.u32();
    items(list, count, min_bytes, item);
  }
  /// ByteReader::fits(); items(), floats() and points() ask it themselves.
  bool fits(std::uint64_t count, std::size_t min_bytes) { return reader_.fits(count, min_bytes); }
  void floats(std::vector<float>& v, std::uint64_t count) { reader_.floats(count, v); }
  void points(std::vector<std::array<double, 2>>& v, std::uint64_t count) { reader_.points(count, v); }

  template <class... Fields>
  void sections(const Section<Fields>&... section) {
    const std::uint16_t count = reader_.u16();
    reader_.u16();
    for (std::uint16_t i = 0; i < count && reader_.ok(); ++i) {
      [[maybe_unused]] const std::uint16_t id = reader_.u16();
      reader_.u16();
      const std::uint32_t length = reader_.u32();
      ByteReader payload(reader_.take(length));
      FieldReader archive(payload);
      if (!reader_.ok() || !(... || read_section(section, id, archive))) continue;
      if (const std::string_view reason = payload.finish(); !reason.empty()) reader_.fail(reason);
    }
  }

 private:
  static void bits(std::uint32_t value, std::same_as<bool> auto&... flags) {
    ((flags = (value & 1) != 0, value >>= 1), ...);
  }

  template <class Fields>
  static bool read_section(const Section<Fields>& section, std::uint16_t id, FieldReader& archive) {
    if (id != section.id) return false;
    section.fields(archive);
    return true;
  }

  ByteReader& reader_;
};

/// Called before a message is read into `message`: what its optional sections do not bring has its default.
template <class Message>
void reset_message(Message& message) {
  message = Message();
}

/// Called before a message is written.
template <class Message>
void reserve_body(const Message&, Bytes&) {}

template <WireMessage Message>
void encode_body(const Message& message, Bytes& out) {
  reserve_body(message, out);
  FieldWriter archive(out);
  fields(archive, message);
}

template <WireMessage Message>
DecodeResult decode_body(std::span<const std::byte> body, Message& message) {
  ByteReader reader(body);
  FieldReader archive(reader);
  reset_message(message);
  fields(archive, message);
  return DecodeResult::of(reader);
}

inline constexpr std::size_t kTriangleBytes = 12;  ///< three u32

/// The constraint of a message's list of fields: const when written, not when read.
template <class T, class Message>
concept MaybeConst = std::same_as<std::remove_const_t<T>, Message>;

/// Compiles encode_body() and decode_body() of one message; after its list of fields, in one source file.
#define BRACHY_CODEC(Message)                                 \
  template void encode_body<Message>(const Message&, Bytes&); \
  template DecodeResult decode_body<Message>(std::span<const std::byte>, Message&)

}  // namespace brachy::net
