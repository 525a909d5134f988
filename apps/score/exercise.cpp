#include "apps/score/exercise.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "apps/forces/open_file.h"
#include "apps/score/spread.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/toml_table.h"

namespace brachy {
namespace {

const SeedAssignment* seeds_of(const Score& score) {
  return score.seeds ? &score.seeds->by_position : nullptr;
}

double motion_of(const Score& score, double NeedleMetrics::*value) {
  return score.needles.motion ? (*score.needles.motion).*value : kNoNumber;
}

double dose_of(const Score& score, std::string_view structure, double StructureDose::*value) {
  for (const StructureDose& s : score.dose.rest.structures)
    if (s.name == structure) return s.*value;
  return kNoNumber;
}

double insertions_of(const Score& score) {
  double sum = 0;
  for (const NeedleScore& needle : score.needles.needles) {
    if (!needle.insertions) return kNoNumber;
    sum += *needle.insertions;
  }
  return sum;
}

double study_of(const Score& score, double (*value)(const ContourScore&)) {
  return score.studies.empty() ? kNoNumber : value(score.studies.back().score);
}

double catheters_of(const Score& score, std::size_t CathetersScore::*count) {
  return score.catheters ? static_cast<double>((*score.catheters).*count) : kNoNumber;
}

double catheters_of(const Score& score, double CathetersScore::*mm) {
  return score.catheters ? (*score.catheters).*mm : kNoNumber;
}

/// What an exercise can bound.
struct Measure {
  const char* key;
  const char* what;
  const char* unit;
  bool is_most;  ///< the bound is the most; else the least
  double (*of)(const Score&);
};

constexpr std::array kMeasures = {
    Measure{"placed_at_least", "seeds placed", "", false,
            [](const Score& s) {
              return seeds_of(s) ? static_cast<double>(seeds_of(s)->placed.size()) : kNoNumber;
            }},
    Measure{"missing_at_most", "seeds missing", "", true,
            [](const Score& s) {
              return seeds_of(s) ? static_cast<double>(seeds_of(s)->missing.size()) : kNoNumber;
            }},
    Measure{"extra_at_most", "seeds extra", "", true,
            [](const Score& s) {
              return seeds_of(s) ? static_cast<double>(seeds_of(s)->extra.size()) : kNoNumber;
            }},
    Measure{"mean_error_mm_at_most", "mean error", " mm", true,
            [](const Score& s) { return seeds_of(s) ? seeds_of(s)->rest.total_mm.mean : kNoNumber; }},
    Measure{"largest_error_mm_at_most", "largest error", " mm", true,
            [](const Score& s) { return seeds_of(s) ? seeds_of(s)->rest.total_mm.max : kNoNumber; }},
    Measure{"axial_error_mm_at_most", "mean error along the needle", " mm", true,
            [](const Score& s) { return seeds_of(s) ? seeds_of(s)->rest.axial_mm.mean : kNoNumber; }},
    Measure{"organ_passes_at_most", "passes through organs", "", true,
            [](const Score& s) {
              double sum = 0;
              for (const StructureContact& contact : s.contacts) sum += contact.passes;
              return s.needles.motion || !s.contacts.empty() ? sum : kNoNumber;
            }},
    Measure{"insertions_at_most", "insertions", "", true, insertions_of},
    Measure{"time_s_at_most", "time", " s", true,
            [](const Score& s) { return motion_of(s, &NeedleMetrics::elapsed_time_s); }},
    Measure{"speed_p95_mm_s_at_most", "tip speed, 95 %", " mm/s", true,
            [](const Score& s) { return motion_of(s, &NeedleMetrics::speed_p95_mm_s); }},
    Measure{"train_speed_mm_s_at_most", "drawn back over a train", " mm/s", true,
            [](const Score& s) {
              double fastest = s.trains.empty() ? kNoNumber : 0;
              for (const TrainDrop& train : s.trains) fastest = std::max(fastest, train.at_least_mm_s);
              return fastest;
            }},
    Measure{"d90_gy_at_least", "prostate D90", " Gy", false,
            [](const Score& s) { return dose_of(s, "prostate", &StructureDose::d90_gy); }},
    Measure{"v100_percent_at_least", "prostate V100", " %", false,
            [](const Score& s) { return dose_of(s, "prostate", &StructureDose::v100_percent); }},
    Measure{"urethra_d30_gy_at_most", "urethra D30", " Gy", true,
            [](const Score& s) { return dose_of(s, "urethra", &StructureDose::d30_gy); }},
    Measure{"rectum_d2cc_gy_at_most", "rectum D2cc", " Gy", true,
            [](const Score& s) { return dose_of(s, "rectum", &StructureDose::d2cc_gy); }},
    Measure{"catheters_placed_at_least", "catheters placed", "", false,
            [](const Score& s) { return catheters_of(s, &CathetersScore::placed); }},
    Measure{"catheters_missing_at_most", "catheters missing", "", true,
            [](const Score& s) { return catheters_of(s, &CathetersScore::missing); }},
    Measure{"catheters_extra_at_most", "catheters extra", "", true,
            [](const Score& s) { return catheters_of(s, &CathetersScore::unplanned); }},
    Measure{"dwell_mean_error_mm_at_most", "mean error of the dwell positions", " mm", true,
            [](const Score& s) { return catheters_of(s, &CathetersScore::mean_mm); }},
    Measure{"dwell_largest_error_mm_at_most", "largest error of a dwell position", " mm", true,
            [](const Score& s) { return catheters_of(s, &CathetersScore::largest_mm); }},
    Measure{"tip_depth_error_mm_at_most", "largest error of a tip's depth", " mm", true,
            [](const Score& s) { return catheters_of(s, &CathetersScore::depth_mm); }},
    Measure{"study_dice_at_least", "volume study, Dice", "", false,
            [](const Score& s) {
              return study_of(s, [](const ContourScore& c) { return c.step_mm > 0 ? c.dice : kNoNumber; });
            }},
    Measure{"study_volume_error_percent_at_most", "volume study, error of the volume", " %", true,
            [](const Score& s) {
              return study_of(s, [](const ContourScore& c) {
                return c.step_mm > 0 ? std::abs(c.volume_error_percent()) : kNoNumber;
              });
            }},
    Measure{
        "study_hausdorff_95_mm_at_most", "volume study, 95 % Hausdorff distance", " mm", true,
        [](const Score& s) { return study_of(s, [](const ContourScore& c) { return c.hausdorff_95_mm; }); }},
    Measure{"study_missed_at_most", "volume study, planes missed", "", true, [](const Score& s) {
              // One slice alone has no step: which planes were to be outlined is not known.
              return study_of(s, [](const ContourScore& c) {
                return c.step_mm > 0 ? static_cast<double>(c.missed) : kNoNumber;
              });
            }}};

constexpr double kMostLimit = 1e6;

const Measure& measure_of(const ExerciseBound& bound) {
  return *std::ranges::find(kMeasures, bound.key, [](const Measure& m) { return std::string_view(m.key); });
}

/// Whether a line of a TOML file begins the table [passes].
bool has_passes(const std::string& text) {
  return text.starts_with("[passes]") || text.find("\n[passes]") != std::string::npos;
}

constexpr const char* kSuchAs = "; give an exercise, such as config/exercises/01_one_needle.toml";

/// A file's text, by one open: links in the way are followed only where the user gave the name. Its owner; not there:
/// errno says why.
struct ExerciseText {
  std::string text;
  uid_t owner = 0;
};

std::optional<ExerciseText> read_text(const std::filesystem::path& file, int flags) {
  const OpenFile opened(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | flags));
  struct stat about {};
  if (!opened.is_open() || ::fstat(opened.get(), &about) != 0) return std::nullopt;
  if (!S_ISREG(about.st_mode)) throw UserError(file.string() + ": is not a file" + kSuchAs);
  if (static_cast<std::uint64_t>(about.st_size) > kMostExerciseBytes)
    throw UserError(fmt::format("{}: has more than {} bytes, which is no exercise{}", file.string(),
                                kMostExerciseBytes, kSuchAs));
  ExerciseText read{std::string(kMostExerciseBytes, '\0'), about.st_uid};
  const ssize_t n = ::read(opened.get(), read.text.data(), read.text.size());
  if (n < 0) return std::nullopt;
  read.text.resize(static_cast<std::size_t>(n));
  return read;
}

/// Of a file, whose scene must be there.
Exercise parse_exercise(const std::string& text, const std::filesystem::path& file) {
  Exercise exercise = exercise_in(text, file);
  if (!std::filesystem::is_regular_file(exercise.scene))
    parse_toml(text, file.string())
        .contradiction("scene", "is \"" + exercise.scene.lexically_relative(file.parent_path()).string() +
                                    "\", which is not there beside the exercise; correct the path");
  return exercise;
}

}  // namespace

