#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/rigid_transform.h"
#include "net/wire/text.h"

namespace brachy::net {

using Bytes = std::vector<std::byte>;

/// Appends little-endian fields to a byte vector. Fields are shifted into place; only float arrays are copied
/// whole, which is right on little-endian machines alone.
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& out) : out_(out) {}

  void u8(std::uint8_t v) { put(v); }
  void u16(std::uint16_t v) { put(v); }
  void u32(std::uint32_t v) { put(v); }
  void u64(std::uint64_t v) { put(v); }
  void f32(float v) { put(std::bit_cast<std::uint32_t>(v)); }
  void f64(double v) { put(std::bit_cast<std::uint64_t>(v)); }
  /// A monotonic clock reading, ns; a negative one cannot be sent and becomes 0.
  void time(std::int64_t ns) { put(static_cast<std::uint64_t>(ns < 0 ? 0 : ns)); }

  /// u16 length and UTF-8; made valid and cut to `max_bytes` where it is not.
  void text(std::string_view s, std::size_t max_bytes) {
    const std::string clean = to_wire_text(s, max_bytes);
    u16(static_cast<std::uint16_t>(clean.size()));
    raw(clean.data(), clean.size());
  }

  void vec3(const Vec3& v) {
    for (int axis = 0; axis < 3; ++axis) f64(v(axis));
  }

  /// 3×4 row-major [R | p], 12 f64, mm.
  void pose(const RigidTransform& X) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) f64(X.R(row, column));
      f64(X.p(row));
    }
  }

  void floats(std::span<const float> v) {
    static_assert(std::endian::native == std::endian::little && sizeof(float) == 4);
    raw(v.data(), v.size_bytes());
  }
  /// Pairs of f64.
  void points(std::span<const std::array<double, 2>> v) {
    static_assert(std::endian::native == std::endian::little && sizeof(std::array<double, 2>) == 16);
    raw(v.data(), v.size_bytes());
  }

 private:
  template <std::unsigned_integral T>
  void put(T v) {
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      out_.push_back(static_cast<std::byte>((static_cast<std::uint64_t>(v) >> (8 * i)) & 0xFF));
    }
  }
  void raw(const void* data, std::size_t size) {
    if (size == 0) return;
    const std::size_t at = out_.size();
    out_.resize(at + size);
    std::memcpy(out_.data() + at, data, size);
  }

  Bytes& out_;
};

/// Reads little-endian fields from untrusted input. The first field that does not fit makes the reader fail
/// permanently: later reads return zeros, and finish() returns the reason. Never reads outside the span.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  bool ok() const { return reason_.empty(); }
  std::size_t left() const { return bytes_.size(); }
  /// Marks the input as bad; the first reason stays. `reason` must be a literal.
  void fail(std::string_view reason) {
    if (ok()) reason_ = reason;
    bytes_ = {};
  }
  /// "" where every byte was read and none was missing, else the reason.
  std::string_view finish() {
    if (ok() && left() > 0) fail("bytes are left over at the end of the body");
    return reason_;
  }

  std::uint8_t u8() { return get<std::uint8_t>(); }
  std::uint16_t u16() { return get<std::uint16_t>(); }
  std::uint32_t u32() { return get<std::uint32_t>(); }
  std::uint64_t u64() { return get<std::uint64_t>(); }
  float f32() { return std::bit_cast<float>(get<std::uint32_t>()); }
  double f64() { return std::bit_cast<double>(get<std::uint64_t>()); }
  std::int64_t time() {
    const std::uint64_t v = u64();
    if (v > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
      fail("a stamp is over 2^63-1 ns");
    return ok() ? static_cast<std::int64_t>(v) : 0;
  }

  std::string text(std::size_t max_bytes) {
    const std::uint16_t size = u16();
    if (size > max_bytes) fail("a text is longer than its limit");
    const auto data = take(size);
    std::string s(data.size(), '\0');
    if (!data.empty()) std::memcpy(s.data(), data.data(), data.size());
    if (!is_wire_text(s)) {
      fail("a text is not UTF-8 without control characters");
      s.clear();
    }
    return s;
  }

  Vec3 vec3() {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) v(axis) = f64();
    return v;
  }

  RigidTransform pose() {
    RigidTransform X;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) X.R(row, column) = f64();
      X.p(row) = f64();
    }
    return X;
  }

  /// True where `count` items of at least `item_bytes` each can still follow; else fails. Call it before
  /// allocating anything of that size.
  bool fits(std::uint64_t count, std::size_t item_bytes) {
    if (count > left() / item_bytes) fail("a count is larger than the body");
    return ok();
  }

  void floats(std::size_t count, std::vector<float>& out) { plain(count, out); }
  void points(std::size_t count, std::vector<std::array<double, 2>>& out) { plain(count, out); }

  std::span<const std::byte> take(std::size_t size) {
    if (size > left()) {
      fail("the body ends too early");
      return {};
    }
    const auto head = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return head;
  }

 private:
  /// Values whose bytes in memory are those of the wire.
  template <class T>
  void plain(std::size_t count, std::vector<T>& out) {
    out.clear();
    if (!fits(count, sizeof(T))) return;
    const auto data = take(count * sizeof(T));
    out.resize(count);
    if (count > 0) std::memcpy(out.data(), data.data(), data.size());
  }

  template <std::unsigned_integral T>
  T get() {
    const auto data = take(sizeof(T));
    std::uint64_t v = 0;
    for (std::size_t i = 0; i < data.size(); ++i) v |= std::to_integer<std::uint64_t>(data[i]) << (8 * i);
    return static_cast<T>(v);
  }

  std::span<const std::byte> bytes_;
  std::string_view reason_;
};

}  // namespace brachy::net
