#include "apps/daemon/control/scanner_console.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "haptics/devices/switched_device.h"

namespace brachy {
namespace {

struct Knob {
  const char* name;
  double net::ScannerMessage::*value;
  double UltrasoundSettings::*setting;
  double least, most;  // as the scene's keys
};
constexpr std::array<Knob, 5> kKnobs = {{
    {"depth_mm", &net::ScannerMessage::depth_mm, &UltrasoundSettings::depth_mm, 10, 150},
    {"gain_db", &net::ScannerMessage::gain_db, &UltrasoundSettings::gain_db, -60, 60},
    {"dynamic_range_db", &net::ScannerMessage::dynamic_range_db, &UltrasoundSettings::dynamic_range_db, 10,
     120},
    {"tgc_extra_db_per_cm", &net::ScannerMessage::tgc_extra_db_per_cm,
     &UltrasoundSettings::tgc_extra_db_per_cm, -100, 100},
    {"focus_mm", &net::ScannerMessage::focus_mm, &UltrasoundSettings::focus_mm, 5, 150},
}};
constexpr double kMostDepthMm = 100, kMostRotationDeg = 180;  // of the stepper, to either side

std::string out_of(const char* name, double value, double least, double most) {
  if (std::isnan(value) || (value >= least && value <= most)) return {};
  return fmt::format("{} {:g} is not between {:g} and {:g}", name, value, least, most);
}

const char* array_name(net::ScannerArray array) {
  if (array == net::ScannerArray::kSagittal) return "sagittal";
  return array == net::ScannerArray::kEndFire ? "end_fire" : "transverse";
}

}  // namespace

ScannerConsole::ScannerConsole(const Scene& scene, SwitchedDevice* probe,
                               std::function<void(const net::ScannerMessage&)> publish)
    : probe_(probe), publish_(std::move(publish)) {
  in_use_.settings = scene.ultrasound;
  hand_over();
  publish_(message());
}

std::string ScannerConsole::execute(const net::ScannerMessage& request) {
  if (std::string why = refusal(request); !why.empty()) return why;
  ScannerSettings next = in_use_;
  for (const Knob& knob : kKnobs)
    if (const double value = request.*knob.value; !std::isnan(value)) next.settings.*knob.setting = value;
  if (request.array != net::ScannerArray::kAsItIs) {
    next.is_biplane = request.array == net::ScannerArray::kBiplane;
    next.settings.array = array_name(request.array);
  }
  if (request.freeze != net::ScannerFreeze::kAsItIs)
    next.is_frozen = request.freeze == net::ScannerFreeze::kFrozen;
  if (!std::isnan(request.probe_depth_mm)) next.place.depth_mm = request.probe_depth_mm;
  if (!std::isnan(request.probe_rotation_deg)) next.place.rotation_deg = request.probe_rotation_deg;
  if (!(next.settings == in_use_.settings) || next.is_biplane != in_use_.is_biplane) ++next.version;
  const bool is_moved = !std::isnan(request.probe_depth_mm) || !std::isnan(request.probe_rotation_deg);
  in_use_ = std::move(next);
  if (is_moved && probe_) probe_->stepper()->move_to(in_use_.place);
  changed_tick_ = tick_;
  hand_over();
  publish_(message());
  return {};
}

std::string ScannerConsole::refusal(const net::ScannerMessage& request) const {
  if (request.array > net::ScannerArray::kBiplane)
    return fmt::format("there is no array {}: 1 transverse, 2 sagittal, 3 end-fire, 4 biplane",
                       static_cast<unsigned>(request.array));
  if (request.freeze > net::ScannerFreeze::kFrozen)
    return fmt::format("freeze {} is none of 1 live, 2 frozen", static_cast<unsigned>(request.freeze));
  for (const Knob& knob : kKnobs)
    if (std::string why = out_of(knob.name, request.*knob.value, knob.least, knob.most); !why.empty())
      return why;
  for (const auto& [name, value, most] :
       {std::tuple("probe_depth_mm", request.probe_depth_mm, kMostDepthMm),
        std::tuple("probe_rotation_deg", request.probe_rotation_deg, kMostRotationDeg)}) {
    if (std::string why = out_of(name, value, -most, most); !why.empty()) return why;
    if (!std::isnan(value) && has_device_)
      return "a device moves the probe: disconnect it before using the stepper";
  }
  return {};
}

void ScannerConsole::update(const net::ImageDemand& demand, std::uint64_t tick) {
  tick_ = tick;
  if (demand == in_use_.demand) return;
  in_use_.demand = demand;
  hand_over();
}

void ScannerConsole::on_probe_device(bool attached) {
  has_device_ = attached;
  if (attached) {
    probe_->stepper()->release();
    in_use_.place = {};  // where the stepper begins again
    hand_over();
  }
  changed_tick_ = tick_;
  publish_(message());
}

net::ScannerMessage ScannerConsole::message() const {
  net::ScannerMessage m;
  m.array = in_use_.is_biplane ? net::ScannerArray::kBiplane : scanner_array(in_use_.settings.array);
  m.freeze = in_use_.is_frozen ? net::ScannerFreeze::kFrozen : net::ScannerFreeze::kLive;
  if (has_device_) m.flags |= net::kProbeHasDevice;
  if (moves_probe()) m.flags |= net::kProbeIsStepped;
  m.tick = changed_tick_;
  for (const Knob& knob : kKnobs) m.*knob.value = in_use_.settings.*knob.setting;
  m.probe_depth_mm = in_use_.place.depth_mm;
  m.probe_rotation_deg = in_use_.place.rotation_deg;
  return m;
}

bool ScannerConsole::moves_probe() const {
  return probe_ && probe_->stepper()->is_on();
}

void ScannerConsole::hand_over() {
  settings_.writer.slot() = in_use_;
  settings_.writer.publish();
}

}  // namespace brachy
