#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/daemon/io/event_loop.h"
#include "apps/score/exercise.h"
#include "net/http/dynamic_pages.h"

namespace brachy {

/// The exercises that lie with the daemon's scene (config/exercises), for the viewer: what each asks and what passes,
/// and of the scene's own the result of the session so far, by the code of `brachy score --exercise`.
/// Threads: the io thread; the score is computed on a thread of its own.
class ExercisePages {
 public:
  /// `loop` outlives this. `scene`: its file; nullopt: there are no exercises. `score` scores the session so far, on
  /// the other thread, and throws std::exception with the reason where it cannot; null: nothing is recorded, so
  /// there is no result. `name_thread` is the thread's first work.
  ExercisePages(EventLoop& loop, const std::optional<std::filesystem::path>& scene,
                std::function<Score()> score, std::function<void()> name_thread);

  /// /exercises and /exercise-result (net/PROTOCOL.md).
  net::DynamicPages pages();

  const Exercise* running() const { return running_; }  ///< null: the scene is no exercise's
  const std::filesystem::path& running_file() const { return running_file_; }  ///< its name; empty: none
  bool is_scoring() const { return is_scoring_; }
  void stop();  ///< what is being scored is not waited for; nothing more is started

 private:
  std::string list() const;
  std::string result();
  void begin_score();

  EventLoop& loop_;
  const std::function<Score()> score_;  // null: nothing is recorded
  std::vector<ExerciseFile> exercises_;
  const Exercise* running_ = nullptr;
  std::filesystem::path running_file_;
  std::string last_;  // JSON of the last result; empty: none
  std::int64_t scored_ns_ = 0;
  bool is_scoring_ = false, is_stopped_ = false;
  std::unique_ptr<Worker> worker_;  // null: nothing is ever scored
};

}  // namespace brachy
