#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "net/wire/byte_io.h"

namespace brachy::net::igtl {

/// Appends the number's bytes, most significant first.
template <std::unsigned_integral T>
void put(Bytes& out, T value) {
  for (int shift = 8 * (static_cast<int>(sizeof(T)) - 1); shift >= 0; shift -= 8)
    out.push_back(static_cast<std::byte>(value >> shift));
}
inline void put(Bytes& out, float value) {
  put(out, std::bit_cast<std::uint32_t>(value));
}
/// Appends `text`, cut or filled with zeros to `size` bytes.
inline void put_name(Bytes& out, std::string_view text, std::size_t size) {
  text = text.substr(0, size);
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
  out.resize(out.size() + size - text.size());
}

/// The number at the start of `bytes`. Precondition: they are long enough.
template <std::unsigned_integral T>
T get(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  return static_cast<T>(value);
}
inline float get_float(std::span<const std::byte> bytes) {
  return std::bit_cast<float>(get<std::uint32_t>(bytes));
}
/// Up to the first zero.
inline std::string_view get_name(std::span<const std::byte> bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), std::byte{0});
  // Bytes may be looked at as char: [basic.lval].
  return {static_cast<const char*>(static_cast<const void*>(bytes.data())),
          static_cast<std::size_t>(end - bytes.begin())};
}

}  // namespace brachy::net::igtl
