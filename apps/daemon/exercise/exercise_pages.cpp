#include "apps/daemon/exercise/exercise_pages.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

// A page that asks again sooner gets the same answer. It also bounds what clients can make the daemon compute.
constexpr std::chrono::seconds kGoodFor{2};

std::string text_of(const OrderedJson& json) {
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

net::DynamicPage json_page(std::function<std::string()> make) {
  return {true, [make = std::move(make)] {
            return net::DynamicPage::Content{200, "application/json", make()};
          }};
}

}  // namespace

ExercisePages::ExercisePages(EventLoop& loop, const std::optional<std::filesystem::path>& scene,
                             std::function<Score()> score, std::function<void()> name_thread)
    : loop_(loop), score_(std::move(score)) {
  if (!scene) return;
  std::vector<std::string> refusals;
  exercises_ = exercises_beside(*scene, refusals);
  for (const std::string& refusal : refusals) spdlog::warn("no exercise: {}", refusal);
  const auto own = std::ranges::find(exercises_, true, &ExerciseFile::is_of_scene);
  if (own == exercises_.end()) return;
  running_ = &own->exercise;
  running_file_ = own->file.filename();
  if (!score_) return;
  worker_ = std::make_unique<Worker>();
  worker_->post(std::move(name_thread));
}

net::DynamicPages ExercisePages::pages() {
  net::DynamicPages pages;
  pages["/exercises"] = json_page([this] { return list(); });
  pages["/exercise-result"] = json_page([this] { return result(); });
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
                   {"running", &file.exercise == running_}});
  return text_of({{"exercises", all}, {"recorded", score_ != nullptr}});
}

std::string ExercisePages::result() {
  if (!running_) return text_of({{"state", "none"}, {"why", "the scene that runs is no exercise's"}});
  if (!worker_)
    return text_of({{"state", "none"}, {"why", "nothing is recorded: start brachyd with --session DIR"}});
  if (!is_scoring_ && !last_.empty() && loop_.clock().now_ns() - scored_ns_ < net::in_ns(kGoodFor))
    return last_;
  if (!is_scoring_ && !is_stopped_) begin_score();
  return text_of({{"state", "scoring"}});
}

void ExercisePages::begin_score() {
  is_scoring_ = true;
  worker_->post([this, exercise = *running_] {
    OrderedJson result;
    try {
      result = {{"state", "scored"}};
      result.update(to_json(judge(exercise, score_())));
    } catch (const std::exception& e) {
      result = {{"state", "none"}, {"why", e.what()}};
    }
    loop_.post([this, text = text_of(result)] {
      last_ = text;
      scored_ns_ = loop_.clock().now_ns();
      is_scoring_ = false;
    });
  });
}

}  // namespace brachy
