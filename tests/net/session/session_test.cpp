// A Session by itself: who may send which request, how often, what is answered, and in what order.
#include "net/session/session.h"

#include <functional>
#include <map>

#include "tests/net/manual_clock.h"
#include "tests/net/session/fake_connection.h"
#include "tests/net/session/fake_session_host.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

constexpr std::uint16_t kProbe = 2;

struct SessionTest : ::testing::Test {
  SessionTest() {
    options.clock = &clock;
    server.needles = 3;
    server.probe_needle = kProbe;
    server.is_own_device = [this](std::uint16_t needle) { return needle == own_device; };
    server.submit = [this](std::uint16_t needle, const NeedlePose& pose) {
      done.push_back("pose " + std::to_string(needle));
      last_pose = pose;
      return verdict;
    };
    server.refuse_pose = [this](const PoseVerdict& refused, std::uint16_t, const std::string&) {
      ++poses_refused[refused.code];
    };
    server.broadcast_state = [this] { done.push_back("state"); };
    handle<ArmMessage>("arm");
    handle<DropMessage>("drop");
    handle<ControlMessage>("control");
    handle<LoadMessage>("load");
    handle<ExerciseMessage>("exercise");
    handle<PlanMessage>("plan");
    handle<ScannerMessage>("scanner");
    handle<ContourMessage>("contour");
  }
  ~SessionTest() override { forget_session(); }
  /// A session and its connection hold each other until one of them ends.
  void forget_session() {
    if (connection) connection->close();
  }
  template <class Message>
  void handle(const std::string& name) {
    server.handlers.set<Message>([this, name](const Message&, const Sender& from) {
      done.push_back(name);
      sender = from;
      return reason;
    });
  }

  /// Another session, which has not said HELLO.
  void connect() {
    forget_session();
    connection = std::make_shared<FakeConnection>(clock);
    session = std::make_shared<Session>(++sessions, connection, gate.acquire_slot("10.0.0.7"), host, server,
                                        options);
    session->start();
    done.clear();
  }
  void join(Role role, std::uint16_t needle = kAnyNeedle) {
    connect();
    HelloMessage hello;
    hello.role = role;
    hello.name = "rosa";
    hello.needle = needle;
    hello.subscription = kSubscribeNoMesh;
    send(hello);
    ASSERT_TRUE(session->is_open());
  }
  template <class... Messages>
  void send(const Messages&... messages) {
    connection->send_together(messages...);
    connection->read_all();
  }
  template <class Message>
  void send_times(int times, const Message& message) {
    for (int i = 0; i < times; ++i) send(message);
  }
  /// Sends a message that is answered by one ERROR, and returns that.
  template <class Message>
  ErrorMessage refused(const Message& message) {
    const std::size_t before = connection->errors.size();
    send(message);
    EXPECT_EQ(connection->errors.size(), before + 1);
    if (connection->errors.size() == before) return {};
    EXPECT_EQ(connection->errors.back().about_sequence, connection->sent());
    return connection->errors.back();
  }
  /// The same, of one that ends nothing.
  template <class Message>
  void expect_refused(const Message& message, ErrorCode code, const std::string& text) {
    const ErrorMessage error = refused(message);
    EXPECT_EQ(error.code, code) << error.text;
    EXPECT_FALSE(error.fatal);
    EXPECT_EQ(error.text, text);
  }
  template <class Message>
  void expect_fatal(const Message& message, const std::string& text) {
    const ErrorMessage error = refused(message);
    EXPECT_EQ(error.code, ErrorCode::kProtocol) << error.text;
    EXPECT_TRUE(error.fatal);
    EXPECT_EQ(error.text, text);
    EXPECT_TRUE(session->is_closing());
  }
  int count(const std::string& name) const { return static_cast<int>(std::ranges::count(done, name)); }
  std::size_t errors() const { return connection->errors.size(); }

  ManualClock clock;
  ServerOptions options;
  RequestServer server;
  FakeSessionHost host;
  Gate gate{64, 48, {}};
  std::shared_ptr<FakeConnection> connection;
  std::shared_ptr<Session> session;
  std::uint64_t sessions = 0;
  std::uint16_t own_device = kAnyNeedle;  ///< whose device is the daemon's
  std::string reason;                     ///< why handlers refuse; empty: they do not
  PoseVerdict verdict;
  std::vector<std::string> done;  ///< what handlers did
  Sender sender;                  ///< of the last
  std::function<void(std::string)> kept;
  NeedlePose last_pose;
  std::map<std::uint16_t, int> poses_refused;  ///< by code
};

