// Hostile peers of the OpenIGTLink listener: at worst a peer loses its own connection, without affecting others.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/net/igtl/igtl_fixture.h"

namespace brachy::net::igtl {
namespace {

using namespace test;

struct IgtlHostile : IgtlFixture {
  /// Checks that another client is still served.
  ::testing::AssertionResult others_are_served() {
    IgtlPeer other(io, igtl->port());
    other.send_query("STRING");
    return until_ticked(other, [&] { return other.count("POLYDATA") > 1 && other.count("TRANSFORM") > 3; })
               ? ::testing::AssertionSuccess()
               : ::testing::AssertionFailure() << other.received.size() << " messages came";
  }
};

TEST_F(IgtlHostile, AWrongCrcDropsTheMessageAndKeepsTheConnection) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  Bytes wrong = encode_transform({1, "NeedleToRas", 5}, at(9, 9, 9));
  wrong[60] ^= std::byte{1};
  ASSERT_TRUE(peer.send(wrong));
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(1, 2, 3)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1 && peer.count("STATUS") == 1; }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(1, 2, 3));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kChecksumError);
  EXPECT_EQ(igtl->messages_dropped(), 1u);
  EXPECT_FALSE(peer.is_ended());
}

TEST_F(IgtlHostile, AnotherVersionOrAnEndlessBodyEndsTheConnection) {
  start_igtl();
  Bytes version9 = encode_transform({1, "NeedleToRas", 5}, at(9, 9, 9)), endless = version9;
  version9[1] = std::byte{9};
  endless[42] = std::byte{0xff};
  for (const Bytes& bad : {version9, endless, Bytes(200, std::byte{'A'})}) {
    IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send(bad));
    ASSERT_TRUE(until_read(peer, [&] { return peer.is_ended(); }));
    EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kIllegalInstruction);
  }
  EXPECT_TRUE(others_are_served());
  EXPECT_TRUE(poses.empty());
}

TEST_F(IgtlHostile, ATransformOfAnotherSizeIsDropped) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  Bytes twice = encode_transform({1, "NeedleToRas", 5}, at(9, 9, 9));
  twice.resize(twice.size() + 48);
  ASSERT_TRUE(peer.send(with_right_size_and_crc(twice)));
  ASSERT_TRUE(peer.send_query("TRANSFORM", "NeedleToRas"));
  ASSERT_TRUE(until_read(peer, [&] { return peer.count("STATUS") == 2; }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kIllegalInstruction);
  EXPECT_TRUE(poses.empty());
  EXPECT_EQ(server->lease_holder(0), "");
}

TEST_F(IgtlHostile, WhatIsInAPoseIsTheGuardsToJudge) {
  start_igtl();
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_pose("NeedleToRas", at(std::numeric_limits<double>::quiet_NaN(), 0, 0)));
  ASSERT_TRUE(until_read(peer, [&] { return poses.size() == 1; }));
  EXPECT_TRUE(std::isnan(poses[0].X_WN.p.x())) << "as it came";
}

TEST_F(IgtlHostile, BytesInPiecesAndADisconnectInAMessage) {
  start_igtl();
  const Bytes message = encode_transform({1, "NeedleToRas", 5}, at(9, 9, 9));
  for (const std::size_t cut : {1u, 30u, 58u, 60u, 105u}) {
    IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send(std::span<const std::byte>(message).first(cut)));
    ASSERT_TRUE(until([&] { return igtl->client_count() == 1; }));
    peer.close();
    ASSERT_TRUE(until([&] { return igtl->client_count() == 0; }));
  }
  IgtlPeer slow(io, igtl->port());
  for (const std::byte& byte : message) {
    ASSERT_TRUE(slow.send({&byte, 1}));
    io.poll();
  }
  ASSERT_TRUE(until_read(slow, [&] { return poses.size() == 1; }));
  EXPECT_TRUE(others_are_served());
}

