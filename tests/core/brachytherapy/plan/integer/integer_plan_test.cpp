#include "core/brachytherapy/plan/integer/integer_plan.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

const PlanSettings kSmall{"test", SourceModel::kAmersham6711, 145, 200, 256};

IntegerProgramme programme_of() {
  return {load_structures(parse_scene("[tissue]\nphantom_size_mm = [35, 28, 32]", "scene.toml")),
          TemplateGrid(), kSmall, OptimiserSettings()};
}

TEST(IntegerProgramme, NamesEveryBinaryVariableOnce) {
  const IntegerProgramme programme = programme_of();
  const std::string text = programme.text();
  const std::size_t from = text.find("\nBinary\n"), to = text.find("End\n");
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(from) + 8,
                                                text.begin() + static_cast<std::ptrdiff_t>(to), '\n')),
            programme.binaries());
  EXPECT_NE(text.find("needles: + 1 y0"), std::string::npos);
}

TEST(IntegerProgramme, ASolutionBecomesAPlanThatLoads) {
  const IntegerProgramme programme = programme_of();
  const Plan plan = programme.plan_of(
      "Stopped on time - objective value 1.5\n"
      "      0 y0                     1                       0\n"
      "      7 x0                     1                       0\n"
      "      8 x1                     0                       0\n"
      "**    9 x2                     1                       0\n"
      "     12 x3          1.000000001                        0\n");
  EXPECT_GE(plan.seed_count(), 3u);
  EXPECT_LE(plan.needles.size(), 2u);
  EXPECT_EQ(parse_plan_toml(to_toml(plan, {}), "plan", TemplateGrid(), 200), plan);
  EXPECT_NE(user_error([&] { programme.plan_of("Infeasible\n"); }).find("has no seed"), std::string::npos);
}

}  // namespace
}  // namespace brachy
