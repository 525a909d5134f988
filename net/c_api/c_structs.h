#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "net/c_api/brachyd_client.h"
#include "net/client/client.h"

/// The C API's structs from messages, and back.
namespace brachy::net::c_api {

static_assert(kBrachydTokenBytes == kTokenBytes && kBrachydNameBytes == kMaxNameBytes + 1 &&
              kBrachydTextBytes == kMaxTextBytes + 1 && kBrachydAnyNeedle == kAnyNeedle);

/// With a terminating zero; a longer text is cut.
template <std::size_t kBytes>
void copy_text(const std::string& text, char (&out)[kBytes]) {
  const std::size_t length = std::min(text.size(), kBytes - 1);
  std::memcpy(out, text.data(), length);
  std::memset(out + length, 0, kBytes - length);
}

inline void copy(const Vec3& from, double (&to)[3]) {
  std::copy_n(from.data(), 3, to);
}

inline void copy(const RigidTransform& X, double (&to)[12]) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) to[4 * row + column] = X.R(row, column);
    to[4 * row + 3] = X.p[row];
  }
}

BrachydWelcome welcome_of(const WelcomeMessage& message);
BrachydNeedle needle_of(const NeedleRecord& record);
/// All but seed_count.
BrachydFrame frame_of(const FrameMessage& message);
BrachydSeed seed_of(const Seed& seed);
BrachydForce force_of(const ForceMessage& message, std::int64_t received_ns);
BrachydState state_of(const StateMessage& message);
BrachydEvent event_of(const EventMessage& message);
BrachydError error_of(const ErrorMessage& message);
BrachydScanner scanner_of(const ScannerMessage& message);
ScannerMessage scanner_message(const BrachydScanner& scanner);
/// Throws UserError for an option out of its range, and for files of TLS.
ClientOptions client_options(const BrachydOptions& given);

/// Whether a program may wait so long, s.
bool is_wait(double seconds);
/// Rounded up.
std::chrono::milliseconds in_ms(double seconds);

}  // namespace brachy::net::c_api
