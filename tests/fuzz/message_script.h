#pragma once

#include "net/wire/codec.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

/// Flaws of a message's header; bits.
enum MessageFlaw : std::uint8_t { kWrongSequence = 1, kWrongLength = 2, kWrongVersion = 4 };

/// The next message of a script: its type (u8), flaws (u8) and body (a piece), with a matching header, so that the
/// fuzzer's changes reach the decoders.
net::Bytes next_message(Script& script, std::uint64_t sequence);

/// The messages of a script as a server's, numbered: a TOPOLOGY has the hash of what it holds, a FRAME that of the last
/// TOPOLOGY.
class ServerScript {
 public:
  explicit ServerScript(Script& script) : script_(script) {}
  net::Bytes next();

 private:
  Script& script_;
  std::uint64_t sequence_ = 0, hash_ = 0;
};

}  // namespace brachy::fuzz
