#pragma once

namespace brachy::net {

/// What a connection with TLS begins with: a handshake record. No message of the native protocol begins so, no HTTP request.
constexpr unsigned char kFirstByteOfTls = 0x16;

}  // namespace brachy::net
