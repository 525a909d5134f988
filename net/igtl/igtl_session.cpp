#include "net/igtl/igtl_session.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "net/igtl/codec/text_codec.h"
#include "net/igtl/content/needle_name.h"

namespace brachy::net::igtl {
namespace {

constexpr std::uint16_t kNewestSent = 2;
constexpr std::size_t kMaxAnswers = 16;                // waiting; further queries are ignored
constexpr std::int64_t kFirstImageNs = 5'000'000'000;  // the scanner may have to start
constexpr std::array<std::string_view, 15> kCapabilities = {
    "TRANSFORM", "GET_TRANS",  "GET_POLYDATA", "STT_POLYDATA", "STP_POLYDATA",
    "GET_POINT", "STT_TDATA",  "STP_TDATA",    "GET_IMAGE",    "STT_IMAGE",
    "STP_IMAGE", "GET_STATUS", "GET_CAPABIL",  "STRING",       "COMMAND"};

/// Answers a command once nobody keeps it any more: at once, or when what takes its time has ended.
struct CommandOutcome {
  CommandOutcome() = default;
  CommandOutcome(const CommandOutcome&) = delete;
  CommandOutcome& operator=(const CommandOutcome&) = delete;
  ~CommandOutcome() {
    if (answer) answer(refusal);
  }
  Refusal refusal;  // nullopt: done
  std::function<void(const Refusal& refusal)> answer;
};

/// Of a STATUS that says what the native protocol says by an ERROR.
std::uint16_t sub_code(ErrorCode code) {
  return static_cast<std::uint16_t>(code);
}

}  // namespace

IgtlSession::IgtlSession(std::uint64_t id, std::shared_ptr<Connection> connection,
                         std::shared_ptr<ConnectionSlot> slot, const Environment& environment, Wish wish)
    : id_(id),
      connection_(std::move(connection)),
      slot_(std::move(slot)),
      environment_(environment),
      options_(environment.server.options()),
      wish_(wish),
      opened_ns_(options_.clock->now_ns()),
      now_ns_(opened_ns_),
      poses_(options_.max_poses_per_s, std::max(1.0, options_.max_poses_per_s / 10.0)) {}

// --- in ---

void IgtlSession::on_bytes(std::span<const std::byte> bytes) {
  if (is_closing())
    return;  // read and discard: closing with unread input would reset the connection before our STATUS arrives
  now_ns_ = options_.clock->now_ns();
  parser_.feed(bytes);
  MessageParser::Message message;
  while (!is_closing()) {
    const Parsed next = parser_.next(message);
    if (next != Parsed::kNeedMore) begun_ns_ = 0;
    switch (next) {
      case Parsed::kNeedMore:
        if (!parser_.has_part())
          begun_ns_ = 0;
        else if (begun_ns_ == 0)
          begun_ns_ = now_ns_;
        return;
      case Parsed::kMessage:
        on_header(message.header);
        handle(message);
        break;
      case Parsed::kSkipped:
        ++losses_.skipped;
        on_header(message.header);
        break;
      case Parsed::kWrongCrc:
        environment_.on_dropped();
        report({StatusCode::kChecksumError, 0, "WrongCrc",
                "a " + message.header.type + " was dropped: its CRC is not that of its body"});
        break;
      case Parsed::kMalformed:
        environment_.on_dropped();
        report({StatusCode::kIllegalInstruction, 0, "Malformed",
                "a " + message.header.type +
                    " was dropped: the sizes in its extended header do not fit its body"});
        break;
      case Parsed::kLost:
        environment_.on_dropped();
        return fail({StatusCode::kIllegalInstruction, 0, "NotOpenIGTLink",
                     "no OpenIGTLink header of version 1 to 3, or a body of over 1 GiB"});
    }
  }
}

/// The first message decides what a client gets; queries for the server's state or capabilities do not count.
void IgtlSession::on_header(const Header& header) {
  version_ = std::clamp(header.version, version_, kNewestSent);
  if (wish_ != Wish::kNotKnown || header.type == "GET_STATUS" || header.type == "GET_CAPABIL") return;
  const bool is_asking = header.type.starts_with("GET_") || header.type.starts_with("STT_");
  if (!is_asking) return begin_stream();
  wish_ = Wish::kAnswers;
}

void IgtlSession::begin_stream() {
  wish_ = Wish::kStream;
  if (environment_.messages.state()) offer(true, true);
}

void IgtlSession::handle(const MessageParser::Message& message) {
  if (message.header.type == "TRANSFORM") return handle_transform(message);
  if (message.header.type == "STRING" || message.header.type == "COMMAND") return handle_text(message);
  if (!queries_.pass(now_ns_) || answers_.size() >= kMaxAnswers) {
    ++losses_.ignored;
    return;
  }
  handle_query(message);
}

void IgtlSession::handle_query(const MessageParser::Message& message) {
  const Header& query = message.header;
  if (query.type == "GET_STATUS") {
    answer(encode_status(label(options_.topology_name), {StatusCode::kOk, 0, "OK", options_.server_name}));
  } else if (query.type == "GET_CAPABIL") {
    answer(encode_capability(label(query.device), kCapabilities));
  } else if (query.type == "GET_POLYDATA") {
    surface_pending_ = true;
    write_next();
  } else if (query.type == "GET_POINT") {
    answer_points(query);
  } else if (query.type == "STT_POLYDATA" || query.type == "STP_POLYDATA") {
    is_surface_asked_ = query.type.starts_with("STT");
    surface_pending_ &= is_surface_asked_;
    answer(encode_start_answer("RTS_POLYDATA", label(query.device)));
  } else if (query.type == "STT_TDATA") {
    const auto asked = decode_start_tracking(message.content);
    if (!asked) return report({StatusCode::kIllegalInstruction, 0, "Malformed", "STT_TDATA has 36 bytes"});
    stop_tracking();
    tracking_period_s_ = 1e-3 * asked->resolution_ms;
    tracking_due_.emplace(asked->resolution_ms * std::int64_t{1'000'000},
                          std::llround(1e9 / options_.deformation_hz));
    answer(encode_start_answer("RTS_TDATA", label(query.device)));
  } else if (query.type == "STP_TDATA") {
    stop_tracking();
    tracking_pending_ = false;
    answer(encode_start_answer("RTS_TDATA", label(query.device)));
  } else if (query.type == "GET_IMAGE") {
    answer_image(query);
  } else if (query.type == "STT_IMAGE" || query.type == "STP_IMAGE") {
    streams_images_ = query.type == "STT_IMAGE" && options_.has_ultrasound;
    images_pending_.clear();
    const bool is_done = options_.has_ultrasound || query.type == "STP_IMAGE";
    answer(encode_start_answer("RTS_IMAGE", label(query.device), is_done));
    if (!is_done) answer_no_image(kNoScanner);
    if (streams_images_) environment_.on_image_asked();
  } else {
    answer_transform(query);
  }
}

/// By name; without one needle 0's pose. The answer for an unknown name has an empty body, as the protocol says; with
/// a header of version 2 upstream's library does not unpack that, and a STATUS says it.
void IgtlSession::answer_transform(const Header& query) {
  if (const MeshState* state = environment_.messages.state()) {
    const std::size_t count = state->needles.states.size();
    const Naming& naming = environment_.messages.naming();
    for (const auto& [needle, pose, force, bent_tip, shape, error] :
         environment_.messages.transforms(version_)) {
      if (query.device.empty() || query.device == naming.pose_name(needle, count)) return answer(pose);
      if (query.device == naming.force_name(needle, count) && !force.empty()) return answer(force);
      if (query.device == naming.bent_tip_name(needle, count) && !bent_tip.empty()) return answer(bent_tip);
      if (query.device == naming.error_name(needle, count) && !error.empty()) return answer(error);
    }
  }
  if (version_ < 2) return answer(encode_empty("TRANSFORM", label(query.device)));
  const std::string asked = query.device.empty() ? "the needle" : query.device;
  answer(encode_status(label(query.device), {StatusCode::kNotPresent, 0, "NoTransform",
                                             "there is no transform of " + asked + " now"}));
}

void IgtlSession::answer_no_image(const std::string& why) {
  answer(encode_status(label(options_.topology_name), {StatusCode::kNotPresent, 0, "NoImage", why}));
}

/// The newest image where it is of now, else the next one.
void IgtlSession::answer_image(const Header& query) {
  if (!options_.has_ultrasound) return answer_no_image(kNoScanner);
  if (const std::string why = environment_.images.why_none(query.device); !why.empty())
    return answer_no_image(why);
  if (const auto array = environment_.images.current(query.device, now_ns_)) {
    images_pending_.insert(*array);
    return write_next();
  }
  asked_image_ = query.device;
  asked_image_ns_ = now_ns_;
  environment_.on_image_asked();
}

void IgtlSession::offer_image(ScannerArray array) {
  if (is_closing()) return;
  const bool is_asked = asked_image_ && is_image_of(*asked_image_, array);
  if (is_asked) asked_image_.reset();
  if (!is_asked && !streams_images_) return;
  images_pending_.insert(array);
  write_next();
}

/// By name: "Seeds" and "Targets"; without one the seeds, a needle's shape by its own. None: a POINT of no elements.
void IgtlSession::answer_points(const Header& query) {
  SnapshotMessages& messages = environment_.messages;
  if (query.device == "Targets") return answer(messages.targets(version_));
  if (messages.state()) {
    if (query.device.empty() || query.device == "Seeds") return answer(*messages.seeds(version_));
    const std::size_t count = messages.state()->needles.states.size();
    for (const auto& of_needle : messages.transforms(version_))
      if (query.device == messages.naming().shape_name(of_needle.needle, count) && !of_needle.shape.empty())
        return answer(of_needle.shape);
  }
  answer(encode_empty("POINT", label(query.device)));
}

/// A STRING is answered by a STATUS, a COMMAND by RTS_COMMAND. PLUS writes XML into a COMMAND, and what is to be
/// done into its name. Beyond their rates commands are refused as the native protocol's requests are.
void IgtlSession::handle_text(const MessageParser::Message& message) {
  const bool is_command = message.header.type == "COMMAND";
  if (!environment_.commands) ++losses_.skipped;
  // None of them may be left out silently.
  if (answers_.size() >= options_.max_queued_messages)
    return fail({StatusCode::kOverflow, sub_code(ErrorCode::kTimeout), "Unread", kUnread});
  const auto command = is_command ? decode_command(message.content) : std::nullopt;
  const auto text = is_command ? std::nullopt : decode_string(message.content);
  if (!command && !text) {
    environment_.on_dropped();
    return report({StatusCode::kIllegalInstruction, 0, "Malformed",
                   "the sizes in a " + message.header.type + " do not fit its body"});
  }
  const bool is_in_name = command && (command->content.empty() || command->content.starts_with('<'));
  const std::string& asked = text ? *text : is_in_name ? command->name : command->content;
  const auto outcome = std::make_shared<CommandOutcome>();
  outcome->answer = [weak = weak_from_this(), to = std::string(message.header.device), asked,
                     id = command ? std::optional(command->id) : std::nullopt](const Refusal& refusal) {
    const auto self = weak.lock();
    if (!self || self->is_closing()) return;
    const Label label = self->label(to);
    const std::uint16_t code = refusal ? sub_code(refusal->code) : std::uint16_t{0};
    const std::string why = refusal ? refusal->text : "";
    const Status status = refusal ? Status{StatusCode::kIllegalInstruction, code, "Refused", why}
                                  : Status{StatusCode::kOk, 0, "OK", asked};
    if (refusal && refusal->fatal) return self->fail(status);
    self->answer(id ? encode_command_answer(label, *id, code, why) : encode_status(label, status));
  };
  if (!environment_.commands) {
    outcome->refusal = ErrorMessage{ErrorCode::kNotOperator, false, 0, 0,
                                    "commands are off: set server.igtl_commands = true"};
    return;
  }
  Sender sender{peer(), Role::kOperator};
  sender.send_error = [outcome](const ErrorMessage& error) { outcome->refusal = error; };
  if (auto refusal =
          execute_command(asked, {*environment_.commands, requests_, now_ns_, std::move(sender),
                                  [this](std::uint16_t needle) { return find_held(needle) != nullptr; }}))
    outcome->refusal = std::move(refusal);
}

void IgtlSession::handle_transform(const MessageParser::Message& message) {
  const Header& header = message.header;
  const Naming& naming = environment_.messages.naming();
  const auto needle = naming.needle_of(header.device);
  if (!needle) return environment_.on_other_name(*this, header.device);  // another program's tool
  if (!poses_.pass(now_ns_)) {
    const PoseVerdict verdict = verdict_beyond_rate(options_.max_poses_per_s);
    environment_.server.refuse_pose(verdict, *needle, device_text(header.device));
    return report({StatusCode::kOverflow, verdict.code, "PoseRefused", verdict.text}, header.device);
  }
  const auto X_FN = decode_transform(message.content);
  if (!X_FN) {
    environment_.on_dropped();
    return report({StatusCode::kIllegalInstruction, 0, "Malformed", "TRANSFORM has 48 bytes"});
  }
  // PLUS sets this where the tracker does not see the tool; the matrix is meaningless then. It keeps a lease, and takes
  // none.
  const bool is_seen = message.find_metadata("TransformStatus").value_or("OK") == "OK";
  Held* held = is_seen ? attach(*needle, header.device) : find_held(*needle);
  if (!held) return;
  held->last_ns = now_ns_;
  if (!is_seen)
    return environment_.server.note_stray_pose(*needle, device_text(header.device), StrayPose::kUnseen);
  NeedlePose pose;
  pose.X_WN = naming.to_world(*X_FN);
  pose.sequence = ++poses_received_;
  pose.stamp_ns = stamp_of(header, *held);
  pose.received_ns = now_ns_;
  held->pose_ns = now_ns_;
  held->stamp_ns = pose.stamp_ns;
  pose.present = true;
  const PoseVerdict verdict = environment_.server.submit(*needle, pose);
  if (!verdict.accepted)
    report({StatusCode::kUnknownError, verdict.code, "PoseRefused", verdict.text}, header.device);
}

/// The sender's; where it gives none, what its clock showed when the pose came: of those before, else ours.
std::int64_t IgtlSession::stamp_of(const Header& header, const Held& held) const {
  if (header.timestamp != 0) return to_ns(header.timestamp);
  if (held.stamp_ns < 0) return now_ns_;
  return held.stamp_ns + std::max<std::int64_t>(now_ns_ - held.pose_ns, 1);
}

IgtlSession::Held* IgtlSession::find_held(std::uint16_t needle) {
  const auto held =
      std::find_if(held_.begin(), held_.end(), [&](const Held& h) { return h.needle == needle; });
  return held == held_.end() ? nullptr : &*held;
}

/// Null: another device has it, or there is no such needle; the client has been sent the reason.
IgtlSession::Held* IgtlSession::attach(std::uint16_t needle, const std::string& device) {
  if (Held* held = find_held(needle)) return held;
  DeviceInfo info;
  info.name = device;
  info.address = peer();
  info.needle = needle;
  info.takes_force = false;
  if (const auto refused = environment_.server.attach(info)) {
    const bool is_there = refused->code != ErrorCode::kNoNeedle;
    environment_.server.refuse_pose({false, is_there ? kRefusedNotDevice : kRefusedNeedle, refused->text},
                                    is_there ? needle : std::uint16_t{0}, device_text(device));
    report({is_there ? StatusCode::kBusy : StatusCode::kNotPresent, sub_code(refused->code), "PoseRefused",
            refused->text},
           device);
    return nullptr;
  }
  return &held_.emplace_back(Held{.needle = needle, .last_ns = now_ns_});
}

/// A few a second at most: a client that breaks a rule often does so with each message. `about`: a device of the
/// client's; "": none.
void IgtlSession::report(const Status& status, std::string_view about) {
  if (answers_.size() >= kMaxAnswers || !reports_.pass(now_ns_)) return;
  answer(encode_status(label(about.empty() ? options_.topology_name : about), status));
}

// --- out ---

Label IgtlSession::label(std::string_view device) const {
  return {version_, device, to_timestamp(options_.clock->utc_ns())};
}

void IgtlSession::answer(Bytes message) {
  answers_.push_back(std::move(message));
  write_next();
}

void IgtlSession::offer(bool transforms, bool surface) {
  if (is_closing()) return;
  if (wish_ == Wish::kStream) {
    transforms_pending_ |= transforms;
    surface_pending_ |= surface;
    seeds_pending_ |= surface && environment_.messages.seed_version() != seeds_sent_;
  }
  surface_pending_ |= surface && is_surface_asked_;
  write_next();
}

void IgtlSession::offer_tracking() {
  if (is_closing() || !tracking_due_ || !tracking_due_->pass(environment_.tracking.time_ns())) return;
  if (std::exchange(tracking_pending_, true)) ++losses_.replaced;
  write_next();
}

void IgtlSession::stop_tracking() {
  losses_ = losses();
  tracking_period_s_.reset();
  tracking_due_.reset();
}

IgtlSession::Losses IgtlSession::losses() const {
  Losses all = losses_;
  if (tracking_due_) all.missed += tracking_due_->missed();
  return all;
}

void IgtlSession::write_next() {
  if (writing_ || phase_ == Phase::kClosed) return;
  if (!answers_.empty()) {
    Bytes next = std::move(answers_.front());
    answers_.pop_front();
    return write(std::move(next), nullptr);
  }
  if (phase_ == Phase::kClosing) return connection_->shutdown_send();
  const bool is_image_turn =
      !std::exchange(was_image_, false) || !(tracking_pending_ || transforms_pending_ || surface_pending_);
  if (is_image_turn && !images_pending_.empty()) {
    was_image_ = true;
    auto next = images_pending_.upper_bound(last_image_);  // of several arrays' each in turn
    if (next == images_pending_.end()) next = images_pending_.begin();
    const ScannerArray array = last_image_ = images_pending_.extract(next).value();
    return write({}, environment_.images.encoded(array, version_));
  }
  SnapshotMessages& messages = environment_.messages;
  if (!messages.state()) return;
  const bool is_others_turn = was_surface_ || !surface_pending_;
  was_surface_ = false;
  if (is_others_turn && std::exchange(tracking_pending_, false))
    return write({}, environment_.tracking.message(version_, messages.naming()));
  if (is_others_turn && std::exchange(transforms_pending_, false) && write_transforms()) return;
  if (is_others_turn && std::exchange(seeds_pending_, false)) {
    seeds_sent_ = messages.seed_version();
    return write({}, messages.seeds(version_));
  }
  if (!std::exchange(surface_pending_, false)) return;
  was_surface_ = true;
  write({}, messages.surface(version_));
}

/// All needles' poses, forces and bent tips in one write, but not the poses of its own: a client that moves a node of
/// that name would see it moved back. False where there is none.
bool IgtlSession::write_transforms() {
  Bytes all = targets_once();
  const auto append = [&](const Bytes& message) { all.insert(all.end(), message.begin(), message.end()); };
  for (const auto& of_needle : environment_.messages.transforms(version_)) {
    const bool is_own = std::any_of(held_.begin(), held_.end(),
                                    [&](const Held& held) { return held.needle == of_needle.needle; });
    if (!is_own) append(of_needle.pose);
    append(of_needle.force);
    append(of_needle.bent_tip);
    append(of_needle.shape);
    append(of_needle.error);
  }
  if (all.empty()) return false;
  write(std::move(all), nullptr);
  return true;
}

/// The targets, with the first transforms: they do not move.
Bytes IgtlSession::targets_once() {
  if (!environment_.messages.has_targets() || std::exchange(has_targets_sent_, true)) return {};
  return environment_.messages.targets(version_);
}

void IgtlSession::write(Bytes header, std::shared_ptr<const Bytes> body) {
  writing_ = true;
  connection_->write(std::move(header), std::move(body));
}

void IgtlSession::on_written() {
  writing_ = false;
  write_next();
}

// --- time and end ---

void IgtlSession::check_time(std::int64_t now_ns) {
  if (phase_ == Phase::kClosing && now_ns - closing_ns_ >= in_ns(options_.drain_timeout))
    return abort(end_reason_);
  if (is_closing()) return;
  if (wish_ == Wish::kNotKnown && now_ns - opened_ns_ >= in_ns(environment_.first_message_wait))
    begin_stream();
  if (asked_image_ && now_ns - asked_image_ns_ >= kFirstImageNs) {
    answer_no_image("there is no ultrasound image now");
    asked_image_.reset();
  }
  // Some trackers only send. They may leave what they are sent unread: it is one message.
  const std::int64_t alive_ns = std::max(connection_->last_progress_ns(), now_ns_);
  if (writing_ && now_ns - alive_ns >= in_ns(options_.stall_timeout)) return abort("does not read");
  if (begun_ns_ != 0 && now_ns - begun_ns_ >= in_ns(options_.silence_timeout))
    return fail({StatusCode::kIllegalInstruction, 0, "Unfinished", "a message was not completed"});
  const auto is_silent = [&](const Held& held) {
    return now_ns - held.last_ns >= in_ns(options_.silence_timeout);
  };
  for (const Held& held : held_)
    if (is_silent(held)) environment_.server.detach(held.needle, "stopped sending poses");
  std::erase_if(held_, is_silent);
}

void IgtlSession::fail(const Status& status) {
  if (is_closing()) return;
  phase_ = Phase::kClosing;
  closing_ns_ = options_.clock->now_ns();
  end_reason_ = status.text;
  release_needles(status.text);
  answers_.clear();
  answer(encode_status(label(options_.topology_name), status));
}

void IgtlSession::abort(const std::string& reason) {
  if (phase_ == Phase::kClosed) return;
  connection_->close();
  on_closed(reason);
}

void IgtlSession::on_closed(const std::string& reason) {
  if (phase_ == Phase::kClosed) return;
  const std::string why = phase_ == Phase::kClosing ? end_reason_ : reason;
  phase_ = Phase::kClosed;
  slot_.reset();
  release_needles(why);
  environment_.on_closed(*this, why + losses().text());
}

std::string IgtlSession::Losses::text() const {
  std::string all;
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count) all += (all.empty() ? " (" : ", ") + std::to_string(count) + what;
  };
  add(skipped, " messages of other types skipped");
  add(ignored, " queries over the limit ignored");
  add(replaced, " TDATA replaced by newer ones");
  add(missed, " TDATA without a tick in time");
  return all.empty() ? all : all + ")";
}

void IgtlSession::release_needles(const std::string& reason) {
  for (const Held& held : held_) environment_.server.detach(held.needle, reason);
  held_.clear();
}

}  // namespace brachy::net::igtl
