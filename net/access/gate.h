#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/access/token_grants.h"
#include "net/wire/messages.h"

namespace brachy::net {

class ConnectionSlot;

/// Connections that count towards a Gate's limits. pending_refusals: connections kept open only to send their refusal.
struct ConnectionCounts {
  std::uint32_t clients = 0, immediate = 0, pending_refusals = 0;
  std::map<std::string, std::uint32_t> clients_of;  // by origin
  std::vector<ConnectionSlot*> waiting;             // that have not said HELLO, oldest first
};

/// What counts as one address: all of the loopback (127/8, ::1), and an IPv6 network of 64 bits. Anything else is
/// itself.
std::string origin_of(const std::string& address);

/// Held by a connection for its lifetime: among those that have not said HELLO, then one of the clients' slots; or the
/// reason why it was refused.
class ConnectionSlot {
 public:
  enum class Stage { kExempt, kWaiting, kClient, kImmediateClient, kRefused, kShed };

  ConnectionSlot(std::shared_ptr<ConnectionCounts> counts, std::string address, Stage stage,
                 std::optional<ErrorMessage> refusal);
  ~ConnectionSlot();
  ConnectionSlot(const ConnectionSlot&) = delete;
  ConnectionSlot& operator=(const ConnectionSlot&) = delete;

  const std::string& address() const { return address_; }
  const std::string& origin() const { return origin_; }          ///< origin_of(address())
  bool is_exempt() const { return stage_ == Stage::kExempt; }    ///< made by Gate::exempt_slot()
  bool is_waiting() const { return stage_ == Stage::kWaiting; }  ///< it has not said HELLO
  /// The error to send before closing the connection: BUSY. nullopt: not refused.
  const std::optional<ErrorMessage>& refusal() const { return refusal_; }

  /// `close` ends the connection when the gate needs its place for a newer one, which it may only while it waits.
  /// Whoever takes over the connection sets it again.
  void on_shed(std::function<void()> close) { close_ = std::move(close); }

 private:
  friend class Gate;
  void enter(Stage stage);
  void leave();

  const std::shared_ptr<ConnectionCounts> counts_;  // null: not counted
  const std::string address_, origin_;
  Stage stage_;
  const std::optional<ErrorMessage> refusal_;
  std::function<void()> close_;
};

/// Access control and connection limits. Every listener of a server asks it for a slot for each connection, before
/// reading a byte. Connections that have not said HELLO live in a pool of their own: silent ones never take a client's
/// slot, and where the pool is full the oldest of the origin with most of them is closed. Knows addresses, but no
/// socket. Threads: the io thread.
class Gate {
 public:
  /// Connections beyond the limit that are kept open until their refusal is sent; any more are closed at once.
  static constexpr std::uint32_t kMaxPendingRefusals = 64;
  /// Connections that have not said HELLO, on all ports together.
  static constexpr std::uint32_t kMaxWaiting = 256;

  /// How a connection becomes a client's.
  enum class Entry {
    kHello,      ///< by HELLO; refused at once while no slot is free
    kRequest,    ///< perhaps never: HTTP, which is answered also while no slot is free
    kImmediate,  ///< at once: OpenIGTLink, which has no HELLO; a quarter of the slots at most
  };

  /// At most `max_clients` at once, and `max_of_origin` of them from one address, as origin_of() counts them.
  Gate(std::uint32_t max_clients, std::uint32_t max_of_origin, TokenGrants tokens);

  /// For a connection from `address` (without port). Null: close the connection without an answer.
  std::shared_ptr<ConnectionSlot> acquire_slot(const std::string& address, Entry entry = Entry::kHello);

  /// For the in-process viewer: not counted, and no token required.
  static std::shared_ptr<ConnectionSlot> exempt_slot();

  /// Why the connection of a waiting slot cannot become a client's now; nullopt: it can, or is one.
  std::optional<ErrorMessage> busy(const ConnectionSlot& slot) const;
  /// It said HELLO and was granted its role. Precondition: !busy(slot).
  void promote(ConnectionSlot& slot);

  /// Why a client is refused `role`; nullopt: granted. A wrong token has no effect on other connections: of 2²⁵⁶ none
  /// is found by trying.
  std::optional<ErrorMessage> refusal(const std::optional<Token>& shown, Role role);

  std::uint64_t wrong_tokens() const { return wrong_tokens_; }  ///< since start
  std::uint64_t refused() const { return refused_; }            ///< for lack of a free slot, since start
  std::uint64_t shed() const { return shed_; }  ///< closed before HELLO for newer ones, since start

 private:
  std::optional<ErrorMessage> no_slot_for(const std::string& origin) const;
  void shed_oldest();

  const std::uint32_t max_clients_, max_of_origin_;
  const TokenGrants tokens_;
  const std::shared_ptr<ConnectionCounts> counts_ =
      std::make_shared<ConnectionCounts>();  // slots outlive the gate
  std::uint64_t wrong_tokens_ = 0, refused_ = 0, shed_ = 0;
};

}  // namespace brachy::net
