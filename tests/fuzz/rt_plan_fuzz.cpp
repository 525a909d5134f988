// An RTPLAN, from behind "DICM" on. What is read of a permanent implant is fitted to a template, and a valid plan.
#include "apps/import/case/case_plan.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "tests/fuzz/fuzzed_dicom.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  reads_dicom(data, size, [](const DicomFile& file) {
    const RtBrachyPlan plan = read_rt_plan(file);
    EXPECT_FALSE(plan.channels.empty());
    for (const RtChannel& channel : plan.channels) EXPECT_FALSE(channel.points.empty());
    if (!plan.is_permanent()) return;
    reads("file: ", [&] {
      const CasePlan fitted = fit_plan(plan, TemplateGrid(), "file");
      EXPECT_FALSE(fitted.plan.needles.empty());
      (void)to_toml(fitted.plan);
    });
  });
  return 0;
}

}  // namespace brachy::fuzz
