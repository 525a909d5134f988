#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "net/session/session.h"

namespace brachy::net::test {

/// Stands in for the server of one session: grants what a HELLO asks for, and records what it is called for.
class FakeSessionHost final : public SessionHost {
 public:
  std::optional<ErrorMessage> admit(Session&, const HelloMessage& hello, WelcomeMessage& welcome) override {
    calls.push_back("admit");
    welcome.role = granted_role.value_or(hello.role);
    welcome.needle = hello.needle;
    return refusal;
  }
  void on_open(Session& session) override {
    calls.push_back("open");
    session.send(MessageType::kScene, std::make_shared<const Bytes>());
  }
  void await_turn(Session&) override { calls.push_back("await turn"); }
  std::pair<std::shared_ptr<const Bytes>, std::uint64_t> frame_body(const FrameRequest&) override {
    calls.push_back("frame");
    return {std::make_shared<const Bytes>(), 1};
  }
  StateMessage common_state() override {
    StateMessage state;
    state.ticks = 77;
    return state;
  }
  void on_ending(const Session&, const std::string& reason) override { calls.push_back("ending: " + reason); }
  void on_closed(const Session&) override { calls.push_back("closed"); }

  std::optional<ErrorMessage> refusal;
  std::optional<Role> granted_role;  ///< nullopt: as asked for
  std::vector<std::string> calls;
};

}  // namespace brachy::net::test
