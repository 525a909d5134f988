#include "core/solve/landmark_slots.h"

#include <gtest/gtest.h>

#include <vector>

namespace brachy {
namespace {

struct Number {
  double value = 0;
  double key() const { return value; }
  bool operator==(const Number&) const = default;
};
using Slots = LandmarkSlots<Number>;

void place(Slots& slots, const std::vector<std::vector<double>>& landmarks) {
  slots.begin(landmarks.size());
  for (std::size_t l = 0; l < landmarks.size(); ++l)
    for (const double value : landmarks[l]) slots.add(l, {value});
  slots.find();
}

TEST(LandmarkSlots, KeepTheirLandmarksWhenOneIsInsertedBefore) {
  Slots slots(8, 4);
  place(slots, {{1, 2}, {3}, {4}});
  const std::size_t of_three = slots.slot(1), of_four = slots.slot(2);
  place(slots, {{1, 2}, {7}, {3}, {4}});
  EXPECT_FALSE(slots.is_fresh(0));
  EXPECT_TRUE(slots.is_fresh(1));
  EXPECT_EQ(slots.slot(2), of_three);
  EXPECT_EQ(slots.slot(3), of_four);
  EXPECT_FALSE(slots.is_fresh(3));
}

TEST(LandmarkSlots, RememberALandmarkThatComesBack) {
  Slots slots(4, 4);
  place(slots, {{1}, {2}});
  place(slots, {{1}});
  place(slots, {{1}, {2}});
  EXPECT_FALSE(slots.is_fresh(1));
}

TEST(LandmarkSlots, ForgetOneWhoseSlotIsNeeded) {
  Slots slots(2, 4);
  place(slots, {{1}, {2}});
  place(slots, {{3}, {2}});
  EXPECT_TRUE(slots.is_fresh(0));
  EXPECT_FALSE(slots.is_fresh(1));
  place(slots, {{1}, {2}});
  EXPECT_TRUE(slots.is_fresh(0));
}

TEST(LandmarkSlots, TellEqualKeysApart) {
  Slots slots(4, 4);
  place(slots, {{1, 2}});
  place(slots, {{2, 1}});
  EXPECT_TRUE(slots.is_fresh(0));
}

TEST(LandmarkSlots, GiveEqualLandmarksSlotsOfTheirOwn) {
  Slots slots(4, 4);
  place(slots, {{1}, {1}});
  EXPECT_NE(slots.slot(0), slots.slot(1));
  place(slots, {{1}, {1}});
  EXPECT_NE(slots.slot(0), slots.slot(1));
  EXPECT_FALSE(slots.is_fresh(0) || slots.is_fresh(1));
}

TEST(LandmarkSlots, KnowAPairInTheOrderInWhichItWasTaken) {
  Slots slots(4, 4);
  place(slots, {{1}, {2}});
  EXPECT_TRUE(slots.take_pair(1, 0));
  EXPECT_FALSE(slots.take_pair(1, 0));
  EXPECT_TRUE(slots.take_pair(0, 1));
  place(slots, {{2}, {1}});
  EXPECT_FALSE(slots.take_pair(1, 0));
  EXPECT_FALSE(slots.take_pair(0, 1));
}

TEST(LandmarkSlots, ForgetThePairsOfALandmarkThatIsReplaced) {
  Slots slots(2, 4);
  place(slots, {{1}, {2}});
  slots.take_pair(1, 0);
  place(slots, {{1}, {3}});
  EXPECT_TRUE(slots.take_pair(1, 0));
  place(slots, {{1}, {2}});
  EXPECT_TRUE(slots.take_pair(1, 0));
}

}  // namespace
}  // namespace brachy
