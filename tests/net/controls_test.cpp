// Requests of an operator and their answers, and the messages for a viewer of the surface alone.
#include "tests/net/net_testing.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

struct ControlsTest : ServerFixture {
  std::unique_ptr<Recorder> join_with(Role role, std::uint32_t subscription) {
    ClientOptions options;
    options.role = role;
    options.subscription = subscription;
    auto client = join(options);
    EXPECT_TRUE(until([&] { return client->welcomes == 1; }));
    return client;
  }
};

ControlMessage plain(ControlAction action) {
  ControlMessage message;
  message.action = action;
  return message;
}

TEST_F(ControlsTest, AnOperatorsControlIsDoneAndEverybodyIsToldTheState) {
  start();
  const auto viewer = join_as(Role::kViewer, "viewer");
  const auto boss = join_with(Role::kOperator, 0);
  ASSERT_TRUE(until([&] { return viewer->welcomes == 1; }));
  boss->client.control({ControlAction::kModel, false, 18.5, "elastic"});
  ASSERT_TRUE(
      until([&] { return !viewer->states.empty() && viewer->states.back().controls.flags == kScriptPlays; }));
  ASSERT_EQ(controls.size(), 1u);
  EXPECT_EQ(controls[0].first.action, ControlAction::kModel);
  EXPECT_EQ(controls[0].first.support_radius_mm, 18.5);
  EXPECT_EQ(controls[0].first.kernel, "elastic");
  EXPECT_TRUE(controls[0].second.starts_with("client (127.0.0.1:")) << controls[0].second;
  EXPECT_EQ(viewer->states.back().controls.kernel, "psi31");
  EXPECT_TRUE(boss->errors.empty());
}

TEST_F(ControlsTest, WhatCannotBeDoneIsAnsweredWithTheReason) {
  control_refusal = "a session is being recorded";
  start();
  const auto boss = join_with(Role::kOperator, 0);
  boss->client.control(plain(ControlAction::kReset));
  ASSERT_TRUE(until([&] { return !boss->errors.empty(); }));
  EXPECT_EQ(boss->errors[0].code, ErrorCode::kControlRefused);
  EXPECT_FALSE(boss->errors[0].fatal);
  EXPECT_EQ(boss->errors[0].text, control_refusal);
  EXPECT_GT(boss->errors[0].about_sequence, 1u);
}

TEST_F(ControlsTest, ViewersAndDevicesHaveNoControls) {
  start();
  for (const Role role : {Role::kViewer, Role::kDevice}) {
    const auto client = join_with(role, 0);
    client->client.control(plain(ControlAction::kReset));
    ASSERT_TRUE(until([&] { return !client->errors.empty(); }));
    EXPECT_EQ(client->errors[0].code, ErrorCode::kNotOperator);
    EXPECT_TRUE(client->client.is_open());
  }
  EXPECT_TRUE(controls.empty());
}

TEST_F(ControlsTest, MoreThanTenControlsASecondAreRefusedAndCounted) {
  start();
  const auto boss = join_with(Role::kOperator, 0);
  for (int i = 0; i < 30; ++i) boss->client.control(plain(ControlAction::kPlay));
  ASSERT_TRUE(until([&] { return controls.size() + boss->errors.size() == 30; }));
  EXPECT_GE(controls.size(), 10u);
  EXPECT_GE(boss->errors.size(), 10u);
}

TEST_F(ControlsTest, AnOperatorPressesTheButtonOfTheDaemonsOwnDeviceOnly) {
  start();
  const auto boss = join_with(Role::kOperator, 0);
  boss->client.press(0, true);
  ASSERT_TRUE(until([&] { return !boss->errors.empty(); }));
  EXPECT_EQ(boss->errors[0].code, ErrorCode::kNotDevice);
  ASSERT_TRUE(server->hold_lease(0, "script"));
  boss->client.press(0, true);
  ASSERT_TRUE(until([&] { return drops.size() == 1; }));
  EXPECT_EQ(drops[0], (std::pair<std::uint16_t, bool>{0, true}));
  boss->client.press(7, true);  // no such needle
  ASSERT_TRUE(until([&] { return boss->errors.size() == 2; }));
}

TEST_F(ControlsTest, TheSceneComesToWhoAsksForIt) {
  start();
  server->set_scene(sample_scene());
  const auto asks = join_with(Role::kViewer, kSubscribeScene);
  const auto does_not = join_with(Role::kViewer, 0);
  publish();
  ASSERT_TRUE(until([&] { return !asks->frames.empty() && !does_not->frames.empty(); }));
  ASSERT_EQ(asks->scenes.size(), 1u);
  EXPECT_EQ(body_of(asks->scenes[0]), body_of(sample_scene()));
  EXPECT_TRUE(does_not->scenes.empty());
  EXPECT_EQ(asks->welcome.subscription, kSubscribeScene);
}

TEST_F(ControlsTest, ASurfaceViewerGetsTheSurfaceAloneBitForBit) {
  start();
  const auto surface = join_with(Role::kViewer, kSubscribeSurface);
  const auto volume = join_with(Role::kViewer, 0);
  for (std::size_t i = 1; i <= 12; ++i) {
    publish();
    ASSERT_TRUE(until([&] { return surface->frames.size() == i && volume->frames.size() == i; }));
    const auto& all = volume->client.mesh().positions();
    const auto& some = surface->client.mesh().positions();
    ASSERT_EQ(some.size(), 3 * tissue.surface_count);
    EXPECT_TRUE(std::equal(some.begin(), some.end(), all.begin())) << i;
  }
  EXPECT_NE(surface->topology.hash, volume->topology.hash);
  EXPECT_EQ(surface->welcome.topology_hash, surface->topology.hash);
  EXPECT_EQ(surface->topology.rest_vertices.size(), 3 * tissue.surface_count);
  EXPECT_EQ(surface->topology.triangles, volume->topology.triangles);
  EXPECT_EQ(surface->frames[0].point_count, tissue.surface_count);
  EXPECT_LT(surface->client.bytes_received(), volume->client.bytes_received());
}

}  // namespace
}  // namespace brachy::net::test
