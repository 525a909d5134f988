#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/daemon/exercise/attempts.h"
#include "apps/daemon/io/event_loop.h"
#include "apps/score/exercise.h"
#include "net/http/dynamic_pages.h"

namespace brachy {

/// A session so far.
struct ScoredSession {
  Score score;
  std::string html;  ///< its report
};

/// The exercises that lie with the daemon's scene (config/exercises), for the viewer: what each asks, what passes and
/// how often it was passed, and of the scene's own the result of the session so far, by the code of `brachy score
/// --exercise`, and its report.
/// Threads: the io thread; the score is computed on a thread of its own.
class ExercisePages {
 public:
  /// `loop` outlives this. `scene`: its file; nullopt: there are no exercises. `sessions`: the directory of attempts;
  /// none: no attempts are made. `score` scores the session so far, on the other thread, and throws std::exception with
  /// the reason where it cannot; null: nothing is recorded, so there is no result. `name_thread` is the thread's first
  /// work.
  ExercisePages(EventLoop& loop, const std::optional<std::filesystem::path>& scene,
                std::optional<std::filesystem::path> sessions, std::function<ScoredSession()> score,
                std::function<void()> name_thread);

  /// /exercises, /exercise-result and /exercise-report (net/PROTOCOL.md).
  net::DynamicPages pages();

  /// An attempt at an exercise of the list. Throws UserError.
  Attempt attempt(const std::string& file, const std::string& trainee) const;

  const Exercise* running() const { return running_; }  ///< null: the scene is no exercise's
  const std::filesystem::path& running_file() const { return running_file_; }  ///< its name; empty: none
  bool is_scoring() const { return is_scoring_; }
  bool is_busy() const { return is_scoring_ || is_counting_; }  ///< the destructor waits for what is computed
  void stop();  ///< what is being scored is not waited for; nothing more is started

 private:
  std::string list() const;
  std::string result();
  void begin_score();
  void count_passed();

  EventLoop& loop_;
  const std::optional<std::filesystem::path> sessions_;
  const std::function<ScoredSession()> score_;  // null: nothing is recorded
  std::vector<ExerciseFile> exercises_;
  const Exercise* running_ = nullptr;
  std::filesystem::path running_file_;
  std::map<std::string, int> passed_;  // sessions that passed, by the exercise's name
  std::string last_, report_;          // JSON and page of the last result; empty: none
  std::int64_t scored_ns_ = 0;
  bool is_scoring_ = false, is_counting_ = false, is_stopped_ = false;
  std::unique_ptr<Worker> worker_;  // null: nothing is ever scored
};

}  // namespace brachy