TEST_F(IgtlHostile, AFloodOfQueriesIsAnsweredSparingly) {
  start_igtl(std::chrono::milliseconds(60'000));
  publish_both();
  IgtlPeer peer(io, igtl->port());
  Bytes flood;
  for (int i = 0; i < 3000; ++i)
    for (const char* type : {"GET_STATUS", "GET_POLYDATA", "GET_TRANS", "GET_CAPABIL", "STP_TDATA"}) {
      const Bytes query = encode_empty(type, {1, "", 0});
      flood.insert(flood.end(), query.begin(), query.end());
    }
  for (std::size_t i = 0; i < flood.size(); i += 8192) {
    ASSERT_TRUE(peer.send(
        std::span<const std::byte>(flood).subspan(i, std::min<std::size_t>(8192, flood.size() - i))));
    io.poll();
  }
  EXPECT_TRUE(others_are_served());
  peer.take();
  EXPECT_LT(peer.received.size(), 3000u);
  EXPECT_FALSE(peer.is_ended());
}

TEST_F(IgtlHostile, NoiseEndsItsSenderOnly) {
  start_igtl();
  std::mt19937 random(7);
  for (int run = 0; run < 50; ++run) {
    Bytes stream = encode_transform({static_cast<std::uint16_t>(1 + run % 2), "NeedleToRas", 5}, at(9, 9, 9));
    for (int i = 0; i < 6; ++i)
      stream[random() % stream.size()] ^= static_cast<std::byte>(1u << random() % 8);
    IgtlPeer peer(io, igtl->port());
    ASSERT_TRUE(peer.send(stream));
    io.poll();
    peer.close();
  }
  ASSERT_TRUE(until([&] { return igtl->client_count() == 0; }));
  EXPECT_TRUE(others_are_served());
}

// A surface of 120 kB, a client that reads none of it.
struct IgtlStalled : IgtlHostile {
  void start_large(ServerOptions options) {
    tissue = net::test::line_tissue(2000);
    tissue.surface_count = tissue.size();
    simulation = net::test::FakeSimulation(tissue);
    options.send_buffer_bytes = 16 * 1024;
    start_igtl(std::chrono::milliseconds(0), options);
  }
};

TEST_F(IgtlStalled, AStalledClientIsClosedAndDisturbsNobody) {
  ServerOptions options;
  options.stall_timeout = std::chrono::milliseconds(1500);
  start_large(options);
  IgtlPeer stalled(io, igtl->port(), 4096), reader(io, igtl->port());
  ASSERT_TRUE(until_ticked(reader, [&] { return reader.count("POLYDATA") > 30; }));
  ASSERT_TRUE(until_ticked(reader, [&] { return igtl->client_count() == 1; }));
  EXPECT_FALSE(reader.is_ended());
  const std::size_t before = reader.count("POLYDATA");
  EXPECT_TRUE(until_ticked(reader, [&] { return reader.count("POLYDATA") > before + 5; }));
}

TEST_F(IgtlStalled, ATrackerThatOnlySendsIsKept) {
  ServerOptions options;
  options.stall_timeout = std::chrono::milliseconds(1500);
  start_large(options);
  IgtlPeer tracker(io, igtl->port(), 4096), idle(io, igtl->port(), 4096);
  ASSERT_TRUE(until([&] { return igtl->client_count() == 2; }));
  ASSERT_TRUE(until([&] {
    publish_both();
    io.poll();
    return tracker.send_pose("NeedleToRas", at(1, 2, 3)) && igtl->client_count() == 1;
  })) << "the idle one is closed";
  const std::size_t before = poses.size();
  EXPECT_TRUE(until([&] {  // more than one: it has sent more a second than are taken
    clock.advance(std::chrono::milliseconds(1));
    return tracker.send_pose("NeedleToRas", at(1, 2, 3)) && poses.size() > before;
  }));
}

TEST_F(IgtlStalled, AClientThatWasAsleepGetsTheNewest) {
  ServerOptions options;
  options.stall_timeout = std::chrono::minutes(1);  // it sleeps for 10 s
  start_large(options);
  IgtlPeer sleeper(io, igtl->port(), 4096), reader(io, igtl->port());
  ASSERT_TRUE(until_ticked(reader, [&] { return reader.count("POLYDATA") > 100; }));
  const auto newest = simulation.state().mesh.deformed_vertices;
  ASSERT_TRUE(until_read(
      sleeper, [&] { return sleeper.count("POLYDATA") > 0 && sleeper.last("POLYDATA").points() == newest; }));
  EXPECT_LT(sleeper.count("POLYDATA"), 5u) << "one in flight, one in the machine's buffers, one pending";
}

}  // namespace
}  // namespace brachy::net::igtl
