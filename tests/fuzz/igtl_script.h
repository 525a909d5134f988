#pragma once

#include "net/wire/byte_io.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

/// The next OpenIGTLink message of a script: type (u8, one of the known types or else 12 bytes), device name (u8,
/// likewise, or 20 bytes), header version, flags and body (a piece), with the correct size and CRC. Flag 1: the CRC is
/// wrong; 2: the size is wrong; 4: the body alone, no header.
net::Bytes next_igtl_message(Script& script);

enum IgtlFlaw : std::uint8_t { kWrongCrc = 1, kWrongSize = 2, kNoHeader = 4 };

}  // namespace brachy::fuzz
