// The table of a plan's changes: kinds, tables from before there were any, after a kill, and what is no table.
#include "apps/session/plan_change_log.h"

#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using test::read_file;
using test::TempFolder;

Plan one_needle() {
  Plan plan;
  plan.needles = {{"D4", 0, "s-s"}};
  return plan;
}

TEST(PlanChangeLog, KeepsTheKindApartFromTheWords) {
  const TempFolder folder;
  PlanChangeLog log(SessionFolder::make(folder / ""));
  log.add(1.25, one_needle(), {}, PlanChangeKind::kEdited, "optimised by hand, said the desk");
  log.add(3, one_needle(), {}, PlanChangeKind::kOptimised, "by desk");
  // The log is still open, as where its process is killed.
  const std::vector<PlanChange> changes = load_plan_changes(SessionFolder::open(folder / ""));
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[0].kind, PlanChangeKind::kEdited);
  EXPECT_EQ(changes[0].what, "optimised by hand, said the desk");
  EXPECT_EQ(changes[0].file, "plan_change_1.toml");
  EXPECT_EQ(changes[1].kind, PlanChangeKind::kOptimised);
  EXPECT_DOUBLE_EQ(changes[1].t_s, 3);
  EXPECT_EQ(PlanChangeLog(SessionFolder::make(folder / "")).changes().size(), 2u);
}

TEST(PlanChangeLog, GoesOnWithATableWithoutKinds) {
  const TempFolder folder;
  folder.write(
      kPlanChangesFile,
      "t_s,file,what\n1.0,plan_change_1.toml,optimised by a, b\n2.0,plan_change_2.toml,edited by c\n");
  PlanChangeLog log(SessionFolder::make(folder / ""));
  ASSERT_EQ(log.changes().size(), 2u);
  EXPECT_EQ(log.changes()[0].kind, PlanChangeKind::kOptimised);
  EXPECT_EQ(log.changes()[0].what, "optimised by a, b");
  EXPECT_EQ(log.changes()[1].kind, PlanChangeKind::kEdited);
  log.add(3, one_needle(), {}, PlanChangeKind::kOptimised, "optimised by d");
  EXPECT_TRUE(read_file(folder / kPlanChangesFile).ends_with("\n3.0,plan_change_3.toml,optimised by d\n"));
  ASSERT_EQ(load_plan_changes(SessionFolder::open(folder / "")).size(), 3u);
  EXPECT_EQ(load_plan_changes(SessionFolder::open(folder / ""))[2].kind, PlanChangeKind::kOptimised);
}

TEST(PlanChangeLog, LeavesOutALineThatAKilledProcessDidNotFinish) {
  const TempFolder folder;
  PlanChangeLog(SessionFolder::make(folder / ""))
      .add(1, one_needle(), {}, PlanChangeKind::kEdited, "edited by a");
  const std::string whole = read_file(folder / kPlanChangesFile);
  folder.write(kPlanChangesFile, whole + "2.0,plan_change_2.toml,edi");
  PlanChangeLog log(SessionFolder::make(folder / ""));
  ASSERT_EQ(log.changes().size(), 1u);
  log.add(2, one_needle(), {}, PlanChangeKind::kOptimised, "optimised by b");
  EXPECT_EQ(read_file(folder / kPlanChangesFile),
            whole + "2.0,plan_change_2.toml,optimised,optimised by b\n");
}

TEST(PlanChangeLog, RefusesWhatIsNoTableOfChanges) {
  for (const char* text :
       {"a,b\n", "t_s,file,kind,what\n1,p.toml,drawn,x\n", "t_s,file,kind,what\n1,p.toml,edited\n",
        "t_s,file,kind,what\n1 s,p.toml,edited,x\n", "t_s,file,kind,what\n1,../p.toml,edited,x\n"}) {
    const TempFolder folder;
    folder.write(kPlanChangesFile, text);
    EXPECT_THROW(load_plan_changes(SessionFolder::open(folder / "")), UserError) << text;
  }
}

}  // namespace
}  // namespace brachy
