#pragma once

#include <filesystem>
#include <string>

#include "core/base/error.h"

namespace brachy {

/// The kinds of files that people give for one another.
enum class FileKind {
  kScene,
  kExercise,
  kPlan,
  kHdrPlan,
  kSource,
  kTrajectory,
  kMesh,
  kRecording,
  kVolume,
  kDicom
};

/// "a scene", "an exercise", …
std::string to_string(FileKind kind);

/// For the message of a reader that has refused `file`: "NAME is an exercise; a scene is asked for here: FIX" where
/// the file is clearly of another kind than the `wanted` one, with what to give instead where the file names it; else
/// "". Goes by the name's ending and the first 64 KiB. Throws nothing about the file.
std::string other_kind(const std::filesystem::path& file, FileKind wanted);

/// Calls `read`; where it refuses a file of another kind, by a UserError, the error says so instead.
template <class Read>
auto reading(const std::filesystem::path& file, FileKind wanted, Read read) {
  try {
    return read();
  } catch (const UserError&) {
    const std::string why = other_kind(file, wanted);
    if (why.empty()) throw;
    throw UserError(why);
  }
}

}  // namespace brachy
