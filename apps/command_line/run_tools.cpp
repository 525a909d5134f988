#include <iostream>
#include <utility>

#include "apps/command_line/command_line_parts.h"
#include "apps/command_line/tool.h"
#include "core/base/escaped.h"

namespace brachy {
namespace {

/// A declared tool of the program.
struct Command {
  CLI::App* line;
  std::function<int()> run;
  OptionList list;
};

Command declare(CLI::App& app, const Tool& tool) {
  CLI::App* line = app.add_subcommand(tool.name, tool.summary);
  if (!tool.declare)
    return {line->prefix_command(), []() -> int { throw UsageError("the command must come first"); },
            OptionList(*line)};
  line->footer(tool.details);
  OptionList list(*line);
  std::function<int()> run = tool.declare(list);
  return {line, std::move(run), std::move(list)};
}

int run(const std::string& program, const Command& command) {
  try {
    command.list.check_outputs();
    return command.run();
  } catch (const UsageError& e) {
    std::cerr << program << " " << command.line->get_name() << ": " << escaped(e.what()) << "\nTry --help.\n";
    return kExitBadInput;
  } catch (const UserError& e) {
    std::cerr << program << ": " << escaped(e.what()) << "\n";
    return kExitBadInput;
  } catch (const std::exception& e) {
    std::cerr << program << ": " << escaped(e.what()) << "\n";
    return kExitFailed;
  }
}

}  // namespace

int run_tools(const std::string& program, const std::string& summary, std::span<const Tool> tools, int argc,
              char** argv) {
  CLI::App app(summary, program);
  app.require_subcommand(1);
  app.footer(program + " COMMAND --help describes a command, with examples.");
  std::vector<Command> commands;
  for (const Tool& tool : tools) commands.push_back(declare(app, tool));
  const auto* json = app.add_flag("--json")->description("with --version: print it as JSON");
  if (const std::optional<int> exit_code = parse_arguments(app, argc, argv)) return *exit_code;
  if (*json) {
    std::cerr << program << ": --json before a command goes with --version alone\nTry --help.\n";
    return kExitBadInput;
  }
  for (const Command& command : commands)
    if (*command.line) return run(program, command);
  return kExitBadInput;
}

}  // namespace brachy
