#include "apps/daemon/exercise/exercise_pages.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/score/history.h"
#include "core/base/error.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

// A page that asks again sooner gets the same answer. It also bounds what clients can make the daemon compute.
constexpr std::chrono::seconds kGoodFor{2};
constexpr std::size_t kShownFindings = 3;

std::string text_of(const OrderedJson& json) {
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

net::DynamicPage json_page(std::function<std::string()> make) {
  return {net::DynamicPage::Access::kViewer, [make = std::move(make)] {
            return net::DynamicPage::Content{200, "application/json", make()};
          }};
}

}  // namespace

ExercisePages::ExercisePages(EventLoop& loop, const std::optional<std::filesystem::path>& scene,
                             std::optional<std::filesystem::path> sessions,
                             std::function<ScoredSession()> score, std::function<void()> name_thread)
    : loop_(loop), sessions_(std::move(sessions)), score_(std::move(score)) {
  if (!scene) return;
  std::vector<std::string> refusals;
  exercises_ = exercises_beside(*scene, refusals);
  for (const std::string& refusal : refusals) spdlog::warn("no exercise: {}", refusal);
  const auto own = std::ranges::find(exercises_, true, &ExerciseFile::is_of_scene);
  if (own != exercises_.end()) {
    running_ = &own->exercise;
    running_file_ = own->file.filename();
  }
  if (!sessions_ && !(running_ && score_)) return;
  worker_ = std::make_unique<Worker>();
  worker_->post(std::move(name_thread));
  if (sessions_) count_passed();
}

net::DynamicPages ExercisePages::pages() {
  net::DynamicPages pages;
  pages["/exercises"] = json_page([this] { return list(); });
  pages["/exercise-result"] = json_page([this] { return result(); });
  pages["/exercise-report"] = {net::DynamicPage::Access::kViewer, [this] {
                                 if (report_.empty())
                                   return net::DynamicPage::Content{404, "text/plain; charset=utf-8",
                                                                    "Nothing has been scored yet.\n"};
                                 return net::DynamicPage::Content{200, "text/html; charset=utf-8", report_};
                               }};
  return pages;
}

void ExercisePages::stop() {
  is_stopped_ = true;
  if (worker_) worker_->stop();
}

std::string ExercisePages::list() const {
  OrderedJson all = OrderedJson::array();
  for (const ExerciseFile& file : exercises_)
    all.push_back({{"file", file.file.filename().string()},
                   {"name", file.exercise.name},
                   {"asks", file.exercise.asks},
                   {"passes", what_passes(file.exercise)},
                   {"running", &file.exercise == running_},
                   {"passed", passed_.contains(file.exercise.name) ? passed_.at(file.exercise.name) : 0}});
  return text_of({{"exercises", all}, {"recorded", score_ != nullptr}, {"attempts", sessions_.has_value()}});
}

std::string ExercisePages::result() {
  if (!running_) return text_of({{"state", "none"}, {"why", "the scene that runs is no exercise's"}});
  if (!score_)
    return text_of({{"state", "none"},
                    {"why", "nothing is recorded: start brachyd with --sessions DIR or --session DIR"}});
  if (!is_scoring_ && !last_.empty() && loop_.clock().now_ns() - scored_ns_ < net::in_ns(kGoodFor))
    return last_;
  if (!is_scoring_ && !is_stopped_) begin_score();
  return text_of({{"state", "scoring"}});
}

void ExercisePages::begin_score() {
  is_scoring_ = true;
  worker_->post([this, exercise = *running_] {
    OrderedJson result;
    std::string html;
    try {
      ScoredSession session = score_();
      result = {{"state", "scored"}};
      result.update(to_json(judge(exercise, session.score)));
      result["findings"] = OrderedJson::array();
      for (const Finding& finding : session.score.findings)
        if (result["findings"].size() < kShownFindings) result["findings"].push_back(finding.text);
      html = std::move(session.html);
    } catch (const std::exception& e) {
      result = {{"state", "none"}, {"why", e.what()}};
    }
    loop_.post([this, text = text_of(result), html = std::move(html)] {
      last_ = text;
      report_ = html;
      scored_ns_ = loop_.clock().now_ns();
      is_scoring_ = false;
    });
  });
}

Attempt ExercisePages::attempt(const std::string& file, const std::string& trainee) const {
  if (!sessions_) throw UserError("no attempt can be recorded: start brachyd with --sessions DIR");
  const auto named = std::ranges::find_if(
      exercises_, [&](const ExerciseFile& exercise) { return exercise.file.filename() == file; });
  if (named == exercises_.end()) throw UserError("there is no exercise \"" + file + "\" with this scene");
  return next_attempt(*sessions_, *named, trainee);
}

/// Reads the reports of all attempts, which may take long, on the other thread.
void ExercisePages::count_passed() {
  is_counting_ = true;
  worker_->post([this, sessions = *sessions_] {
    std::map<std::string, int> passed;
    try {
      for (const HistoryRow& row : load_history(sessions).rows)
        passed[row.task] += row.has_passed.value_or(false);
    } catch (const std::exception&) {
      passed.clear();  // no attempt yet
    }
    loop_.post([this, passed = std::move(passed)] {
      passed_ = passed;
      is_counting_ = false;
    });
  });
}

}  // namespace brachy
