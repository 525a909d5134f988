#include "apps/command_line/command_line_parts.h"

#include <algorithm>
#include <iostream>
#include <utility>
#include <vector>

#include "apps/command_line/exit_code.h"
#include "core/base/escaped.h"

namespace brachy {

// CLI::Range lets NaN through: no comparison holds for it.
CLI::Validator between(double least, double most) {
  const CLI::Range range(least, most);
  return {[range](std::string& text) -> std::string {
            double value = 0;
            if (!CLI::detail::lexical_cast(text, value) || !(value == value))
              return "needs a number, not '" + text + "'";
            return range(text);
          },
          range.get_description()};
}

CLI::Validator whole_between(int least, int most) {
  const CLI::Range range(least, most);
  return {[range](std::string& text) -> std::string {
            int value = 0;
            if (!CLI::detail::lexical_cast(text, value)) return "needs a whole number, not '" + text + "'";
            return range(text);
          },
          range.get_description()};
}

CLI::Validator durations() {
  return between(0.001, 1e7);
}

CLI::Validator simd_choices() {
  return CLI::IsMember({"auto", "generic", "sse4", "avx2", "avx512"});
}

namespace {

/// Insertions, deletions and replacements that make `b` of `a`.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

/// "; did you mean '--port'?" where an argument that was not expected looks like an option that there is; else "".
std::string suggestion(const CLI::App& app) {
  const CLI::App* used = &app;  // the command on the line
  while (!used->get_subcommands().empty()) used = used->get_subcommands().front();
  for (const std::string& given : app.remaining(true)) {
    if (!given.starts_with("--")) continue;
    const std::string name = given.substr(2, given.find('=') - 2);
    std::string nearest;
    for (const CLI::Option* option : used->get_options())
      for (const std::string& known : option->get_lnames())
        if (nearest.empty() || edits(name, known) < edits(name, nearest)) nearest = known;
    if (!nearest.empty() && edits(name, nearest) <= std::max<std::size_t>(2, name.size() / 3))
      return "; did you mean '--" + nearest + "'?";
  }
  return "";
}

/// What is wrong with a first argument that is neither an option nor a command; "": nothing.
std::string first_argument_fault(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || *argv[1] == '-' || *argv[1] == 0) return "";
  const std::string given = argv[1];
  std::string nearest;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string& name = command->get_name();
    if (name == given) return "";
    if (nearest.empty() || edits(given, name) < edits(given, nearest)) nearest = name;
  }
  if (nearest.empty()) return "";
  if (given.ends_with(".toml") && app.get_option_no_throw("--config"))
    return "a scene file comes after --config: --config " + given;
  return "there is no command '" + given + "'; did you mean '" + nearest + "'?";
}

}  // namespace

// CLI11's own exit codes are 100 and up; ours are ExitCode.
std::optional<int> parse_arguments(CLI::App& app, int argc, char** argv) {
  app.set_version_flag(
      "--version",
      [&] { return app.count("--json") ? version_json(app.get_name()) : version_text(app.get_name()); },
      "print version and protocol, with --json also what it is built on, and exit");
  app.failure_message([](const CLI::App* a, const CLI::Error& e) {
    return a->get_name() + ": " + escaped(e.what()) + "\nTry --help.\n";
  });
  if (const std::string fault = first_argument_fault(app, argc, argv); !fault.empty()) {
    std::cerr << app.get_name() << ": " << escaped(fault) << "\nTry --help.\n";
    return kExitBadInput;
  }
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    // A mistyped option is also why one that is required is missing.
    const std::string hint = e.get_exit_code() == 0 ? "" : suggestion(app);
    if (hint.empty()) return app.exit(e) == 0 ? kExitOk : kExitBadInput;
    std::cerr << app.get_name() << ": " << escaped(e.what() + hint) << "\nTry --help.\n";
    return kExitBadInput;
  }
}

}  // namespace brachy
