#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/forces/open_file.h"

namespace brachy {

inline constexpr const char *kPosesFile = "poses.csv", *kForcesFile = "forces.csv", *kSeedsFile = "seeds.csv",
                            *kDropsFile = "drops.csv", *kContactsFile = "contacts.csv",
                            *kClockFile = "clock.csv", *kStudiesFile = "volume_studies.jsonl",
                            *kPlanChangesFile = "plan_changes.csv", *kManifestFile = "session.json",
                            *kReportPage = "report.html", *kReportJson = "report.json",
                            *kCatheterFile = "catheters.csv", *kHdrReportFile = "hdr_report.json",
                            *kStatesFolder = "states";

/// A file that a session's directory may hold, and the most that it may have.
struct SessionFile {
  const char* name;
  std::uint64_t most_bytes;
};

/// All of them, but for plan_change_1.toml, … (kPlanChange), recording_0.brachy, … (kSessionRecording) and what lies in
/// states/ (kSessionState).
inline constexpr std::uint64_t kMegabyte = 1'000'000, kMostTable = 100'000 * kMegabyte;
inline constexpr SessionFile kSessionFiles[] = {
    {kPosesFile, kMostTable},         {kForcesFile, kMostTable},       {kSeedsFile, 16 * kMegabyte},
    {kDropsFile, 64 * kMegabyte},     {kContactsFile, 64 * kMegabyte}, {kClockFile, 64 * kMegabyte},
    {kStudiesFile, 32 * kMegabyte},   {kPlanChangesFile, kMegabyte},   {kManifestFile, 6 * kMegabyte},
    {kReportPage, 64 * kMegabyte},    {kReportJson, 64 * kMegabyte},   {kCatheterFile, 16 * kMegabyte},
    {kHdrReportFile, 64 * kMegabyte},
};
inline constexpr SessionFile kPlanChange = {"plan_change_", kMegabyte};
inline constexpr SessionFile kSessionRecording = {"recording_", 600 * kMegabyte};
inline constexpr SessionFile kSessionState = {kStatesFolder, 5000 * kMegabyte};

/// A session's directory, opened once: its files are opened relative to it and by no link, so that whoever prepared it
/// reaches nothing outside. Files that are written must be regular, the owner's own, with one name, writable, and no
/// larger than the list above says; they are created with mode 0600 by the open itself. Files that are read must be
/// regular and no larger. Copies mean the same directory.
/// Errors of all functions: UserError "FILE: what; fix".
/// Threads: any.
class SessionFolder {
 public:
  /// To write into: creates it where it is missing. It must be a directory of this user or of root, not a link, in
  /// which this process may make files.
  static SessionFolder make(const std::filesystem::path& folder);
  /// To read from, by whatever path. The caller has the file's size bounded by the list above, and by memory.
  static SessionFolder open(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path path_of(std::string_view name) const { return path_ / name; }

  /// Keeps every other process from recording into it, until the last copy of this is gone.
  void lock() const;
  /// Checks every file of the list that is there, to be written.
  void check_all() const;

  /// Whether there is anything of that name, a broken link too.
  bool has(std::string_view name) const;
  /// The size of a file to read; nullopt: it is missing.
  std::optional<std::uint64_t> size_of(std::string_view name) const;
  /// Whether a small file that is there has nothing but blanks in it.
  bool is_blank(std::string_view name) const;
  /// A file to read, whole, or its first or last bytes; nullopt: it is missing. read() refuses more than kMostInMemory.
  static constexpr std::uint64_t kMostInMemory = 4000 * kMegabyte;
  std::optional<std::string> read(std::string_view name) const;
  /// Calls visit(lines) with the whole lines of a file, if it is there, piece by piece. Returns whether it ends within
  /// a line, which was left out.
  bool read_lines(std::string_view name, const std::function<void(std::string_view)>& visit) const;
  std::optional<std::string> first_bytes(std::string_view name, std::size_t count) const;
  std::optional<std::string> last_bytes(std::string_view name, std::size_t count) const;
  /// Names in the directory that begin with `start`, in no order.
  std::vector<std::string> names(std::string_view start = {}) const;

  /// Opens a file of lines to append to, after an unfinished last line is cut off and a blank file is emptied.
  OpenFile append_to(std::string_view name) const;
  /// Creates a file that is not there yet, to write.
  OpenFile create(std::string_view name) const;
  /// Writes a file that is not there yet.
  void write_new(std::string_view name, std::string_view text) const;
  /// Writes a file whole or not at all, in place of one that may be there: by another name, and a rename.
  void replace(std::string_view name, std::string_view text) const;
  void replace(std::string_view name, std::span<const std::byte> bytes) const;

  /// A directory within, to write into, which is made where it is missing, or to read; nullopt: it is missing.
  SessionFolder make_folder(std::string_view name) const;
  std::optional<SessionFolder> find_folder(std::string_view name) const;

 private:
  SessionFolder(std::filesystem::path path, OpenFile folder, std::uint64_t most_bytes = 0)
      : path_(std::move(path)),
        folder_(std::make_shared<const OpenFile>(std::move(folder))),
        most_bytes_(most_bytes) {}
  int at() const { return folder_->get(); }
  std::uint64_t most_bytes_of(std::string_view name) const;
  OpenFile open_to_read(std::string_view name) const;  // none: it is missing
  void check_to_write(std::string_view name) const;
  [[noreturn]] void refuse(std::string_view name, const std::string& why) const;

  std::filesystem::path path_;
  std::shared_ptr<const OpenFile> folder_;
  std::uint64_t most_bytes_;  // of every file in it; 0: as kSessionFiles says
};

/// Up to the last line end.
std::string_view whole_lines(std::string_view text);

}  // namespace brachy
