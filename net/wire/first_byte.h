#pragma once

namespace brachy::net {

/// The first byte of a TLS connection: a handshake record. No message of the native protocol and no HTTP request begins
/// with it.
constexpr unsigned char kFirstByteOfTls = 0x16;

}  // namespace brachy::net
