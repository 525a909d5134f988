// A source file, or, where the first byte is odd, a plan of catheters. A source that is accepted gives finite doses
// everywhere; a plan survives writing and reading.
#include <cmath>

#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/source_tables.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {
namespace {

void check_source(const std::string& text) {
  SourceTables tables;
  if (!reads_lines("source", [&] { tables = parse_source(text, "source"); })) return;
  const Tg43Source source = tables.view(SourceModel::kFirstOfFiles);
  for (const double along : {-300.0, -20.0, -1.0, 0.0, 0.5, 7.0, 90.0})
    for (const double away : {0.0, 0.3, 4.0, 250.0}) {
      const double rate = dose_rate_per_u(source, along, away);
      EXPECT_TRUE(rate >= 0 && std::isfinite(rate)) << along << " " << away;
    }
}

void check_plan(const std::string& text) {
  const TemplateGrid grid;
  HdrPlan plan;
  if (!reads_lines("plan", [&] { plan = parse_hdr_plan(text, "plan", grid, 200); })) return;
  EXPECT_TRUE(plan.dwell_count() > 0 && plan.catheters.size() <= ImplantSettings::kMaxCatheters);
  EXPECT_TRUE(is_hdr_plan(text));
  EXPECT_TRUE(parse_hdr_plan(to_toml(plan, grid), "again", grid, 200) == plan) << to_toml(plan, grid);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const bool is_plan = script.u8() % 2 != 0;
  const std::string text = text_of(script.rest());
  if (is_plan)
    check_plan(text);
  else
    check_source(text);
  return 0;
}

}  // namespace brachy::fuzz
