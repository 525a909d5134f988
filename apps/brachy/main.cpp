#include <iostream>

#include "apps/brachy/tools.h"
#include "apps/command_line.h"
#include "core/error.h"

namespace {

using namespace brachy;

struct Run {
  int operator()(const ReplayOptions& o) const { return o.connect ? replay_live(o) : replay_offline(o); }
  int operator()(const WatchOptions& o) const { return watch(o); }
  int operator()(const RecordOptions& o) const { return record(o); }
  int operator()(const RelayOptions& o) const { return relay(o); }
  int operator()(const ExportOptions& o) const { return export_recording(o); }
  int operator()(const DeformOptions& o) const { return deform(o); }
  int operator()(const DoseOptions& o) const { return dose(o); }
  int operator()(const InspectOptions& o) const { return inspect(o); }
  int operator()(const CompareOptions& o) const { return compare(o); }
  int operator()(const StabilityOptions& o) const { return stability(o); }
  int operator()(const ZWidthOptions& o) const { return zwidth(o); }
  int operator()(const AdviseOptions& o) const { return advise(o); }
  int operator()(const PlotForceOptions& o) const { return plot_force(o); }
  int operator()(const PlanOptions& o) const { return plan(o); }
  int operator()(const MetricsOptions& o) const { return metrics(o); }
  int operator()(const ScoreOptions& o) const { return score(o); }
  int operator()(const TokenOptions& o) const { return token(o); }
};

}  // namespace

int main(int argc, char** argv) {
  std::optional<int> exit_code;
  const ToolOptions options = parse_tool_line(argc, argv, exit_code);
  if (exit_code) return *exit_code;
  try {
    return std::visit(Run{}, options);
  } catch (const UserError& e) {
    std::cerr << "brachy: " << e.what() << "\n";
    return kExitBadInput;
  } catch (const std::exception& e) {
    std::cerr << "brachy: " << e.what() << "\n";
    return kExitFailed;
  }
}
