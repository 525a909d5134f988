#include "apps/brachyd/service/scene_reload.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>
#include <csignal>
#include <exception>
#include <memory>

#include "apps/brachyd/daemon_setup.h"
#include "apps/brachyd/service/scene_changes.h"

namespace brachy {

SceneReload::SceneReload(boost::asio::io_context& io, boost::asio::thread_pool& workers, Controls& controls,
                         ServiceWatch& watch, const DaemonOptions& options)
    : io_(io),
      workers_(workers),
      controls_(controls),
      watch_(watch),
      options_(options),
      hangups_(io, SIGHUP) {
  await_hangup();
}

void SceneReload::await_hangup() {
  hangups_.async_wait([this](const auto& error, int) {
    if (error || is_stopped_) return;
    if (options_.config) {
      is_asked_ = true;
      go_on();
    } else {
      spdlog::warn("SIGHUP: there is no scene file to read again; start brachyd with --config FILE");
    }
    await_hangup();
  });
}

void SceneReload::stop() {
  is_stopped_ = true;
  hangups_.cancel();
}

void SceneReload::go_on() {
  if (!is_asked_ || is_running_ || is_stopped_ || controls_.is_preparing()) return;
  is_asked_ = false;
  is_running_ = true;
  watch_.reloading();
  boost::asio::post(workers_, [this] {
    std::shared_ptr<const Scene> scene;
    std::string failure;
    try {
      scene = std::make_shared<const Scene>(read_scene(options_));
    } catch (const std::exception& e) {
      failure = e.what();
    }
    boost::asio::post(io_, [this, scene, failure] { scene ? compare(*scene) : refuse(failure); });
  });
}

void SceneReload::compare(const Scene& read) {
  const SceneChanges changes = changes_of(controls_.scene(), read);
  if (!changes.kept.empty())
    spdlog::warn("scene read again: restart brachyd for {}", fmt::join(changes.kept, ", "));
  if (changes.taken.empty())
    return end(changes.kept.empty() ? "scene read again: nothing has changed"
                                    : "scene read again: nothing changed that can while it runs");
  const std::string what = fmt::format("scene read again: {}", fmt::join(changes.taken, ", "));
  const std::string refusal = controls_.take_up(
      changes.scene, what,
      [this, what](const std::string& failure) { failure.empty() ? end(what) : refuse(failure); });
  if (!refusal.empty()) refuse(refusal);
}

void SceneReload::end(const std::string& outcome) {
  is_running_ = false;
  ++done_;
  spdlog::info("{}", outcome);
  watch_.reloaded(outcome);
}

void SceneReload::refuse(const std::string& why) {
  is_running_ = false;
  ++refused_;
  spdlog::error("the old scene stays in use: {}", why);
  watch_.reloaded("the old scene stays in use: " + why);
}

}  // namespace brachy