Exercise load_exercise(const std::filesystem::path& file) {
  const std::optional<ExerciseText> read = read_text(file, 0);
  if (!read) throw UserError(file.string() + ": cannot be read" + kSuchAs);
  return reading(file, FileKind::kExercise, [&] { return parse_exercise(read->text, file); });
}

std::string exercise_name_in(const std::string& text) {
  std::string name;
  parse_toml(text, "exercise").text("name", name);
  return name;
}

Exercise exercise_in(const std::string& text, const std::filesystem::path& file) {
  TomlTable t = parse_toml(text, file.string());
  Exercise exercise;
  exercise.text = text;
  std::string scene;
  t.text("name", exercise.name);
  t.text("asks", exercise.asks);
  t.text("scene", scene);
  TomlTable passes = t.table("passes");
  t.refuse_unknown();
  for (const char* key : {"name", "asks", "scene"})
    if (!t.has(key)) t.missing(key, "an exercise has a name, what it asks, a scene, and [passes]");
  for (const Measure& measure : kMeasures) {
    if (!passes.has(measure.key)) continue;
    double limit = 0;
    passes.number(measure.key, limit, 0, kMostLimit);
    exercise.bounds.push_back({measure.key, limit});
  }
  passes.flag("implant_goals", exercise.needs_implant_goals);
  for (const Measure& measure : kMeasures) {  // known also where they are not there
    double ignored = 0;
    passes.number(measure.key, ignored, 0, kMostLimit);
  }
  passes.refuse_unknown();
  if (exercise.bounds.empty() && !exercise.needs_implant_goals)
    t.contradiction("passes", "bounds nothing: everybody would pass; add one, such as mean_error_mm_at_most");
  exercise.scene = file.parent_path() / scene;
  return exercise;
}

