// Scenes and plans that are nested or long beyond reason: refused with their line, before they are parsed.
#include "core/base/toml_precheck.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/file/scene_file.h"

namespace brachy {
namespace {

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

std::string scene_error(const std::string& text) {
  try {
    parse_scene(text, "s");
    return "read";
  } catch (const UserError& error) {
    return error.what();
  }
}

std::string plan_error(const std::string& text) {
  try {
    parse_plan_toml(text, "p", TemplateGrid(), 200);
    return "read";
  } catch (const UserError& error) {
    return error.what();
  }
}

/// A file of 62 kB ended the daemon at SIGHUP: the parser's tables are destroyed recursively.
TEST(TomlPrecheck, DepthIsRefusedBeforeAnythingRecurses) {
  for (const int depth : {9, 100, 30'000, 240'000}) {
    const std::string key = repeated("a.", depth) + "a = 1\n", header = "[" + repeated("a.", depth) + "a]\n";
    const std::string array = "a = " + repeated("[", depth) + repeated("]", depth) + "\n";
    const std::string inline_table = "a = " + repeated("{a=", depth) + "1" + repeated("}", depth) + "\n";
    const std::string open_array = "a = " + repeated("[", depth), headers = "[" + header;
    for (const std::string& text : {key, header, array, inline_table, open_array, headers}) {
      if (text.size() + 20 > TomlLimits::kMaxBytes) continue;
      for (const std::string& error : {scene_error("# first\n" + text), plan_error("# first\n" + text)})
        EXPECT_NE(error.find(":2: nested deeper than 8"), std::string::npos) << depth << " " << error;
    }
  }
}

TEST(TomlPrecheck, DotsAndBracketsInStringsAndCommentsDoNotCount) {
  const std::string deep = repeated("[a.", 50);
  const std::vector<std::string> shallow = {
      "# " + deep + "\n",           "a = \"" + deep + "\"\n",
      "a = '" + deep + "'\n",       "a = '''" + deep + "\n'''\n",
      "a = \"\\\"" + deep + "\"\n", "\"" + deep + "\" = 1.5\n",
      "a = ''\nb = \"\"\n",         "a = \"\"\"\n" + deep + "\n\"\"\"\"\n"};
  for (const std::string& text : shallow) EXPECT_FALSE(find_toml_excess(text)) << text;
  EXPECT_TRUE(find_toml_excess("a = \"x\"\n" + deep));
  EXPECT_TRUE(find_toml_excess("a = '''x''''\n" + deep)) << "a quote before the closing three";
  EXPECT_TRUE(find_toml_excess("a = \"\\\\\"\n" + deep)) << "an escaped backslash before the closing quote";
}

TEST(TomlPrecheck, EveryDepthWithinTheLimitIsLeftToTheParser) {
  EXPECT_FALSE(find_toml_excess("[a.b.c.d.e.f.g.h]\na = [[[[[[[[1.5]]]]]]]]\n"));
  const auto excess = find_toml_excess("x = 1\n\n[a.b.c.d.e.f.g.h.i]\n");
  ASSERT_TRUE(excess);
  EXPECT_EQ(excess->line, 3u);
}

TEST(TomlPrecheck, MoreValuesThanAnyFileHasAreRefused) {
  const std::string list = "a = [" + repeated("1,", 60'000) + "1]\n";
  EXPECT_NE(scene_error(list).find("s:1: more than 50000 values"), std::string::npos);
  EXPECT_NE(plan_error(repeated("a=1\n", 60'000)).find("p:50001: more than 50000 values"), std::string::npos);
  const std::string long_file(TomlLimits::kMaxBytes + 1, '\n');
  EXPECT_NE(scene_error(long_file).find("larger than 1 MiB"), std::string::npos);
}

}  // namespace
}  // namespace brachy
