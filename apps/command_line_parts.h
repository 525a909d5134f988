#pragma once

#include <functional>
#include <string>

#include <CLI/CLI.hpp>

#include "apps/options.h"

namespace brachy {

// What the files apps/command_line*.cpp share, and no other includes: CLI11 ends here.

/// One tool's subcommand. `take`, once it was parsed: what was said. Errors: UserError where that does not fit together.
struct ToolLine {
  CLI::App* command;
  std::function<ToolOptions()> take;
};

ToolLine add_replay(CLI::App& app);
ToolLine add_watch(CLI::App& app);
ToolLine add_record(CLI::App& app);
ToolLine add_relay(CLI::App& app);
ToolLine add_export(CLI::App& app);
ToolLine add_deform(CLI::App& app);
ToolLine add_dose(CLI::App& app);
ToolLine add_inspect(CLI::App& app);
ToolLine add_compare(CLI::App& app);
ToolLine add_stability(CLI::App& app);
ToolLine add_zwidth(CLI::App& app);
ToolLine add_advise(CLI::App& app);
ToolLine add_plot_force(CLI::App& app);
ToolLine add_plan(CLI::App& app);
ToolLine add_metrics(CLI::App& app);
ToolLine add_score(CLI::App& app);
ToolLine add_token(CLI::App& app);

/// --units and --frame of a mesh file.
void add_mesh_options(CLI::App& command, std::string& units, std::string& frame);

/// --connect, which is returned, and what goes with it; `what`: the daemon's part in it. `connect` lives as long as `command`.
CLI::Option* add_connect_options(CLI::App& command, ConnectOptions& connect, const char* what);
CLI::Validator between(double least, double most);  ///< CLI::Range, but NaN is not between
CLI::Validator durations();                         ///< seconds
CLI::Validator simd_choices();

/// What --version prints, and with --json.
std::string version_text(const std::string& program);
std::string version_json(const std::string& program);

}  // namespace brachy