ArmMessage arm(std::uint16_t needle) {
  return {needle};
}
DropMessage drop(std::uint16_t needle) {
  return {needle, true};
}
LoadMessage load(std::uint16_t needle) {
  return {needle, 4};
}
PoseMessage pose(std::uint16_t needle) {
  PoseMessage message = sample_pose();
  message.needle = needle;
  return message;
}

TEST_F(SessionTest, AnOperatorMaySendEveryRequestButPosesAndDrops) {
  join(Role::kOperator);
  send(arm(0), sample_control(), load(1), sample_plan(), sample_scanner(), sample_contour());
  EXPECT_EQ(done,
            (std::vector<std::string>{"arm", "control", "state", "load", "plan", "scanner", "contour"}));
  EXPECT_EQ(sender.name, "rosa (10.0.0.7:5000)");
  EXPECT_EQ(errors(), 0u);
  expect_refused(pose(0), ErrorCode::kNotDevice, "only the client with the role device sends poses");
  EXPECT_EQ(connection->errors.back().reason, kRefusedNotDevice);
  expect_refused(
      drop(0), ErrorCode::kNotDevice,
      "only the device of needle 0 drops its seeds; an operator does where the daemon's own device has "
      "the needle");
  EXPECT_EQ(connection->errors.back().reason, kRefusedNotDevice);
  own_device = 0;
  send(drop(0));
  EXPECT_EQ(done.back(), "drop");
}

TEST_F(SessionTest, ADeviceMayMoveArmAndDropItsOwnNeedleAlone) {
  join(Role::kDevice, 1);
  send(pose(1), arm(1), drop(1));
  EXPECT_EQ(done, (std::vector<std::string>{"pose 1", "arm", "drop"}));
  expect_refused(pose(0), ErrorCode::kPoseRefused, "this device has needle 1: WELCOME says so");
  EXPECT_EQ(connection->errors.back().reason, kRefusedNeedle);
  expect_refused(arm(0), ErrorCode::kNotDevice,
                 "only the device of needle 0 or a client with the role operator may arm it");
  EXPECT_EQ(connection->errors.back().reason, kRefusedNotDevice);
  EXPECT_EQ(refused(drop(0)).code, ErrorCode::kNotDevice);
  own_device = 0;
  EXPECT_EQ(refused(drop(0)).code, ErrorCode::kNotDevice) << "no operator";
  EXPECT_EQ(done.size(), 3u);
}

TEST_F(SessionTest, OperatorsRequestsAreRefusedToOthersByName) {
  for (const Role role : {Role::kViewer, Role::kDevice}) {
    join(role, role == Role::kDevice ? 0 : kAnyNeedle);
    const std::string only = "only a client with the role operator may send ";
    expect_refused(sample_control(), ErrorCode::kNotOperator, only + "CONTROL");
    expect_refused(load(0), ErrorCode::kNotOperator, only + "LOAD");
    expect_refused(sample_exercise(), ErrorCode::kNotOperator, only + "EXERCISE");
    expect_refused(sample_plan(), ErrorCode::kNotOperator, only + "PLAN");
    expect_refused(sample_contour(), ErrorCode::kNotOperator, only + "CONTOUR");
    expect_refused(sample_scanner(), ErrorCode::kNotOperator,
                   "only a client with the role operator, or the probe's device, may send SCANNER");
    EXPECT_TRUE(done.empty());
    EXPECT_TRUE(session->is_open());
  }
}

TEST_F(SessionTest, AViewerNeitherArmsDropsNorMoves) {
  join(Role::kViewer);
  EXPECT_EQ(refused(arm(0)).code, ErrorCode::kNotDevice);
  EXPECT_EQ(refused(drop(0)).code, ErrorCode::kNotDevice);
  EXPECT_EQ(refused(pose(0)).code, ErrorCode::kNotDevice);
  EXPECT_TRUE(done.empty());
}

TEST_F(SessionTest, TheProbesDeviceMaySendScanner) {
  join(Role::kDevice, kProbe);
  send(sample_scanner());
  EXPECT_EQ(done, std::vector<std::string>{"scanner"});
  EXPECT_EQ(sender.needle, kProbe);
  EXPECT_EQ(sender.role, Role::kDevice);
}

