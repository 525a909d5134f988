#include "apps/daemon/control/controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/models/matrix_kernel/matrix_models.h"
#include "haptics/devices/switched_device.h"
#include "net/server/server.h"

namespace brachy {
namespace {

constexpr const char* kNoScript =
    "there is no scripted needle: name a trajectory in the scene ([device] trajectory) or start brachyd with "
    "--trajectory FILE";

std::string name_of(const ModelSettings& model) {
  if (is_matrix_model(model.kernel)) return model.kernel;
  return fmt::format("{}, support radius {:g} mm", model.kernel, model.support_radius_mm);
}

/// Refuses what was accepted, where it fails.
Controls::Done answer_to(const net::Sender& from) {
  return [from](const std::string& failure) {
    if (!failure.empty() && from.refuse) from.refuse(failure);
  };
}

}  // namespace

std::string Controls::execute(const net::ControlMessage& message, const net::Sender& from) {
  const std::string& client = from.name;
  switch (message.action) {
    case net::ControlAction::kPlay: {
      std::string refusal = play(message.loop);
      if (refusal.empty()) announce(net::EventKind::kNote, "scripted needle started by " + client);
      return refusal;
    }
    case net::ControlAction::kStop: {
      std::string refusal = stop();
      if (refusal.empty()) announce(net::EventKind::kNote, "scripted needle stopped by " + client);
      return refusal;
    }
    case net::ControlAction::kReset:
      return begin(model_, false, net::EventKind::kReset,
                   "reset by " + client + ": tissue, needles and seeds from the start", answer_to(from));
    case net::ControlAction::kModel:
      return change_model(message, from);
  }
  return fmt::format("there is no action {}: 1 play, 2 stop, 3 reset, 4 model",
                     static_cast<unsigned>(message.action));
}

std::string Controls::play(bool loop) {
  if (!has_script()) return kNoScript;
  const std::string name =
      "scripted device: " + std::filesystem::path(model_.device.trajectory).filename().string();
  for (std::size_t n = 0; n < devices_.size(); ++n) {
    const auto needle = static_cast<std::uint16_t>(n);
    if (plays_ || !devices_[n]->has_script() || server_.hold_lease(needle, name)) continue;
    const std::string holder = server_.lease_holder(needle);
    for (std::uint16_t m = 0; m < needle; ++m)
      if (devices_[m]->has_script()) server_.release_lease(m);
    return fmt::format("needle {} has a device, {}: disconnect it first", n, holder);
  }
  for (const auto& device : devices_)
    if (device->has_script()) device->play(loop);
  plays_ = true;
  loops_ = loop;
  return {};
}

std::string Controls::stop() {
  if (!has_script()) return kNoScript;
  if (!plays_) return {};
  for (std::size_t n = 0; n < devices_.size(); ++n) {
    if (!devices_[n]->has_script()) continue;
    devices_[n]->stop();
    server_.release_lease(static_cast<std::uint16_t>(n));
  }
  plays_ = loops_ = false;
  return {};
}

std::string Controls::change_model(const net::ControlMessage& message, const net::Sender& from) {
  Scene scene = model_;
  ModelSettings& model = scene.model;
  if (!message.kernel.empty()) model.kernel = message.kernel;
  if (!std::isnan(message.support_radius_mm)) model.support_radius_mm = message.support_radius_mm;
  const auto models = all_model_names();
  if (std::ranges::find(models, model.kernel) == models.end())
    return fmt::format("there is no kernel \"{}\": {}", model.kernel, fmt::join(models, ", "));
  if (!(model.support_radius_mm >= ModelSettings::kMinSupportMm &&
        model.support_radius_mm <= ModelSettings::kMaxSupportMm))
    return fmt::format("a support radius is between {:g} and {:g} mm", ModelSettings::kMinSupportMm,
                       ModelSettings::kMaxSupportMm);
  return begin(scene, true, net::EventKind::kNote, "model: " + name_of(model) + " (" + from.name + ")",
               answer_to(from));
}

std::string Controls::change_scene(const Scene& scene, const std::string& what, Done done) {
  return begin(scene, true, net::EventKind::kNote, what, std::move(done));
}

std::string Controls::begin(const Scene& scene, bool resumes, net::EventKind kind, const std::string& what,
                            Done done) {
  if (is_recorded_)
    return "a session is being recorded, and must replay unchanged: end it first, or start brachyd "
           "without --session";
  if (runs_.is_preparing()) return "a model is being prepared: try again once it is in use";
  next_kind_ = kind;
  next_what_ = what;
  next_model_ = scene;
  next_done_ = std::move(done);
  const auto on_failure = [this](const std::string& why) {
    announce(net::EventKind::kWarning, "not done: " + next_what_ + ": " + why);
    server_.broadcast_state();
    if (const Done failed = std::exchange(next_done_, nullptr)) failed(why);
  };
  if (resumes)
    runs_.begin(next_model_, on_failure);
  else
    runs_.restart(on_failure);
  return {};
}

void Controls::on_snapshot(std::uint64_t run) {
  if (!runs_.on_snapshot(run)) return;
  model_ = next_model_;
  announce(next_kind_, next_what_);
  server_.broadcast_state();
  if (const Done done = std::exchange(next_done_, nullptr)) done("");
}

bool Controls::has_script() const {
  return std::ranges::any_of(devices_, [](const auto& device) { return device->has_script(); });
}

net::ControlsState Controls::state() const {
  net::ControlsState state{model_.model.kernel, model_.model.support_radius_mm, 0};
  if (has_script()) state.flags |= net::kScriptIsThere;
  if (plays_) state.flags |= net::kScriptPlays;
  if (loops_) state.flags |= net::kScriptLoops;
  if (runs_.is_preparing()) state.flags |= net::kPreparesModel;
  return state;
}

void Controls::announce(net::EventKind kind, const std::string& text) {
  log_(text);
  server_.broadcast({kind, 0, 0, text});
}

}  // namespace brachy
