#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/lab/slices/slice.h"

namespace brachy {

// The commands of brachy-study: the options of each, after checking, and the function that runs it. Each function
// returns an ExitCode (apps/command_line/options.h) and throws UserError for bad input.

/// Of what runs models on reference scenes and reports rows.
struct ReferenceRunOptions {
  std::optional<std::filesystem::path> references;      ///< none: the installed ones, or the sources'
  std::optional<std::filesystem::path> json, markdown;  ///< files to write
  std::vector<std::string> models, scenes;              ///< beginnings of names; empty: all
  bool quick = false;
};

/// `quick`: listed models only, ticks timed for less long.
struct CompareOptions : ReferenceRunOptions {
  std::optional<std::filesystem::path> beads;  ///< measured beads instead of reference scenes
  std::optional<Slice> slice;                  ///< of the rows; written to `json`
  std::vector<std::filesystem::path> merge;    ///< slices' files, instead of running anything
};

struct StabilityOptions {
  /// none: the built-in defaults, which are config/prostate.toml's
  std::optional<std::filesystem::path> scene;
  std::optional<std::filesystem::path> json;  ///< file to write
  std::optional<std::filesystem::path> out;   ///< folder of the table and the charts' data
  std::vector<std::string> sweeps;            ///< names; empty: all
  bool quick = false;                         ///< fewer and smaller cases
  std::optional<Slice> slice;                 ///< of the sweeps; written to `json`
  std::vector<std::filesystem::path> merge;   ///< slices' files, instead of sweeping anything
};

/// `quick`: some of the scenes.
struct TicksOptions : ReferenceRunOptions {
  bool choices = false;  ///< all that "auto" chooses among, without comparators
};

struct LagOptions {
  std::optional<std::filesystem::path> json, markdown;  ///< files to write
  std::optional<std::filesystem::path> daemon_files;    ///< folder for scenes and trajectories
  std::vector<std::string> scenarios;                   ///< beginnings of names; empty: all
};

struct ZWidthOptions {
  double mass_kg = 0.1, damping_n_s_per_mm = 0.0005;    ///< of the device
  std::optional<std::filesystem::path> json, markdown;  ///< files to write
  bool quick = false;                                   ///< fewer cases
};

struct DeflectionOptions {
  std::vector<std::filesystem::path> files;  ///< of one phantom each
  double calibrate_mm = 50;                  ///< of each predicted insertion, what it is told
  double bending_stiffness_nmm2 = 15720, needle_length_mm = 200;
  std::optional<std::filesystem::path> json, markdown;  ///< files to write
};

using StudyOptions = std::variant<CompareOptions, StabilityOptions, TicksOptions, LagOptions, ZWidthOptions,
                                  DeflectionOptions>;

/// Runs every model on every reference scene: errors, times, memory; or scores models against measured beads.
int compare(const CompareOptions& options);
/// Sweeps every method until it fails.
int stability(const StabilityOptions& options);
/// Measures what a tick of every model shows of large motions.
int ticks(const TicksOptions& options);
/// Measures how far what ticks show is behind whole ticks, of one to seventeen needles.
int lag(const LagOptions& options);
/// Finds the stiffest spring that a device renders stably, against rate and delay.
int zwidth(const ZWidthOptions& options);
/// Fits the needle's bending to measured insertions and predicts others.
int deflection(const DeflectionOptions& options);

/// The command line of brachy-study. The program's name in messages is that of argv[0], since `brachy` forwards to it.
/// Where nothing is left to do (--help, --version, wrong usage, all already printed) `exit_code` is set and the
/// result is unused.
StudyOptions parse_study_line(int argc, char** argv, std::optional<int>& exit_code);

}  // namespace brachy
