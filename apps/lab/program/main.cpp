#include <iostream>

#include "apps/command_line/options.h"
#include "apps/lab/program/study.h"
#include "core/base/error.h"
#include "core/base/escaped.h"

namespace {

using namespace brachy;

struct Run {
  int operator()(const CompareOptions& o) const { return compare(o); }
  int operator()(const StabilityOptions& o) const { return stability(o); }
  int operator()(const TicksOptions& o) const { return ticks(o); }
  int operator()(const LagOptions& o) const { return lag(o); }
  int operator()(const ZWidthOptions& o) const { return zwidth(o); }
  int operator()(const DeflectionOptions& o) const { return deflection(o); }
};

}  // namespace

int main(int argc, char** argv) {
  std::optional<int> exit_code;
  const StudyOptions options = parse_study_line(argc, argv, exit_code);
  if (exit_code) return *exit_code;
  // The prefix of messages of `brachy compare`.
  try {
    return std::visit(Run{}, options);
  } catch (const UserError& e) {
    std::cerr << "brachy: " << escaped(e.what()) << "\n";
    return kExitBadInput;
  } catch (const std::exception& e) {
    std::cerr << "brachy: " << escaped(e.what()) << "\n";
    return kExitFailed;
  }
}