TEST_F(SessionTest, AViewOnlyServerNamesTheOneForOperators) {
  server.devices_at = options.devices_at = "10.0.0.1:18950";
  host.granted_role = Role::kViewer;
  join(Role::kOperator);
  ASSERT_EQ(errors(), 1u);
  EXPECT_EQ(connection->errors[0].text, "this server is view-only: operators connect to 10.0.0.1:18950");
  const std::string only = "only a client with the role operator may send ";
  const std::string where = ": operators connect to 10.0.0.1:18950";
  expect_refused(sample_control(), ErrorCode::kNotOperator, only + "CONTROL" + where);
  expect_refused(sample_plan(), ErrorCode::kNotOperator, only + "PLAN" + where);
  expect_refused(load(0), ErrorCode::kNotOperator, only + "LOAD" + where);
  expect_refused(sample_exercise(), ErrorCode::kNotOperator, only + "EXERCISE" + where);
  expect_refused(sample_contour(), ErrorCode::kNotOperator, only + "CONTOUR" + where);
}

TEST_F(SessionTest, NeedlesThatTheSceneLacksAreNamed) {
  join(Role::kOperator);
  const std::string text = "there is no needle 3: needles are 0 to 2";
  expect_refused(arm(3), ErrorCode::kNoNeedle, text);
  expect_refused(load(3), ErrorCode::kNoNeedle, text);
  expect_refused(drop(3), ErrorCode::kNoNeedle, text);
  EXPECT_TRUE(done.empty());
}

TEST_F(SessionTest, ControlsLoadsAndPlansShareTenASecond) {
  join(Role::kOperator);
  send_times(4, sample_control());
  send_times(3, load(0));
  send_times(3, sample_plan());
  const std::string text = "more than 10 CONTROLs, LOADs and PLANs a second";
  expect_refused(sample_control(), ErrorCode::kControlRefused, text);
  expect_refused(load(0), ErrorCode::kLoadRefused, text);
  expect_refused(sample_plan(), ErrorCode::kPlanRefused, text);
  EXPECT_EQ(count("control") + count("load") + count("plan"), 10);
  clock.advance(std::chrono::milliseconds(100));
  send(sample_plan());
  EXPECT_EQ(count("plan"), 4);
  EXPECT_EQ(refused(sample_plan()).code, ErrorCode::kPlanRefused);
}

TEST_F(SessionTest, ScannerAndContourHaveRatesOfTheirOwn) {
  join(Role::kOperator);
  send_times(10, sample_control());
  send_times(30, sample_scanner());
  expect_refused(sample_scanner(), ErrorCode::kScannerRefused, "more than 30 SCANNERs a second");
  send_times(2, sample_contour());
  expect_refused(sample_contour(), ErrorCode::kContourRefused, "more than one CONTOUR a second");
  EXPECT_EQ(count("scanner"), 30);
  EXPECT_EQ(count("contour"), 2);
  clock.advance(std::chrono::seconds(1));
  send(sample_contour(), sample_contour());
  EXPECT_EQ(count("contour"), 3);
}

TEST_F(SessionTest, ExercisesBeginOnceASecond) {
  join(Role::kOperator);
  send_times(2, sample_exercise());
  expect_refused(sample_exercise(), ErrorCode::kExerciseRefused, "more than one EXERCISE a second");
  EXPECT_EQ(count("exercise"), 2);
  clock.advance(std::chrono::seconds(1));
  send(sample_exercise());
  EXPECT_EQ(count("exercise"), 3);
}

TEST_F(SessionTest, ArmsOverTheRateAreRefusedAndDropsOverItEndTheSession) {
  join(Role::kDevice, 0);
  send_times(10, arm(0));
  expect_refused(arm(0), ErrorCode::kControlRefused, "more than 10 ARMs a second");
  EXPECT_EQ(count("arm"), 10);
  send_times(100, drop(0));
  EXPECT_EQ(count("drop"), 100);
  expect_fatal(drop(0), "more than 100 DROPs a second");
  EXPECT_EQ(count("drop"), 100);
}

TEST_F(SessionTest, OneWithoutTheRightUsesUpNothing) {
  host.granted_role = Role::kViewer;
  join(Role::kOperator);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(refused(sample_control()).code, ErrorCode::kNotOperator);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(refused(arm(9)).code, ErrorCode::kNoNeedle);
}

