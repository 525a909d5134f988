#pragma once

#include <any>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "core/needle/needle_pose.h"
#include "net/base/rate_limit.h"
#include "net/wire/codec.h"

/// What clients ask of a server. Each request has a source file here, which says how its message is decoded, who may
/// send it, how often, and what is answered; requests.cpp lists them. No socket, thread or clock.
namespace brachy::net {

/// The client that sent a request.
struct Sender {
  std::string name;  ///< "NAME (ADDRESS)"
  Role role = Role::kViewer;
  std::uint16_t needle = kAnyNeedle;  ///< granted; kAnyNeedle: none
  /// Sends it a message, also later; does nothing once it has left. May be empty.
  std::function<void(MessageType, std::shared_ptr<const Bytes>)> send = {};
  std::function<void(const ErrorMessage&)> send_error = {};  ///< likewise
  std::uint64_t id = 0;                                      ///< of its connection; never used for another
  /// Refuses the request that a handler has accepted to be carried out later: it keeps this until it is done. Set for
  /// handlers that may refuse; does nothing once the client has left.
  std::function<void(std::string why)> refuse = {};

  template <WireMessage Message>
  void answer(const Message& message) const {
    if (send) send(Message::kType, encoded_body(message));
  }
};

/// Carries out a request that its sender may send. Returns "" where it is or will be done, else the reason why not,
/// which the sender gets in an ERROR; where that takes more than 1 ms to say, it returns "" and another thread works on
/// it (Sender::answer, Sender::refuse). May move from the message, which nobody reads after it. Must not throw.
template <WireMessage Message>
using RequestHandler = std::function<std::string(Message&, const Sender&)>;

/// The handlers of the requests that a server's owner carries out, one for each message. Threads: the io thread.
class RequestHandlers {
 public:
  /// `handler`: as RequestHandler, or without a result where nothing can be refused.
  template <WireMessage Message, class Handler>
  void set(Handler handler) {
    using Result = std::invoke_result_t<Handler&, Message&, const Sender&>;
    handlers_[Message::kType] = RequestHandler<Message>(
        [handler = std::move(handler)](Message& message, const Sender& sender) -> std::string {
          if constexpr (std::is_void_v<Result>) {
            handler(message, sender);
            return {};
          } else {
            return handler(message, sender);
          }
        });
  }
  /// As the handler, or `if_none` where there is none.
  template <WireMessage Message>
  std::string call(Message message, const Sender& sender, const char* if_none = "") const {
    const auto found = handlers_.find(Message::kType);
    if (found == handlers_.end()) return if_none;
    return std::any_cast<const RequestHandler<Message>&>(found->second)(message, sender);
  }

 private:
  std::map<MessageType, std::any> handlers_;  // a RequestHandler of the type's message
};

/// The verdict on a pose. Codes below 0xFF00 are the daemon's; the text goes to the sender and into STATE.
struct PoseVerdict {
  bool accepted = true;
  std::uint16_t code = 0;
  std::string text;
};

/// Poses that are judged by no guard: of a needle or tool that is not the sender's, beyond its rate, or marked by its
/// tracker as those of a tool that it does not see.
enum class StrayPose : std::uint8_t { kForeign, kTooMany, kUnseen };

/// What requests need of their server, for all of its clients.
struct RequestServer {
  std::uint16_t needles = 1;
  std::uint16_t probe_needle = kAnyNeedle;  ///< none: the scene has no probe
  std::uint32_t max_poses_per_s = 2000;
  std::string devices_at;  ///< of a view-only server: where operators connect; else empty
  std::function<bool(std::uint16_t needle)> is_own_device;  ///< true: the daemon's, not a client's
  std::function<PoseVerdict(std::uint16_t needle, const NeedlePose&)> submit;  ///< counts the pose, too
  /// Of a pose that is not submitted. `device`: its sender's name and address.
  std::function<void(const PoseVerdict&, std::uint16_t needle, const std::string& device)> refuse_pose;
  std::function<void()> broadcast_state;
  RequestHandlers handlers = {};
};

/// The ERROR to answer with, which ends the session where it is fatal; nullopt: none.
using Refusal = std::optional<ErrorMessage>;

/// A message that a client sent, and what it is judged by.
struct IncomingRequest {
  const Header& header;
  std::span<const std::byte> body;
  std::int64_t received_ns;
  const Sender& sender;
  RateLimits& rates;  ///< of the sender
  const RequestServer& server;
  /// Each request is answered, also as done where there is no ERROR: then no refusal may be left out.
  bool is_always_answered = false;

  /// Fatal where the body is not one of this message.
  template <WireMessage Message>
  Refusal decode(Message& message) const {
    const DecodeResult result = decode_body(body, message);
    if (result.is_good()) return std::nullopt;
    return ErrorMessage{result.code, true, 0, header.sequence, std::string(result.reason)};
  }
  bool pass(const Rate& rate) const { return rates.pass(rate, received_ns); }
  Refusal refuse(ErrorCode code, std::string why, std::uint16_t reason = 0) const {
    return ErrorMessage{code, false, reason, header.sequence, std::move(why)};
  }
  Refusal refuse_needle(std::uint16_t needle) const;  ///< nullopt: the scene has it
  /// Unless the sender is an operator. `what`: the message's name.
  Refusal refuse_others(const std::string& what) const;
  /// Beyond the rate of LOAD, PLAN and CONTROL together. `code`: the message's.
  Refusal refuse_changes(ErrorCode code) const;
  /// Calls the handler. A reason that it gives is sent with `code`, as is `if_none`.
  template <WireMessage Message>
  Refusal call(Message message, ErrorCode code, const char* if_none) const {
    Sender from = sender;
    if (sender.send_error)
      from.refuse = [send = sender.send_error, code, about = header.sequence](std::string reason) {
        send({code, false, 0, about, std::move(reason)});
      };
    std::string why = server.handlers.call(std::move(message), from, if_none);
    return why.empty() ? std::nullopt : refuse(code, std::move(why));
  }
};

/// Of a server without ultrasound, to whoever asks for its images or scanner.
inline constexpr const char* kNoScanner = "this server has no ultrasound scanner";

/// The verdict on a pose beyond `max_poses_per_s`.
PoseVerdict verdict_beyond_rate(std::uint32_t max_poses_per_s);

/// Decodes, checks and carries out a request.
using Request = Refusal(const IncomingRequest&);

/// Null: messages of this type are no requests.
Request* find_request(MessageType type);

}  // namespace brachy::net
