#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/score/score.h"

namespace brachy {

/// A bound that a session must keep to pass.
struct ExerciseBound {
  std::string key;  ///< "mean_error_mm_at_most"; the list is in exercise.cpp
  double limit = 0;
};

/// A task for a trainee: a scene with its plan, what is asked, and what passes (config/exercises).
struct Exercise {
  std::string name, asks;
  std::filesystem::path scene;        ///< its plan.file is the exercise's plan
  std::vector<ExerciseBound> bounds;  ///< in the file's terms, at least one
  bool needs_implant_goals = false;   ///< all goals of the implant must be met
  std::string text = {};              ///< the whole file
};

/// Reads a TOML file: name, asks, scene (relative to the file), and [passes] with bounds and `implant_goals`. Unknown
/// keys are refused. Throws UserError "file:line: what; fix", also where the scene is not there, or the file has more
/// than kMostExerciseBytes.
inline constexpr std::size_t kMostExerciseBytes = 65536;
Exercise load_exercise(const std::filesystem::path& file);

/// The name in an exercise's text; empty: it has none.
std::string exercise_name_in(const std::string& text);
/// An exercise from its whole text, as a session's manifest keeps it; `file` is for messages, and the scene need not be
/// there any more. Throws UserError.
Exercise exercise_in(const std::string& text, const std::filesystem::path& file);

/// An exercise of a directory of them.
struct ExerciseFile {
  std::filesystem::path file;
  Exercise exercise;
  bool is_of_scene = false;  ///< its scene is the one that was asked about
};

/// The exercises that lie with a scene file: in its directory, in the one above, and in "exercises" below; by name. A
/// file counts as one where it has a table [passes], and belongs to this user, to root or to the scene's owner: what
/// others put beside it is no exercise. Files with mistakes, and all beyond the first kMostExerciseFiles TOML files of
/// a directory, are left out; `refusals` gets the reasons.
inline constexpr std::size_t kMostExerciseFiles = 1000;
std::vector<ExerciseFile> exercises_beside(const std::filesystem::path& scene,
                                           std::vector<std::string>& refusals);

/// What passes, a line for each bound: "mean error at most 2 mm".
std::vector<std::string> what_passes(const Exercise& exercise);

/// A figure that is not known keeps no bound.
ExerciseResult judge(const Exercise& exercise, const Score& score);

/// "exercise NAME: passed" or "not passed", and a line for each bound.
std::string to_text(const ExerciseResult& result);
/// {"name": …, "passed": …, "lines": [{"text": …, "kept": …}]}.
nlohmann::ordered_json to_json(const ExerciseResult& result);

}  // namespace brachy
