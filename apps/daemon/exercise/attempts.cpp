#include "apps/daemon/exercise/attempts.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "apps/session/session_folder.h"
#include "core/base/error.h"
#include "core/scene/file/scene_file.h"

namespace brachy {
namespace {

/// The number that a name begins with; 0: none.
unsigned leading_number(const std::string& name) {
  unsigned number = 0;
  std::from_chars(name.data(), name.data() + name.size(), number);
  return number;
}

}  // namespace

Attempt next_attempt(const std::filesystem::path& sessions, const ExerciseFile& exercise,
                     const std::string& trainee) {
  load_scene(exercise.exercise.scene);
  const SessionFolder all = SessionFolder::make(sessions);
  std::error_code unknown;
  const auto space = std::filesystem::space(sessions, unknown);
  if (!unknown && space.available < kLeastFreeBytes)
    throw UserError(fmt::format("{}: less than 1 GB is free there; remove sessions that are not needed",
                                sessions.string()));
  unsigned last = 0;
  for (const std::string& name : all.names()) last = std::max(last, leading_number(name));
  return {exercise.exercise.scene,
          sessions / fmt::format("{:04}_{}", last + 1, exercise.file.stem().string()), trainee};
}

std::optional<ExerciseFile> exercise_of_scene(const std::filesystem::path& scene) {
  std::vector<std::string> ignored;
  for (ExerciseFile& file : exercises_beside(scene, ignored))
    if (file.is_of_scene) return std::move(file);
  return std::nullopt;
}

}  // namespace brachy
