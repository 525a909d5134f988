#include "apps/daemon/control/scene_reload.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <exception>
#include <memory>

#include "apps/daemon/control/read_scene.h"
#include "apps/daemon/service/scene_changes.h"
#include "apps/daemon/service/service_watch.h"

namespace brachy {

SceneReload::SceneReload(EventLoop& loop, Worker& worker, Controls& controls, ServiceWatch& watch,
                         const DaemonOptions& options)
    : loop_(loop),
      worker_(worker),
      controls_(controls),
      watch_(watch),
      options_(options),
      hangups_(loop, {SIGHUP}) {
  await_hangup();
}

void SceneReload::await_hangup() {
  hangups_.start([this](int) {
    if (is_stopped_) return;
    if (options_.config) {
      is_requested_ = true;
      begin_if_requested();
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

void SceneReload::begin_if_requested() {
  if (!is_requested_ || is_running_ || is_stopped_ || controls_.is_preparing()) return;
  is_requested_ = false;
  is_running_ = true;
  watch_.reloading();
  worker_.post([this] {
    std::shared_ptr<const Scene> scene;
    std::string failure;
    try {
      scene = std::make_shared<const Scene>(read_scene(options_));
    } catch (const std::exception& e) {
      failure = e.what();
    }
    loop_.post([this, scene, failure] { scene ? compare(*scene) : refuse(failure); });
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
  const std::string refusal = controls_.change_scene(
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
