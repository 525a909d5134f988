#include "apps/session/session_states.h"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

SessionFolder states_in(const TempFolder& folder) {
  return SessionFolder::make(folder / "");
}

std::vector<std::byte> some_bytes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(count);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random() % 7);
  return bytes;
}

TEST(SessionStates, TheNewestThatIsNotLaterIsFound) {
  const TempFolder folder;
  for (const double t_s : {10.0, 20.005, 100.0})
    write_session_state(states_in(folder), t_s, some_bytes(50'000, static_cast<unsigned>(t_s)));
  folder.write("states/notes.txt", "no state");
  folder.write("states/000000015.bin.part", "a state that was not finished");
  EXPECT_EQ(load_session_state(states_in(folder), 10).t_s, 10);
  EXPECT_EQ(load_session_state(states_in(folder), 20).t_s, 10);
  EXPECT_EQ(load_session_state(states_in(folder), 99).t_s, 20.005);
  EXPECT_EQ(load_session_state(states_in(folder), 1e6).bytes, some_bytes(50'000, 100));
  EXPECT_THROW(load_session_state(states_in(folder), 9), UserError);
}

TEST(SessionStates, WithoutAnyTheFolderIsNamed) {
  const TempFolder folder;
  try {
    load_session_state(states_in(folder), 30);
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find((folder / "states").string()), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("every 10 s"), std::string::npos) << e.what();
  }
}

// Every byte changed, and every length cut: refused; only in the bits that fill deflate's last byte nothing is lost.
TEST(SessionStates, ADamagedOneIsRefused) {
  const TempFolder folder;
  const auto bytes = some_bytes(3000, 1);
  write_session_state(states_in(folder), 10, bytes);
  const std::string file = (folder / "states" / "00010.000.bin").string(), whole = read_file(file);
  ASSERT_GT(whole.size(), 100u);
  int taken = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0x20);
    folder.write("states/00010.000.bin", changed);
    try {
      EXPECT_EQ(load_session_state(states_in(folder), 10).bytes, bytes) << i;
      ++taken;
    } catch (const UserError& e) {
      EXPECT_NE(std::string(e.what()).find("00010.000.bin"), std::string::npos) << e.what();
    }
    folder.write("states/00010.000.bin", whole.substr(0, i));
    EXPECT_THROW(load_session_state(states_in(folder), 10), UserError) << i;
  }
  EXPECT_LE(taken, 1);
}

TEST(SessionStates, WhatCannotBeWrittenIsSaidAndLeavesNothingHalf) {
  const TempFolder folder;
  folder.write("states", "a file where the folder should be");
  EXPECT_THROW(write_session_state(states_in(folder), 10, some_bytes(100, 1)), std::runtime_error);
  EXPECT_EQ(read_file(folder / "states"), "a file where the folder should be");
}

}  // namespace
}  // namespace brachy
