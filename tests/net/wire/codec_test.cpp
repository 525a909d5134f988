#include "net/wire/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

std::string reason_of(const FrameMessage& frame) {
  FrameMessage decoded;
  return std::string(decode_body(body_of(frame), decoded).reason);
}

void put_u32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(value >> (8 * i) & 0xFF);
}

TEST(Codec, FieldsComeBackAsTheyWere) {
  FrameMessage frame;
  ASSERT_TRUE(decode_body(body_of(sample_frame()), frame).is_good());
  EXPECT_EQ(frame.tick, 42u);
  EXPECT_EQ(frame.input_received_ns, 1'999'990'000);
  EXPECT_EQ(frame.ranges, sample_frame().ranges);
  EXPECT_EQ(frame.positions, sample_frame().positions);
  ASSERT_EQ(frame.needles.size(), 1u);
  EXPECT_EQ(frame.needles[0].state.X_WN, sample_frame().needles[0].state.X_WN);
  EXPECT_EQ(frame.needles[0].state.contact, ContactState::kInserted);
  ASSERT_EQ(frame.pose_history.size(), 2u);
  EXPECT_EQ(frame.pose_history[0].tick, 41u);
  ASSERT_TRUE(frame.certificate);
  EXPECT_EQ(frame.certificate->verdict, Verdict::kInjective);
  EXPECT_EQ(frame.certificate->substeps, 3u);
  EXPECT_EQ(frame.certificate->det_bound, 0.25);
  EXPECT_EQ(frame.certificate->vertex_det, 0.5);
  EXPECT_EQ(frame.lag_mm, 0.375);
  EXPECT_EQ(frame.certificate->place, Vec3(1.5, -2, 28));
  EXPECT_EQ(frame.certificate->margin_mm, 0.75);
  EXPECT_EQ(frame.certificate->held_mm, 2.125);
  EXPECT_TRUE(std::isnan(frame.certificate->held_n));
  EXPECT_EQ(frame.certificate->condition, 1024);

  EXPECT_TRUE(frame.needles[0].has_forces);
  EXPECT_EQ(frame.needles[0].state.forces, sample_frame().needles[0].state.forces);
  EXPECT_EQ(frame.needles[0].state.input.sequence, 17u);
  EXPECT_EQ(frame.needles[0].state.input.stamp_ns, 1'000'000'500);
  ASSERT_EQ(frame.poses_of_needles.size(), 1u);
  EXPECT_EQ(frame.poses_of_needles[0].needle, 1);
  ASSERT_EQ(frame.poses_of_needles[0].poses.size(), 1u);
  EXPECT_EQ(frame.poses_of_needles[0].poses[0].X_WN.p, Vec3(0.5, 0.25, -40));

  HelloMessage hello;
  ASSERT_TRUE(decode_body(body_of(sample_hello()), hello).is_good());
  EXPECT_EQ(hello.needle, 2);
  EXPECT_EQ(hello.device_flags, kEvaluatesLocalModel);
  EXPECT_EQ(hello.name, "touch");
  EXPECT_EQ(hello.limits.max_force_n, 3.3);
  EXPECT_TRUE(std::isnan(hello.limits.damping_n_s_per_mm));

  StateMessage state;
  ASSERT_TRUE(decode_body(body_of(sample_state()), state).is_good());
  EXPECT_EQ(state.latency_ms.p999, 6);
  ASSERT_EQ(state.refusals.size(), 1u);
  EXPECT_EQ(state.refusals[0].text, "too many");
  EXPECT_EQ(state.device_holder, "touch (127.0.0.1:5)");
  ASSERT_EQ(state.safety.size(), 1u);
  EXPECT_EQ(state.safety[0].needle, 2);
  EXPECT_EQ(state.safety[0].code, 3);
  EXPECT_EQ(state.safety[0].count, 7u);
  EXPECT_EQ(state.safety[0].text, "stalled");

  LocalModelMessage model;
  ASSERT_TRUE(decode_body(body_of(sample_local_model()), model).is_good());
  EXPECT_EQ(model.model, sample_local_model().model);
  EXPECT_EQ(model.input_stamp_ns, 1'000'000'500);
  EXPECT_EQ(model.max_force_n, 3.3);
  EXPECT_EQ(model.ramp_s, 0.5);
}

TEST(Codec, PosesThatAreNotFiniteAreLeftToTheDeviceToRefuse) {
  PoseMessage pose = sample_pose(), decoded;
  pose.X_WN.p.x() = std::nan("");
  ASSERT_TRUE(decode_body(body_of(pose), decoded).is_good());
  EXPECT_TRUE(std::isnan(decoded.X_WN.p.x()));
}

// These values control a motor, so the decoder refuses invalid ones even if a driver does not check them.
TEST(Codec, ForcesAndModelsThatAreNotFiniteAreRefusedSaveInfiniteBounds) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const auto put_f64 = [](Bytes& bytes, std::size_t at, double value) {
    Bytes encoded;
    ByteWriter(encoded).f64(value);
    std::copy(encoded.begin(), encoded.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
  };
  for (std::size_t at = 32; at < 136; at += 8) {
    for (const double bad : {kNaN, kInfinite, -kInfinite}) {
      Bytes body = body_of(sample_force());
      put_f64(body, at, bad);
      ForceMessage force;
      EXPECT_TRUE(decode_body(body, force).is_bad()) << "FORCE, offset " << at;
    }
  }
  for (std::size_t at = 32; at < 208; at += 8) {
    const bool is_bound = at >= 112 && at < 136;
    for (const double bad : {kNaN, kInfinite, -kInfinite}) {
      Bytes body = body_of(sample_local_model());
      put_f64(body, at, bad);
      LocalModelMessage model;
      EXPECT_EQ(decode_body(body, model).is_good(), is_bound && !std::isnan(bad))
          << "LOCAL_MODEL, offset " << at;
    }
  }
}

TEST(Codec, AForceOfANeedleThatTheFrameHasNotIsRefused) {
  FrameMessage frame = sample_frame(), decoded;
  frame.certificate.reset();
  frame.has_pose_history = false;
  frame.pose_history.clear();
  frame.has_seeds = false;
  frame.poses_of_needles.clear();
  frame.needles[0].state.shape.is_bent = false;
  frame.lag_mm = Certificate::kNotKnown;
  Bytes body = body_of(frame);
  body[body.size() - 136] = std::byte{7};  // the only entry's needle
  EXPECT_EQ(decode_body(body, decoded).reason, "a force names a needle that is not there");
}

TEST(Codec, AnOldClientsHelloAsksForAnyNeedle) {
  HelloMessage hello = sample_hello(), decoded = sample_hello();
  hello.needle = kAnyNeedle;
  hello.device_flags = 0;
  const Bytes body = body_of(hello);
  EXPECT_EQ(Bytes(body.end() - 4, body.end()), Bytes(4));  // no sections: bytes of version 1's first servers
  ASSERT_TRUE(decode_body(body, decoded).is_good());
  EXPECT_EQ(decoded.needle, kAnyNeedle);
  EXPECT_EQ(decoded.device_flags, 0);
}

TEST(Codec, AServerSkipsASectionOfHelloThatItDoesNotKnow) {
  Bytes body = body_of(sample_hello_with_token());
  HelloMessage decoded;
  ASSERT_TRUE(decode_body(body, decoded).is_good());
  EXPECT_EQ(decoded.software, "desk 2.1");
  body[body.size() - 18] = std::byte{77};  // SOFTWARE's id, as a server of before 0.1.0 reads it
  ASSERT_TRUE(decode_body(body, decoded).is_good());
  EXPECT_EQ(decoded.software, "");
  EXPECT_TRUE(decoded.token);
}

TEST(Codec, EveryTruncationAndEveryAdditionIsRefused) {
  for (const auto& [type, body] : sample_bodies()) {
    Bytes reencoded;
    std::size_t held = 0;
    for (std::size_t size = 0; size < body.size(); ++size) {
      const Bytes cut(body.begin(),
                      body.begin() + static_cast<std::ptrdiff_t>(size));  // exact, so that asan sees
      const DecodeResult result = decode_any(type, cut, reencoded, held);
      EXPECT_TRUE(result.is_bad()) << static_cast<int>(type) << " cut to " << size;
      EXPECT_FALSE(result.reason.empty());
    }
    Bytes longer = body;
    longer.push_back(std::byte{0});
    EXPECT_TRUE(decode_any(type, longer, reencoded, held).is_bad()) << static_cast<int>(type);
  }
}

TEST(Codec, AnyBytesAreDecodedWithoutHarmAndWithoutLargeAllocations) {
  std::mt19937 random(20240607);
  const auto samples = sample_bodies();
  Bytes reencoded, again;
  std::size_t held = 0, good = 0;
  for (int i = 0; i < 200'000; ++i) {
    const auto& [type, body] = samples[random() % samples.size()];
    Bytes mutated = body;
    for (auto flips = 1 + random() % 4; flips > 0; --flips) {
      mutated[random() % mutated.size()] = static_cast<std::byte>(random() % 3 ? random() & 0xFF : 0xFF);
    }
    if (random() % 8 == 0) mutated.resize(random() % (mutated.size() + 8));
    const DecodeResult result = decode_any(type, mutated, reencoded, held);
    ASSERT_LE(held, 9 * mutated.size() + 256);  // a needle record is 116 bytes on the wire
    if (!result.is_good()) continue;
    ++good;  // what was accepted must survive its own encoding
    ASSERT_TRUE(decode_any(type, reencoded, again, held).is_good());
    ASSERT_EQ(again, reencoded);
  }
  EXPECT_GT(good, 1000u);
}

TEST(Codec, CountsThatLieAboutTheBodyAreRefusedBeforeAllocating) {
  Bytes reencoded;
  std::size_t held = 0;
  Bytes topology = body_of(sample_topology());
  put_u32(topology, 12, 0xFFFFFFFF);  // point_count
  EXPECT_TRUE(decode_any(MessageType::kTopology, topology, reencoded, held).is_bad());
  EXPECT_LT(held, 1000u);
  topology = body_of(sample_topology());
  put_u32(topology, 16, 0xFFFFFFFF);  // triangle_count
  EXPECT_TRUE(decode_any(MessageType::kTopology, topology, reencoded, held).is_bad());
  EXPECT_LT(held, 1000u);
  Bytes frame = body_of(sample_frame());
  put_u32(frame, 96, 0xFFFFFFFF);                 // point_count, so that any range is inside
  put_u32(frame, 108 + 116 + 4 + 4, 0x55555556);  // range 0: count × 12 overflows 32 bits
  EXPECT_TRUE(decode_any(MessageType::kFrame, frame, reencoded, held).is_bad());
  EXPECT_LT(held, sizeof(NeedleRecord) + 1000);
}

TEST(Codec, RangesMustAscendBeDisjointAndLieWithinThePoints) {
  FrameMessage frame = sample_frame();
  frame.positions.resize(6);
  frame.ranges = {{3, 1}, {1, 1}};
  EXPECT_NE(reason_of(frame).find("order"), std::string::npos);
  frame.ranges = {{1, 1}, {1, 1}};
  EXPECT_NE(reason_of(frame).find("overlap"), std::string::npos);
  frame.ranges = {{4, 2}};
  EXPECT_NE(reason_of(frame).find("last point"), std::string::npos);
  frame.ranges = {{0xFFFFFFFF, 2}};
  EXPECT_NE(reason_of(frame).find("last point"), std::string::npos);
  frame.positions.clear();
  frame.ranges = {{1, 0}};
  EXPECT_NE(reason_of(frame).find("empty"), std::string::npos);
}

TEST(Codec, AFullFrameHoldsEveryPoint) {
  FrameMessage frame = sample_frame();
  frame.full = true;
  EXPECT_NE(reason_of(frame).find("full frame"), std::string::npos);
  frame.base_tick = 0;
  frame.ranges = {{0, 5}};
  frame.positions.resize(15);
  EXPECT_NE(reason_of(frame).find("lacks seeds"), std::string::npos);
  frame.seed_count = 0;
  frame.seeds.clear();
  EXPECT_EQ(reason_of(frame), "");
  frame.base_tick = frame.tick + 1;
  frame.full = false;
  EXPECT_NE(reason_of(frame).find("base tick"), std::string::npos);
}

TEST(Codec, SeedsComeInOrderAndAreFinite) {
  FrameMessage frame = sample_frame();
  frame.seeds = {sample_seed(), sample_seed()};
  EXPECT_EQ(reason_of(frame), "the seeds are out of order");  // one twice
  frame.seeds[0].id = 1;
  EXPECT_EQ(reason_of(frame), "");
  frame.seeds[0].id = 0;
  EXPECT_EQ(reason_of(frame), "the seeds are out of order");
  frame.seeds = {sample_seed()};
  frame.seeds[0].id = 3;  // of two
  EXPECT_EQ(reason_of(frame), "the seeds are out of order");
  frame.seeds = {sample_seed()};
  frame.seeds[0].rest.y() = std::numeric_limits<double>::infinity();
  EXPECT_NE(reason_of(frame).find("not finite"), std::string::npos);
}

TEST(Codec, ButtonsStandAtThePosesTheyWereHeldIn) {
  FrameMessage frame = sample_frame(), decoded;
  frame.pose_history = {{38, {}, true}, {39, {}, true}, {40, {}, false}, {42, {}, true}};
  frame.poses_of_needles = {{1, {{41, {}, false}, {42, {}, true}}}, {3, {{42, {}, false}}}};
  ASSERT_TRUE(decode_body(body_of(frame), decoded).is_good());
  ASSERT_EQ(decoded.pose_history.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(decoded.pose_history[i].button, frame.pose_history[i].button) << i;
  EXPECT_FALSE(decoded.poses_of_needles[0].poses[0].button);
  EXPECT_TRUE(decoded.poses_of_needles[0].poses[1].button);
  EXPECT_FALSE(decoded.poses_of_needles[1].poses[0].button);
}

/// The only section, and last in its body: id and length, count, then the entry.
struct ShapeBody {
  FrameMessage frame = sample_frame();
  Bytes body;
  static constexpr std::size_t kEntry = 56 + 12 * NeedleShape::kPoints, kSection = 4 + kEntry;

  ShapeBody() {
    frame.certificate.reset();
    frame.has_pose_history = frame.has_seeds = false;
    frame.poses_of_needles.clear();
    frame.needles[0].has_forces = false;
    frame.lag_mm = Certificate::kNotKnown;
    body = body_of(frame);
  }
  std::byte& entry(std::size_t at) { return body[body.size() - kEntry + at]; }
  std::string reason() const {
    FrameMessage decoded;
    return std::string(decode_body(body, decoded).reason);
  }
};

TEST(Codec, ABentNeedlesShapeComesBackAsItWas) {
  FrameMessage frame;
  ASSERT_TRUE(decode_body(ShapeBody().body, frame).is_good());
  const NeedleShape &shape = frame.needles[0].state.shape, sent = sample_frame().needles[0].state.shape;
  EXPECT_TRUE(shape.is_bent);
  EXPECT_EQ(shape.points, sent.points);
  EXPECT_EQ(shape.tip_axis, sent.tip_axis);
  EXPECT_EQ(shape.tip_deflection, sent.tip_deflection);
}

TEST(Codec, AFrameWhoseNeedlesAreStraightHasNoSectionOfShapes) {
  FrameMessage frame = ShapeBody().frame, decoded = sample_frame();
  frame.needles[0].state.shape.is_bent = false;
  const Bytes straight = body_of(frame);
  EXPECT_EQ(straight.size(), ShapeBody().body.size() - 8 - ShapeBody::kSection);
  ASSERT_TRUE(decode_body(straight, decoded).is_good());
  EXPECT_FALSE(decoded.needles[0].state.shape.is_bent);
  frame.needles[0].state.shape.is_bent = true;
  frame.needles[0].state.present = false;  // where it is means nothing
  EXPECT_EQ(body_of(frame).size(), straight.size());
}

TEST(Codec, AShapeOfANeedleThatIsNotThereIsRefused) {
  ShapeBody shape;
  shape.entry(0) = std::byte{7};
  EXPECT_EQ(shape.reason(), "a shape names a needle that is not there");
  ShapeBody absent;
  absent.body[108 + 3] = std::byte{0};  // present
  EXPECT_EQ(absent.reason(), "a shape names a needle that is not there");
}

TEST(Codec, AShapeHasTwoFinitePointsAtLeast) {
  for (const unsigned char points : {0, 1}) {
    ShapeBody shape;
    shape.entry(2) = std::byte{points};
    EXPECT_EQ(shape.reason(), "a needle's shape has fewer than two points");
  }
  ShapeBody large;
  large.entry(3) = std::byte{0xFF};  // 65,297 points
  EXPECT_EQ(large.reason(), "a count is larger than the body");
  for (const std::size_t at : {8u, 40u}) {  // an f64 of the axis, of the deflection
    ShapeBody shape;
    shape.entry(at + 6) = std::byte{0xF0};
    shape.entry(at + 7) = std::byte{0x7F};
    EXPECT_EQ(shape.reason(), "a needle's shape is not finite") << at;
  }
  ShapeBody point;
  point.entry(ShapeBody::kEntry - 2) = std::byte{0xC0};  // NaN
  point.entry(ShapeBody::kEntry - 1) = std::byte{0x7F};
  EXPECT_EQ(point.reason(), "a needle's shape is not finite");
}

TEST(Codec, MoreShapesThanTheSectionHoldsAreRefused) {
  ShapeBody shape;
  shape.body[shape.body.size() - ShapeBody::kSection] = std::byte{200};
  EXPECT_EQ(shape.reason(), "a count is larger than the body");
}

TEST(Codec, AShapeOfAnotherNumberOfPointsKeepsItsCourse) {
  for (const std::size_t count : {2u, 3u, 33u}) {
    ShapeBody shape;
    shape.body.resize(shape.body.size() - 12 * NeedleShape::kPoints);
    shape.body[shape.body.size() - 54] = static_cast<std::byte>(count);
    put_u32(shape.body, shape.body.size() - 56 - 8, static_cast<std::uint32_t>(4 + 56 + 12 * count));
    ByteWriter writer(shape.body);
    for (std::size_t i = 0; i < count; ++i) {
      const float along = 200.0f * static_cast<float>(i) / static_cast<float>(count - 1);
      writer.floats(std::array{1.0f, 2.0f, along});
    }
    FrameMessage decoded;
    ASSERT_TRUE(decode_body(shape.body, decoded).is_good()) << count;
    const NeedleShape& read = decoded.needles[0].state.shape;
    for (std::size_t k = 0; k < NeedleShape::kPoints; ++k)
      EXPECT_NEAR((read.points[k] - Vec3(1, 2, 12.5 * static_cast<double>(k))).norm(), 0, 1e-4) << count;
  }
}

TEST(Codec, ADoseOfMoreStructuresThanTheBodyHoldsIsRefused) {
  Bytes body = body_of(sample_dose());
  DoseMessage decoded;
  body[4] = std::byte{200};
  EXPECT_TRUE(decode_body(body, decoded).is_bad());
}

TEST(Codec, TrianglesMustNameSurfaceVertices) {
  TopologyMessage topology = sample_topology(), decoded;
  topology.triangles[2][1] = 4;  // an interior point
  EXPECT_TRUE(decode_body(body_of(topology), decoded).is_bad());
}

TEST(Codec, AFrameWithoutACertificateSaysNothingOfTheField) {
  FrameMessage frame = sample_frame(), decoded = sample_frame();
  frame.certificate.reset();
  ASSERT_TRUE(decode_body(body_of(frame), decoded).is_good());
  EXPECT_FALSE(decoded.certificate);
  EXPECT_EQ(decoded.pose_history.size(), 2u);
}

TEST(Codec, AFrameOfAnEarlierDaemonTellsNoLag) {
  constexpr std::size_t kLagBytes = 8 + 4;
  FrameMessage frame = sample_frame(), decoded = sample_frame();
  const Bytes body = body_of(frame);
  frame.lag_mm = Certificate::kNotKnown;
  const Bytes earlier = body_of(frame);
  ASSERT_EQ(earlier.size(), body.size() - kLagBytes);
  ASSERT_TRUE(decode_body(earlier, decoded).is_good());
  EXPECT_TRUE(std::isnan(decoded.lag_mm)) << "what the message held before is gone";
  EXPECT_EQ(body_of(decoded), earlier);
}

TEST(Codec, ALagOfZeroIsToldAndIsRoundedToF32Otherwise) {
  FrameMessage frame = sample_frame(), decoded;
  for (const double lag_mm : {0.0, 0.1, 11.0}) {
    frame.lag_mm = lag_mm;
    ASSERT_TRUE(decode_body(body_of(frame), decoded).is_good());
    EXPECT_EQ(decoded.lag_mm, static_cast<double>(static_cast<float>(lag_mm)));
  }
}

TEST(Codec, AVerdictOfALaterVersionReadsAsUnknownAndStaysItself) {
  FrameMessage frame = sample_frame(), decoded;
  frame.certificate->verdict = static_cast<Verdict>(9);
  ASSERT_TRUE(decode_body(body_of(frame), decoded).is_good());
  ASSERT_TRUE(decoded.certificate);
  EXPECT_EQ(to_string(decoded.certificate->verdict), "unknown");
  EXPECT_EQ(body_of(decoded), body_of(frame));
}

TEST(Codec, ACertificateOfAnotherLengthIsRefused) {
  FrameMessage frame = sample_frame(), decoded;
  frame.has_pose_history = false;
  frame.poses_of_needles.clear();
  frame.needles[0].state.shape.is_bent = false;
  frame.lag_mm = Certificate::kNotKnown;
  const Bytes body = body_of(frame);
  for (const std::size_t length : {0u, 79u, 81u}) {
    Bytes other = body;
    put_u32(other, body.size() - 84, static_cast<std::uint32_t>(length));
    other.resize(body.size() - 80 + length);
    EXPECT_TRUE(decode_body(other, decoded).is_bad()) << length;
  }
}

TEST(Codec, UnknownSectionsAreSkipped) {
  FrameMessage frame = sample_frame(), decoded;
  frame.certificate.reset();
  frame.has_pose_history = false;
  frame.pose_history.clear();
  frame.has_seeds = false;
  frame.poses_of_needles.clear();
  frame.needles[0].has_forces = false;
  frame.needles[0].state.shape.is_bent = false;
  frame.lag_mm = Certificate::kNotKnown;
  Bytes body = body_of(frame);
  body.resize(body.size() - 4);  // its empty list of sections
  ByteWriter writer(body);
  writer.u32(1);
  writer.u32(77);  // id 77
  writer.u32(3);
  for (int i = 0; i < 3; ++i) writer.u8(9);
  const DecodeResult result = decode_body(body, decoded);
  EXPECT_TRUE(result.is_good()) << result.reason;
  EXPECT_FALSE(decoded.has_pose_history);
}

TEST(Codec, TextsThatAreNotUtf8AreRefused) {
  for (const char* bad : {"\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xF8\x88\x80\x80",
                          "\x80", "\xE2\x82", "a\x1B[2J", "\xC2\x9B", "\x7F"}) {
    EXPECT_FALSE(is_wire_text(bad)) << bad;
    Bytes body = body_of(sample_event());
    body.resize(16);
    ByteWriter writer(body);
    const std::string_view text = bad;
    writer.u16(static_cast<std::uint16_t>(text.size()));
    for (const char c : text) writer.u8(static_cast<std::uint8_t>(c));
    EventMessage event;
    EXPECT_TRUE(decode_body(body, event).is_bad()) << bad;
  }
  EXPECT_TRUE(is_wire_text("Nadel 18 G, \xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80"));
}

TEST(Codec, TextsAreRepairedAndCutAtACharacterWhenEncoded) {
  EventMessage event = sample_event(), decoded;
  event.text = "a\nb\xFF";
  ASSERT_TRUE(decode_body(body_of(event), decoded).is_good());
  EXPECT_EQ(decoded.text, "a?b?");
  event.text = std::string(kMaxTextBytes - 1, 'x').append("\xC3\xA4");
  ASSERT_TRUE(decode_body(body_of(event), decoded).is_good());
  EXPECT_EQ(decoded.text, std::string(kMaxTextBytes - 1, 'x'));
}

TEST(Codec, LimitsOfTextsHold) {
  HelloMessage hello = sample_hello(), decoded;
  hello.name = std::string(kMaxNameBytes, 'n');
  Bytes body = body_of(hello);
  EXPECT_TRUE(decode_body(body, decoded).is_good());
  body[40] = std::byte{kMaxNameBytes + 1};
  body.insert(body.begin() + 42, std::byte{'n'});
  EXPECT_TRUE(decode_body(body, decoded).is_bad());
}

}  // namespace
}  // namespace brachy::net::test