TEST_F(SessionTest, PosesOverTheRateAreCountedAndReportedOnceASecond) {
  server.max_poses_per_s = 100;  // ten at once
  join(Role::kDevice, 0);
  send_times(10, pose(0));
  expect_refused(pose(0), ErrorCode::kPoseRate, "more than 100 poses a second");
  EXPECT_EQ(connection->errors.back().reason, kRefusedRate);
  send_times(8, pose(0));
  EXPECT_EQ(errors(), 1u);
  EXPECT_EQ(count("pose 0"), 10);
  EXPECT_EQ(poses_refused[kRefusedRate], 9);
  clock.advance(std::chrono::milliseconds(10));
  send(pose(0));
  EXPECT_EQ(count("pose 0"), 11);
}

TEST_F(SessionTest, APoseIsSubmittedAsItCameAndARefusalReportedFourTimesASecond) {
  join(Role::kDevice, 1);
  verdict = {false, 5, "too fast"};
  expect_refused(pose(1), ErrorCode::kPoseRefused, "too fast");
  EXPECT_EQ(connection->errors.back().reason, 5);
  EXPECT_EQ(last_pose.sequence, connection->sent());
  EXPECT_EQ(last_pose.received_ns, clock.now_ns());
  EXPECT_EQ(last_pose.X_WN, sample_pose().X_WN);
  send_times(9, pose(1));
  EXPECT_EQ(errors(), 4u);
  EXPECT_EQ(count("pose 1"), 10);
  EXPECT_TRUE(poses_refused.empty()) << "whoever judges a pose counts it";
  send_times(3, pose(0));
  EXPECT_EQ(poses_refused[kRefusedNeedle], 3);
  EXPECT_EQ(errors(), 4u) << "the same budget";
}

TEST_F(SessionTest, AHandlersReasonIsSentWithTheRequestsCode) {
  join(Role::kOperator);
  reason = "a session is being recorded";
  expect_refused(sample_control(), ErrorCode::kControlRefused, reason);
  expect_refused(load(0), ErrorCode::kLoadRefused, reason);
  expect_refused(sample_exercise(), ErrorCode::kExerciseRefused, reason);
  expect_refused(sample_plan(), ErrorCode::kPlanRefused, reason);
  expect_refused(sample_scanner(), ErrorCode::kScannerRefused, reason);
  expect_refused(sample_contour(), ErrorCode::kContourRefused, reason);
  EXPECT_EQ(count("state"), 0) << "nothing was changed";
}

TEST_F(SessionTest, RequestsThatNobodyCarriesOutAreRefused) {
  server.handlers = {};
  join(Role::kOperator);
  expect_refused(sample_control(), ErrorCode::kControlRefused, "this server has no controls");
  expect_refused(load(0), ErrorCode::kLoadRefused, "this server loads no needles");
  expect_refused(sample_exercise(), ErrorCode::kExerciseRefused, "this server has no exercises");
  expect_refused(sample_plan(), ErrorCode::kPlanRefused, "this server has no plan");
  expect_refused(sample_scanner(), ErrorCode::kScannerRefused, "this server has no ultrasound scanner");
  expect_refused(sample_contour(), ErrorCode::kContourRefused, "this server scores no volume studies");
  own_device = 0;
  const std::size_t before = errors();
  send(arm(0), drop(0));
  EXPECT_EQ(errors(), before);
}

TEST_F(SessionTest, AContourIsAnsweredLaterUnderItsOwnNumberAndNotOnceItsSenderHasLeft) {
  join(Role::kOperator);
  ContourMessage asked;
  server.handlers.set<ContourMessage>([&](const ContourMessage& contour, const Sender& from) {
    asked = contour;
    sender = from;
  });
  ContourMessage study = sample_contour();
  study.about_sequence = 999;
  send(study);
  EXPECT_EQ(asked.about_sequence, connection->sent());
  EXPECT_FALSE(asked.score) << "only a server scores";
  sender.answer(asked);
  connection->read_all();
  EXPECT_EQ(connection->types.back(), MessageType::kContour);
  const std::size_t before = connection->types.size();
  connection->leave();
  sender.answer(asked);
  session.reset();
  sender.answer(asked);
  EXPECT_EQ(connection->types.size(), before);
}

