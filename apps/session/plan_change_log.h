#pragma once

#include <string>
#include <vector>

#include "apps/session/session_folder.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// The table of changes in a session's directory.
inline constexpr const char* kPlanChangesHeader = "t_s,file,kind,what";
/// Of sessions from before a change's kind was kept; the text tells it ("optimised by …").
inline constexpr const char* kPlanChangesWithoutKindHeader = "t_s,file,what";

enum class PlanChangeKind { kOptimised, kEdited };
const char* to_string(PlanChangeKind kind);  ///< "optimised", "edited"

/// One change of the plan while a session ran.
struct PlanChange {
  double t_s = 0;    ///< session time, to 0.1 s
  std::string file;  ///< the whole plan from then on, in the session's directory: plan_change_1.toml, …
  PlanChangeKind kind = PlanChangeKind::kEdited;
  std::string what;  ///< "optimised by desk (127.0.0.1)"
};

/// The changes in a session's directory, in their order; empty where there are none. An unfinished last line is left
/// out. Throws UserError for a file that cannot be read or is not such a table.
std::vector<PlanChange> load_plan_changes(const SessionFolder& folder);

/// Records changes of the plan in a session's directory, which exists: first the plan under a name of its own, then
/// the row of the table, each by one write(2) before add() returns: kill −9 loses no change that a client was told
/// of. A table without kinds goes on without. Nothing that is there is overwritten. Files are the owner's alone.
/// Threads: one.
class PlanChangeLog {
 public:
  /// Continues the changes of an earlier run. Throws UserError as load_plan_changes.
  explicit PlanChangeLog(SessionFolder folder);

  const std::vector<PlanChange>& changes() const { return changes_; }

  /// `grid`: the plan's. Throws UserError where it cannot be written: then nothing has changed but perhaps a plan that
  /// no row names.
  void add(double t_s, const Plan& whole, const TemplateGrid& grid, PlanChangeKind kind,
           const std::string& what);

 private:
  SessionFolder folder_;
  std::vector<PlanChange> changes_;
  bool has_kinds_ = true;  // the table
};

}  // namespace brachy
