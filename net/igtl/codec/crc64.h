#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace brachy::net::igtl {

/// CRC-64 of ECMA-182 (polynomial 42F0E1EBA9EA3693, most significant bit first, start 0, no final xor): of "123456789"
/// 6C40DF5F0B497347. OpenIGTLink's headers hold it of their bodies. `crc` is the result for the preceding bytes.
std::uint64_t crc64(std::span<const std::byte> bytes, std::uint64_t crc = 0);

}  // namespace brachy::net::igtl