// With 32 viewers a turn of the io thread that wrote to all of them would keep a force waiting for 6 ms.
TEST_F(SessionTest, WhatAllAreOfferedIsWrittenInATurnOfItsOwn) {
  options.has_ultrasound = true;
  connect();
  HelloMessage hello;
  hello.name = "rosa";
  hello.subscription = kSubscribeUltrasound | kSubscribeNoMesh;
  send(hello);
  host.calls.clear();
  const std::size_t before = connection->types.size();
  const ImageMessage image = sample_image();
  const auto body = encoded_body(image);
  session->offer_image(image.array, body);
  session->offer_image(image.array, body);
  connection->read_all();
  EXPECT_EQ(connection->types.size(), before) << "nothing is written yet";
  EXPECT_EQ(host.calls, std::vector<std::string>{"await turn"});
  EXPECT_EQ(session->images_dropped(), 1u);
  session->take_turn();
  connection->read_all();
  EXPECT_EQ(connection->types.size(), before + 1);
  session->offer_image(image.array, body);
  EXPECT_EQ(host.calls, (std::vector<std::string>{"await turn", "await turn"}));
}

TEST_F(SessionTest, WhatWasAcceptedMayBeRefusedLaterUnderItsOwnNumberAndCode) {
  join(Role::kOperator);
  const auto refuse_later = [&](const auto& message, ErrorCode code) {
    send(message);
    EXPECT_EQ(errors(), 0u);
    const std::uint64_t about = connection->sent();
    send(arm(0));
    ASSERT_TRUE(kept);
    kept("it came out that it cannot be done");
    connection->read_all();
    ASSERT_EQ(errors(), 1u);
    EXPECT_EQ(connection->errors.back().code, code);
    EXPECT_EQ(connection->errors.back().about_sequence, about);
    EXPECT_EQ(connection->errors.back().text, "it came out that it cannot be done");
    EXPECT_FALSE(connection->errors.back().fatal);
    connection->errors.clear();
  };
  const auto keep = [&](const auto&, const Sender& from) { kept = from.refuse; };
  server.handlers.set<PlanMessage>(keep);
  server.handlers.set<ContourMessage>(keep);
  server.handlers.set<ControlMessage>(keep);
  refuse_later(sample_plan(), ErrorCode::kPlanRefused);
  refuse_later(sample_contour(), ErrorCode::kContourRefused);
  refuse_later(sample_control(), ErrorCode::kControlRefused);
  connection->leave();
  session.reset();
  kept("nobody hears it");
}

/// The largest volume study that the document allows: 2 MB.
ContourMessage largest_study() {
  ContourMessage study;
  ContourSlice slice = sample_contour().slices.at(0);
  slice.points.assign(ContourMessage::kMostPoints, {1, 2});
  for (std::size_t i = 0; i < ContourMessage::kMostSlices; ++i) {
    slice.slice = static_cast<std::int32_t>(i);
    study.slices.push_back(slice);
  }
  return study;
}

TEST_F(SessionTest, TheLargestStudyPassesTheLimitOfMessagesFromAnOperatorAlone) {
  join(Role::kOperator);
  send(largest_study());
  EXPECT_EQ(count("contour"), 1);
  EXPECT_EQ(errors(), 0u);
  ContourMessage larger = largest_study();
  larger.slices.push_back(larger.slices[0]);
  EXPECT_EQ(refused(larger).code, ErrorCode::kTooLarge);
  join(Role::kViewer);
  EXPECT_EQ(refused(largest_study()).code, ErrorCode::kTooLarge);
  join(Role::kOperator);
  PlanMessage plan;
  plan.needles.assign(4000, {0, false, 0, 80, "G7", "s-s-s-s-s-s-s-s"});
  EXPECT_EQ(refused(plan).code, ErrorCode::kTooLarge) << "no other message";
}

TEST_F(SessionTest, MessagesOfLaterVersionsAreSkippedAndThoseOfServersEndIt) {
  join(Role::kViewer);
  for (const int type : {23, 999, 65535}) connection->send_header_and_body(MessageType(type), Bytes(7));
  connection->send_header_and_body(MessageType(0), {});
  connection->read_all();
  EXPECT_EQ(errors(), 0u);
  EXPECT_TRUE(session->is_open());
  expect_fatal(sample_force(), "only a server sends messages of this type");
}

