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

/// Who may connect, and how many: all listeners of a server ask it for each connection, before they read a byte of it.
/// Knows addresses and time, but no socket. Threads: the io thread.
class Gate {
 public:
  /// Connections too many that are held all the same, until each has been told so; who comes beyond is closed.
  static constexpr std::uint32_t kMaxTold = 64;
  /// An address that showed so many wrong tokens within the time is refused until there are fewer.
  static constexpr std::size_t kMaxWrongTokens = 10;
  static constexpr std::chrono::seconds kWrongTokensWindow{60};

 private:
  struct Counts {
    std::uint32_t places = 0, told = 0;
    std::map<std::string, std::uint32_t> places_of;  // by address
  };

 public:
  /// What one connection has from its beginning to its end.
  class Place {
   public:
    Place(std::shared_ptr<Counts> counts, std::string address, std::optional<ErrorMessage> refusal);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

    const std::string& address() const { return address_; }
    bool is_own() const { return counts_ == nullptr; }  ///< of Gate::own_place
    /// What to tell the peer, and then to close: BUSY or UNAUTHORISED. nullopt: it may stay.
    const std::optional<ErrorMessage>& refusal() const { return refusal_; }

   private:
    const std::shared_ptr<Counts> counts_;  // null: not counted
    const std::string address_;
    const std::optional<ErrorMessage> refusal_;
  };

  /// At most `max_places` connections at once, and `max_of_address` of them from one address.
  Gate(std::uint32_t max_places, std::uint32_t max_of_address, TokenGrants tokens);

  /// For a connection from `address`, which has no port. Null: close it without a word.
  std::shared_ptr<const Place> enter(const std::string& address, std::int64_t now_ns);

  /// For the server's own viewer in this process: it is not counted, and needs no token.
  static std::shared_ptr<const Place> own_place();

  /// Why who came from `address` may not have `role`; nullopt: it may.
  std::optional<ErrorMessage> refusal(const std::string& address, const std::optional<Token>& shown,
                                      Role role, std::int64_t now_ns);

  std::uint64_t wrong_tokens() const { return wrong_tokens_; }  ///< since start
  std::uint64_t refused() const { return refused_; }            ///< at enter(), since start
  std::size_t remembered_addresses() const { return wrong_at_ns_.size(); }

 private:
  std::optional<ErrorMessage> refusal_at_entry(const std::string& address, std::int64_t now_ns);
  void note_wrong_token(const std::string& address, std::int64_t now_ns);
  bool is_shut_out(const std::string& address, std::int64_t now_ns) const;

  const std::uint32_t max_places_, max_of_address_;
  const TokenGrants tokens_;
  const std::shared_ptr<Counts> counts_ = std::make_shared<Counts>();  // places outlive the gate
  std::map<std::string, std::vector<std::int64_t>> wrong_at_ns_;  // the last ones of an address, oldest first
  std::uint64_t wrong_tokens_ = 0, refused_ = 0;
};

}  // namespace brachy::net
