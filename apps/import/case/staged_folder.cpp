#include "apps/import/case/staged_folder.h"

#include "core/base/error.h"

namespace brachy {

StagedFolder::StagedFolder(const std::filesystem::path& folder)
    : folder_(folder), stage_(folder / ".writing"), was_made_(!std::filesystem::exists(folder)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  std::filesystem::remove_all(stage_, error);  // of a process that was killed
  if (!std::filesystem::create_directory(stage_, error))
    throw UserError(folder.string() + ": cannot be made or written to; choose another --out");
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(stage_, ignored);
  if (was_made_) std::filesystem::remove(folder_, ignored);  // only where it is empty
}

void StagedFolder::publish() {
  for (const auto& entry : std::filesystem::directory_iterator(stage_))
    std::filesystem::rename(entry.path(), folder_ / entry.path().filename());
  was_made_ = false;
}

}  // namespace brachy