TEST_F(SessionTest, ABodyOfAnotherLengthEndsIt) {
  for (const MessageType type :
       {MessageType::kArm, MessageType::kDrop, MessageType::kControl, MessageType::kLoad, MessageType::kPlan,
        MessageType::kPose, MessageType::kScanner, MessageType::kContour, MessageType::kExercise,
        MessageType::kPing, MessageType::kError}) {
    join(Role::kOperator);
    connection->send_header_and_body(type, Bytes(3));
    connection->read_all();
    EXPECT_EQ(connection->fatal(), ErrorCode::kProtocol) << static_cast<int>(type);
    EXPECT_EQ(connection->errors.back().about_sequence, 2u);
  }
  join(Role::kViewer);
  expect_fatal(sample_state(), "a STATE from a client must be empty");
}

TEST_F(SessionTest, RequestsWaitForHelloWhichIsSaidOnce) {
  connect();
  expect_fatal(sample_control(), "the first message must be HELLO");
  EXPECT_TRUE(done.empty());
  join(Role::kOperator);
  expect_fatal(sample_hello(), "a second HELLO");
}

TEST_F(SessionTest, WelcomeComesFirstThenWhatTheHostSendsThenAnswers) {
  reason = "no";
  connect();
  HelloMessage hello;
  hello.role = Role::kOperator;
  connection->send_together(hello, sample_control());
  connection->read_all();
  EXPECT_EQ(connection->types,
            (std::vector<MessageType>{MessageType::kWelcome, MessageType::kScene, MessageType::kError}));
  EXPECT_EQ(host.calls, (std::vector<std::string>{"admit", "open"}));
}

TEST_F(SessionTest, NothingIsCarriedOutAfterAFatalError) {
  join(Role::kOperator);
  connection->send_together(sample_force(), sample_control());
  send(sample_control());
  EXPECT_TRUE(done.empty());
  EXPECT_EQ(errors(), 1u);
  EXPECT_TRUE(connection->is_shut()) << "the ERROR is the last message";
  connection->leave();
  EXPECT_EQ(host.calls, (std::vector<std::string>{
                            "admit", "open", "ending: only a server sends messages of this type", "closed"}));
}

TEST_F(SessionTest, ItEndsOnceWhenThePeerLeaves) {
  join(Role::kDevice, 0);
  connection->leave();
  session->fail(ErrorCode::kShutdown, "the server stops");
  session->abort("the server is gone");
  EXPECT_EQ(host.calls, (std::vector<std::string>{"admit", "open", "ending: closed by the peer", "closed"}));
  EXPECT_EQ(errors(), 0u);
}

TEST_F(SessionTest, StatesAndPingsAreAnsweredAtTheirRates) {
  join(Role::kViewer);
  for (int i = 0; i < 5; ++i) {
    connection->send_header_and_body(MessageType::kState, {});
    connection->read_all();
  }
  ASSERT_EQ(connection->states.size(), 2u);
  EXPECT_EQ(connection->states[0].ticks, 77u);
  send_times(60, PingMessage{5, false, 0, 0});
  EXPECT_EQ(std::ranges::count(connection->types, MessageType::kPing), 50);
  EXPECT_EQ(errors(), 0u);
}

TEST_F(SessionTest, WithoutHelloItEndsInTimeAndAWrongTokenIsAnsweredLate) {
  connect();
  clock.advance(std::chrono::milliseconds(2000));
  session->check_time(clock.now_ns());
  connection->read_all();
  EXPECT_EQ(connection->fatal(), ErrorCode::kTimeout);
  EXPECT_EQ(connection->errors.at(0).text, "no HELLO within 2 s");
  host.refusal = ErrorMessage{ErrorCode::kUnauthorised, true, 0, 0, "the token is not known"};
  connect();
  send(sample_hello_with_token(), sample_control());
  session->check_time(clock.now_ns() + 199'000'000);
  EXPECT_EQ(errors(), 0u);
  session->check_time(clock.now_ns() + 200'000'000);
  connection->read_all();
  EXPECT_EQ(connection->errors.at(0).text, "the token is not known");
  EXPECT_EQ(connection->errors[0].about_sequence, 1u);
  EXPECT_TRUE(done.empty());
}

}  // namespace
}  // namespace brachy::net::test
