#include "core/base/escaped.h"

#include <gtest/gtest.h>

#include "core/base/utf8.h"

namespace brachy {
namespace {

TEST(Escaped, PrintableTextStaysAsItIs) {
  for (const char* text : {"", "a scene.toml", "Größe 5 µm, 東京", "it's \"quoted\""})
    EXPECT_EQ(escaped(text), text);
}

TEST(Escaped, NothingForgesALineOrSteersATerminal) {
  EXPECT_EQ(escaped("a\nbrachyd: all is well"), "a\\nbrachyd: all is well");
  EXPECT_EQ(escaped("\x1b[2J\t\r"), "\\x1b[2J\\t\\x0d");
  EXPECT_EQ(escaped("\xc2\x9b"
                    "31m"),
            "\\xc2\\x9b31m")
      << "a control character of two bytes";
  EXPECT_EQ(escaped("\xff\xc3("), "\\xff\\xc3(") << "no UTF-8";
  EXPECT_EQ(escaped("C:\\n"), "C:\\\\n") << "the escape itself";
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all += static_cast<char>(byte);
  EXPECT_TRUE(is_printable(escaped(all)));
}

}  // namespace
}  // namespace brachy
