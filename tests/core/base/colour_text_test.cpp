#include "core/base/colour_text.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

TEST(ColourText, ComesBackFromItsText) {
  EXPECT_EQ(colour_text({255, 0, 10}), "#ff000a");
  EXPECT_EQ(colour_from("#ff000a"), (Rgb{255, 0, 10}));
  EXPECT_EQ(colour_from("#FF000A"), (Rgb{255, 0, 10}));
}

TEST(ColourText, OfAnotherFormIsNone) {
  for (const char* text : {"", "#", "ff000a", "#ff000", "#ff000a0", "#ff00g0", "#-1-1-1", "# 1 1 1", "red"})
    EXPECT_EQ(colour_from(text), std::nullopt) << text;
}

}  // namespace
}  // namespace brachy
