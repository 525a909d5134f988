// An RTPLAN, from behind "DICM" on. What is read of a permanent implant is fitted to a template, and a valid plan; of
// another the catheters are a plan that is read back as it was.
#include "apps/import/case/case_catheters.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "tests/fuzz/fuzzed_dicom.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  reads_dicom(data, size, [](const DicomFile& file) {
    const RtBrachyPlan plan = read_rt_plan(file);
    EXPECT_FALSE(plan.channels.empty());
    for (const RtChannel& channel : plan.channels) EXPECT_FALSE(channel.points.empty());
    if (!plan.is_permanent()) {
      reads("file: ", [&] {
        std::vector<ImportedCourse> courses;
        const HdrPlan catheters = *catheters_of(plan, courses, "", "file").hdr;
        EXPECT_GT(catheters.dwell_count(), 0u);
        constexpr double kNeedleMm = 200;
        EXPECT_TRUE(parse_hdr_plan(to_toml(catheters, {}), "written", TemplateGrid(), kNeedleMm) ==
                    catheters);
      });
      return;
    }
    reads("file: ", [&] {
      const CasePlan fitted = fit_plan(plan, TemplateGrid(), "file");
      EXPECT_FALSE(fitted.plan.needles.empty());
      (void)to_toml(fitted.plan, fitted.grid);
    });
  });
  return 0;
}

}  // namespace brachy::fuzz
