#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/score/exercise.h"

namespace brachy {

/// An attempt at an exercise, which the daemon goes on with.
struct Attempt {
  std::filesystem::path scene;    ///< file
  std::filesystem::path session;  ///< directory to record into; it does not exist yet
  std::string trainee;            ///< empty: nobody's
};

/// The next attempt in a directory of them (--sessions), which is made where it is missing: it is recorded in
/// NNNN_EXERCISE, with the number after the largest there. A trainee's name is in no path. Throws UserError where the
/// exercise's scene is wrong, the directory cannot be written, or less than kLeastFreeBytes are free.
inline constexpr std::uintmax_t kLeastFreeBytes = 1'000'000'000;
Attempt next_attempt(const std::filesystem::path& sessions, const ExerciseFile& exercise,
                     const std::string& trainee);

/// The exercise that a scene belongs to; none: it is no exercise's.
std::optional<ExerciseFile> exercise_of_scene(const std::filesystem::path& scene);

}  // namespace brachy
