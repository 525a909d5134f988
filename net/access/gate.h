#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/access/token_grants.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// Connections that count towards a Gate's limits. pending_refusals: connections kept open only to send their refusal.
struct ConnectionCounts {
  std::uint32_t slots = 0, pending_refusals = 0;
  std::map<std::string, std::uint32_t> slots_of;  // by address
};

/// Held by a connection for its lifetime: one of the gate's slots, or the reason why it was refused one.
class ConnectionSlot {
 public:
  ConnectionSlot(std::shared_ptr<ConnectionCounts> counts, std::string address,
                 std::optional<ErrorMessage> refusal);
  ~ConnectionSlot();
  ConnectionSlot(const ConnectionSlot&) = delete;
  ConnectionSlot& operator=(const ConnectionSlot&) = delete;

  const std::string& address() const { return address_; }
  bool is_exempt() const { return counts_ == nullptr; }  ///< made by Gate::exempt_slot()
  /// The error to send before closing the connection: BUSY or UNAUTHORISED. nullopt: admitted.
  const std::optional<ErrorMessage>& refusal() const { return refusal_; }

 private:
  const std::shared_ptr<ConnectionCounts> counts_;  // null: not counted
  const std::string address_;
  const std::optional<ErrorMessage> refusal_;
};

/// Access control and connection limits. Every listener of a server asks it for a slot for each connection, before
/// reading a byte. Knows addresses and time, but no socket. Threads: the io thread.
class Gate {
 public:
  /// Connections beyond the limit that are kept open until their refusal is sent; any more are closed at once.
  static constexpr std::uint32_t kMaxPendingRefusals = 64;
  /// An address that sent this many wrong tokens within the window is refused until fewer remain in it.
  static constexpr std::size_t kMaxWrongTokens = 10;
  static constexpr std::chrono::seconds kWrongTokensWindow{60};

  /// At most `max_slots` connections at once, and `max_of_address` of them from one address.
  Gate(std::uint32_t max_slots, std::uint32_t max_of_address, TokenGrants tokens);

  /// For a connection from `address` (without port). Null: close the connection without an answer.
  std::shared_ptr<const ConnectionSlot> acquire_slot(const std::string& address, std::int64_t now_ns);

  /// For the in-process viewer: not counted, and no token required.
  static std::shared_ptr<const ConnectionSlot> exempt_slot();

  /// Why a client at `address` is refused `role`; nullopt: granted.
  std::optional<ErrorMessage> refusal(const std::string& address, const std::optional<Token>& shown,
                                      Role role, std::int64_t now_ns);

  std::uint64_t wrong_tokens() const { return wrong_tokens_; }  ///< since start
  std::uint64_t refused() const { return refused_; }            ///< by acquire_slot(), since start
  std::size_t remembered_addresses() const { return wrong_token_times_.size(); }

 private:
  std::optional<ErrorMessage> refusal_at_entry(const std::string& address, std::int64_t now_ns);
  void record_wrong_token(const std::string& address, std::int64_t now_ns);
  bool is_blocked(const std::string& address, std::int64_t now_ns) const;

  const std::uint32_t max_slots_, max_of_address_;
  const TokenGrants tokens_;
  const std::shared_ptr<ConnectionCounts> counts_ =
      std::make_shared<ConnectionCounts>();  // slots outlive the gate
  std::map<std::string, std::vector<std::int64_t>>
      wrong_token_times_;  // the latest of each address, oldest first
  std::uint64_t wrong_tokens_ = 0, refused_ = 0;
};

}  // namespace brachy::net
