#include "apps/score/recording.h"

#include <fmt/format.h>

#include <utility>

#include "apps/session/session_folder.h"
#include "core/base/error.h"
#include "core/brachytherapy/seeds/failed_drop_file.h"
#include "core/brachytherapy/seeds/seed_file.h"

namespace brachy {
namespace {

/// What a file holds, and what is to be said about it.
template <class Content>
struct FileRead {
  std::optional<Content> content;
  std::string remark;  ///< empty: none
};

std::string cut_remark(const std::string& name) {
  return name + " ends within a line, which was left out: what came after is not known.";
}

/// What `parse` makes of a file's text. Nothing, and a remark that ends with `without`, where that is impossible.
template <class Parse>
auto read(const SessionFolder& folder, const std::string& name, const char* without, Parse&& parse)
    -> FileRead<decltype(parse(std::string_view(), name))> {
  const std::optional<std::string> text = folder.read(name);
  if (!text) return {{}, name + " is missing: " + without};
  const std::string_view whole = whole_lines(*text);
  try {
    auto parsed = parse(whole, name);
    const bool is_cut = whole.size() < text->size();
    return {std::move(parsed), is_cut ? cut_remark(name) : ""};
  } catch (const UserError& error) {
    return {{}, std::string(error.what()) + ". It cannot be read: " + without};
  }
}

/// As read(), in pieces.
FileRead<std::vector<RecordedForce>> read_forces(const SessionFolder& folder) {
  const std::string without = "punctures and forces are not known.";
  if (!folder.size_of(kForcesFile)) return {{}, std::string(kForcesFile) + " is missing: " + without};
  std::vector<RecordedForce> forces;
  bool is_cut = false;
  try {
    ForceLogReader reader(kForcesFile);
    is_cut = folder.read_lines(kForcesFile, [&](std::string_view lines) {
      reader.read(lines, [&](const ForceSample& sample) { forces.emplace_back(sample); });
    });
    reader.end();
  } catch (const UserError& error) {
    return {{}, std::string(error.what()) + ". It cannot be read: " + without};
  }
  return {std::move(forces), is_cut ? cut_remark(kForcesFile) : ""};
}

/// All times by the trainee's clock.
void retime(Recording& recording) {
  const SessionClock& clock = recording.clock;
  const auto retime = [&](double& t_s) { t_s = clock.wall_s(t_s); };
  if (recording.poses)
    recording.poses = recording.poses->retimed([&](double t_s) { return clock.wall_s(t_s); });
  for (RecordedForce& sample : recording.forces) retime(sample.t_s);
  if (recording.seeds)
    for (Seed& seed : *recording.seeds) retime(seed.t_s);
  if (recording.failed_drops)
    for (FailedDrop& drop : *recording.failed_drops) retime(drop.t_s);
  if (recording.passes)
    for (OrganPass& pass : *recording.passes) {
      pass.time_s = clock.wall_s(pass.t_s) - clock.wall_s(pass.t_s - pass.time_s);
      retime(pass.t_s);
    }
  for (RecordedStudy& study : recording.studies) retime(study.t_s);
}

/// A directory's own name, however the path is written.
std::string name_of(const std::filesystem::path& folder) {
  const std::filesystem::path whole = std::filesystem::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

}  // namespace

Recording load_recording(const std::filesystem::path& path) {
  const SessionFolder folder = SessionFolder::open(path);
  Recording recording;
  recording.name = name_of(path);
  const auto take = [&](auto&& file) {
    if (!file.remark.empty()) recording.remarks.push_back(std::move(file.remark));
    return std::move(file.content);
  };
  const auto take_if_there = [&](const char* name, const char* without, auto&& parse) {
    using Content = decltype(parse(std::string_view(), std::string()));
    return folder.has(name) ? take(read(folder, name, without, parse)) : std::optional<Content>();
  };
  recording.poses = take(
      read(folder, "poses.csv", "needle paths, times and passes are not known.",
           [](std::string_view text, const std::string& name) { return parse_trajectories(text, name); }));
  const auto forces = take(read_forces(folder));
  recording.seeds = take(
      read(folder, "seeds.csv", "what was implanted, its errors and its dose are not known.", parse_seeds));
  recording.failed_drops =
      take_if_there("drops.csv", "lost and refused seeds are not known.", parse_failed_drops);
  recording.passes = take_if_there("contacts.csv", "passes through organs are those of the organs at rest.",
                                   parse_organ_passes);
  if (auto studies = take_if_there(kStudiesFile, "volume studies are not known.", parse_studies))
    recording.studies = std::move(*studies);
  if (!recording.poses && !forces && !recording.seeds)
    throw UserError(path.string() +
                    ": has no readable recording; it should contain poses.csv, forces.csv "
                    "and seeds.csv (" +
                    recording.remarks.front() + ")");
  if (forces) recording.forces = *forces;
  if (auto clock =
          take_if_there(kClockFile, "times are those of the simulation's ticks.", SessionClock::parse)) {
    constexpr double kLateShare = 0.02;
    if (clock->missed_share() > kLateShare)
      recording.remarks.push_back(fmt::format(
          "The machine was late: {:.0f} % of the simulation's ticks were missed, and the tissue moved more "
          "slowly than the hand. Times and speeds are by the clock.",
          100 * clock->missed_share()));
    recording.clock = *std::move(clock);
    retime(recording);
  }
  return recording;
}

Recording load_seeds_recording(const std::filesystem::path& file) {
  Recording recording;
  recording.name = file.stem().string();
  recording.is_of_seeds_alone = true;
  recording.seeds = load_seeds_in_place(file);
  recording.remarks = {
      "Of the implant only the seeds are known: neither needles nor forces, nor how they fell."};
  return recording;
}

void leave_out(Recording& recording, std::uint32_t probe) {
  std::erase_if(recording.forces, [&](const RecordedForce& row) { return row.needle == probe; });
  if (!recording.poses) return;
  std::vector<NeedleTrajectories::Needle> needles = recording.poses->needles();
  std::erase_if(needles, [&](const auto& needle) { return needle.id == probe; });
  std::optional<NeedleTrajectories> rest;
  if (!needles.empty()) rest = NeedleTrajectories(std::move(needles));
  recording.poses = std::move(rest);
}

}  // namespace brachy
