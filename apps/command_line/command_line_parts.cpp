#include "apps/command_line/command_line_parts.h"

#include "apps/command_line/exit_code.h"
#include "core/base/escaped.h"

namespace brachy {

// CLI::Range lets NaN through: no comparison holds for it.
CLI::Validator between(double least, double most) {
  const CLI::Range range(least, most);
  return {[range](std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && !(value == value))
              return "needs a number, not '" + text + "'";
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

// CLI11's own exit codes are 100 and up; ours are ExitCode.
std::optional<int> parse_arguments(CLI::App& app, int argc, char** argv) {
  app.set_version_flag(
      "--version",
      [&] { return app.count("--json") ? version_json(app.get_name()) : version_text(app.get_name()); },
      "print version and protocol, with --json also what it is built on, and exit");
  app.failure_message([](const CLI::App* a, const CLI::Error& e) {
    return a->get_name() + ": " + escaped(e.what()) + "\nTry --help.\n";
  });
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitBadInput;
  }
}

}  // namespace brachy
