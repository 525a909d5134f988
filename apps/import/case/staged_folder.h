#pragma once

#include <filesystem>

namespace brachy {

/// Files that appear in a folder together: they are written to a hidden folder in it, and moved when all are there.
/// Without publish() the destructor leaves the folder as it was. Threads: one.
class StagedFolder {
 public:
  /// Makes `folder`, where it is missing. Errors: UserError where it cannot be made or written to.
  explicit StagedFolder(const std::filesystem::path& folder);
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  /// Where to write.
  const std::filesystem::path& stage() const { return stage_; }
  /// Moves the files into the folder, over those of the same names. Errors: std::filesystem::filesystem_error.
  void publish();

 private:
  std::filesystem::path folder_, stage_;
  bool was_made_;
};

}  // namespace brachy