namespace {

/// Names of TOML files in a directory, in their order, at most kMostExerciseFiles.
std::vector<std::filesystem::path> toml_files(const std::filesystem::path& folder,
                                              std::vector<std::string>& refusals) {
  std::vector<std::filesystem::path> files;
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator(folder, unreadable))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::ranges::sort(files);
  if (files.size() > kMostExerciseFiles) {
    refusals.push_back(fmt::format("{}: has {} TOML files; the first {} are looked at", folder.string(),
                                   files.size(), kMostExerciseFiles));
    files.resize(kMostExerciseFiles);
  }
  return files;
}

}  // namespace

std::vector<ExerciseFile> exercises_beside(const std::filesystem::path& scene,
                                           std::vector<std::string>& refusals) {
  const std::filesystem::path folder = std::filesystem::absolute(scene).parent_path();
  std::vector<ExerciseFile> found;
  struct stat about {};
  const uid_t owner = ::stat(scene.c_str(), &about) == 0 ? about.st_uid : ::geteuid();
  for (const std::filesystem::path& place : {folder, folder.parent_path(), folder / "exercises"})
    for (const std::filesystem::path& file : toml_files(place, refusals)) {
      try {
        const std::optional<ExerciseText> read = read_text(file, O_NOFOLLOW);
        if (!read || !has_passes(read->text)) continue;
        if (read->owner != ::geteuid() && read->owner != 0 && read->owner != owner)
          throw UserError(file.string() +
                          ": belongs to another user; copy it, or have its owner change (chown)");
        ExerciseFile exercise{file, parse_exercise(read->text, file)};
        std::error_code ignored;
        exercise.is_of_scene = std::filesystem::equivalent(exercise.exercise.scene, scene, ignored);
        found.push_back(std::move(exercise));
      } catch (const UserError& e) {
        refusals.emplace_back(e.what());
      }
    }
  std::ranges::sort(found, {}, [](const ExerciseFile& e) { return e.file.filename(); });
  return found;
}

std::vector<std::string> what_passes(const Exercise& exercise) {
  std::vector<std::string> lines;
  for (const ExerciseBound& bound : exercise.bounds) {
    const Measure& measure = measure_of(bound);
    lines.push_back(fmt::format("{} {} {:g}{}", measure.what, measure.is_most ? "at most" : "at least",
                                bound.limit, measure.unit));
  }
  if (exercise.needs_implant_goals) lines.emplace_back("every goal of the implant is met");
  return lines;
}

ExerciseResult judge(const Exercise& exercise, const Score& score) {
  ExerciseResult result{.name = exercise.name, .bounds = {}};
  for (const ExerciseBound& bound : exercise.bounds) {
    const Measure& measure = measure_of(bound);
    const double value = measure.of(score);
    const bool is_kept = measure.is_most ? value <= bound.limit : value >= bound.limit;
    const std::string is = std::isfinite(value) ? fmt::format("{:.4g}{}", value, measure.unit) : "not known";
    result.bounds.push_back({fmt::format("{} {}, {} {:g}", measure.what, is,
                                         measure.is_most ? "at most" : "at least", bound.limit),
                             is_kept});
  }
  if (exercise.needs_implant_goals &&
      std::ranges::all_of(score.goals, [](const GoalResult& goal) { return goal.goal.is_of_plan(); }))
    result.bounds.push_back({"the goals of the implant are not known", false});
  if (exercise.needs_implant_goals)
    for (const GoalResult& goal : score.goals) {
      if (goal.goal.is_of_plan()) continue;
      const bool is_met = goal.is_met.value_or(false);
      result.bounds.push_back({is_met ? goal.goal.structure + " " + goal.goal.figure + " meets its goal"
                               : goal.is_met ? missed_text(goal)
                                             : goal.goal.structure + " " + goal.goal.figure + " is not known",
                               is_met});
    }
  return result;
}

std::string to_text(const ExerciseResult& result) {
  std::string text =
      fmt::format("exercise \"{}\": {}\n", result.name, result.has_passed() ? "passed" : "not passed");
  for (const BoundResult& bound : result.bounds)
    text += fmt::format("  {} {}\n", bound.is_kept ? "ok  " : "MISS", bound.text);
  return text;
}

nlohmann::ordered_json to_json(const ExerciseResult& result) {
  nlohmann::ordered_json lines = nlohmann::ordered_json::array();
  for (const BoundResult& bound : result.bounds)
    lines.push_back({{"text", bound.text}, {"kept", bound.is_kept}});
  return {{"name", result.name}, {"passed", result.has_passed()}, {"lines", lines}};
}

}  // namespace brachy
