// A plan as TOML, or as CSV where the first byte is odd. A valid plan survives writing and reading.
#include "core/brachytherapy/plan/plan_file.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const unsigned choice = script.u8();
  const bool is_csv = choice % 2 != 0;
  const std::string text = text_of(script.rest());
  const TemplateGrid grid = TemplateGrid().named(choice & 2 ? "right" : "left", (choice & 4) != 0);
  const double needle_length_mm = NeedleSettings().length_mm;
  Plan plan;
  const bool is_read = reads_lines("plan", [&] {
    plan = (is_csv ? parse_plan_csv : parse_plan_toml)(text, "plan", grid, needle_length_mm);
  });
  if (!is_read) return 0;
  EXPECT_FALSE(plan.needles.empty());
  EXPECT_EQ(plan.seeds(grid).size(), plan.seed_count());
  EXPECT_TRUE(parse_plan_toml(to_toml(plan, grid), "again", grid, needle_length_mm) == plan)
      << to_toml(plan, grid);
  EXPECT_TRUE(parse_plan_csv(to_csv(plan, grid), "again", grid, needle_length_mm) == plan)
      << to_csv(plan, grid);
  return 0;
}

}  // namespace brachy::fuzz
