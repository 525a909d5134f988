#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "apps/command_line/exit_code.h"

namespace brachy {

// Shared by the files in apps/command_line and apps/lab/program/study_line.cpp. No other file includes CLI11.

CLI::Validator between(double least, double most);  ///< CLI::Range, but NaN is not between
CLI::Validator whole_between(int least, int most);  ///< CLI::Range, which says what is no number
CLI::Validator durations();                         ///< seconds
CLI::Validator simd_choices();

/// Parses, with --version. Returns an exit code where nothing is left to do: --help, --version or an error was printed.
std::optional<int> parse_arguments(CLI::App& app, int argc, char** argv);

/// The text of --version, and its form with --json.
std::string version_text(const std::string& program);
std::string version_json(const std::string& program);

}  // namespace brachy
