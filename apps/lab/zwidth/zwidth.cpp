#include "apps/lab/zwidth/zwidth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "haptics/simulated/simulated_loop.h"

namespace brachy {

namespace {

constexpr double kLetGoMm = 1e-3;
constexpr double kBonded = 1e9;  // N: never slips

LoopSettings loop_settings(const ZWidthCase& loop, const DeviceDynamicsSettings& device) {
  LoopSettings s;
  s.device = free_mass(device);
  s.device.rate_hz = loop.rate_hz;
  s.local_model = loop.local_model;
  s.delay_s = 0.5 * loop.added_delay_s;
  s.wire_hz = std::min(loop.rate_hz, 1000.0);
  s.limits.max_force_n = kBonded;
  return s;
}

LoopSimulation spring(double stiffness_n_per_mm) {
  return [stiffness_n_per_mm](const NeedlePose& pose) {
    LocalContactModel m;
    m.tick = 1;
    m.in_contact = true;
    m.reference_tip = pose.X_WN.p;
    m.axial_stiffness_n_per_mm = stiffness_n_per_mm;
    m.axial_min_n = -kBonded;
    m.axial_max_n = kBonded;
    return m;
  };
}

SimulatedLoop release_mass(const ZWidthCase& loop, const DeviceDynamicsSettings& device,
                           double stiffness_n_per_mm) {
  SimulatedLoop made(loop_settings(loop, device), spring(stiffness_n_per_mm), {});
  made.device().displace(Vec3(0, 0, kLetGoMm));
  return made;
}

// Peak to peak over the next second.
double swing(SimulatedLoop& loop, double rate_hz) {
  double low = INFINITY, high = -INFINITY;
  for (int i = 0, cycles = static_cast<int>(rate_hz); i < cycles; ++i) {
    loop.step({});
    const double z = loop.device().tip().z();
    low = std::min(low, z);
    high = std::max(high, z);
  }
  return high - low;
}

double held_s(const ZWidthCase& loop) {
  return 1 / (loop.local_model ? loop.rate_hz : std::min(loop.rate_hz, 1000.0));
}

// τ: as measured in the loop before the mass moves far.
double delay_s(const ZWidthCase& loop, const DeviceDynamicsSettings& device) {
  SimulatedLoop trial = release_mass(loop, device, 1e-6);
  swing(trial, loop.rate_hz);
  return trial.longest_delay_s();
}

// m x″ + b x′ + K x(t − θ) = 0 with θ = T/2 + τ, the held force's mean age, is on its border at the frequency ω with
// mω² = K cos ωθ and bω = K sin ωθ: with y = ωθ, cot(y)/y = m/(bθ) and K = b y/(θ sin y) ≥ b/θ = 2b/(T + 2τ). A heavy
// mass approaches that limit; a light one stays above it.
double exact_stiffness(double mass_kg, double b, const ClosedLoop& loop) {
  const double age_s = 0.5 * loop.period_s + loop.delay_s, ratio = 1e-3 * mass_kg / (b * age_s);
  double low = 1e-9, high = 1.5707963;
  for (int i = 0; i < 100; ++i) {
    const double y = 0.5 * (low + high);
    (1 / (std::tan(y) * y) > ratio ? low : high) = y;
  }
  return b * low / (age_s * std::sin(low));
}

double bisect(const ZWidthCase& loop, const DeviceDynamicsSettings& device, double calm, double ringing) {
  while (ringing / calm > 1.002) {
    const double middle = std::sqrt(calm * ringing);
    (rings(loop, device, middle) ? ringing : calm) = middle;
  }
  return calm;
}

}  // namespace

DeviceDynamicsSettings free_mass(DeviceDynamicsSettings device) {
  device.hand_stiffness_n_per_mm = device.hand_damping_n_s_per_mm = device.encoder_mm = 0;
  return device;
}

bool rings(const ZWidthCase& loop, const DeviceDynamicsSettings& device, double stiffness_n_per_mm) {
  SimulatedLoop swinging = release_mass(loop, device, stiffness_n_per_mm);
  double last = 0;
  for (int second = 0; second < 8; ++second) {
    const double now = swing(swinging, loop.rate_hz);
    if (now > 200 * kLetGoMm) return true;
    if (second == 7) return now > last;
    last = now;
  }
  return false;
}

ZWidthPoint measure_zwidth(const ZWidthCase& loop, const DeviceDynamicsSettings& device) {
  ZWidthPoint point;
  point.loop = loop;
  point.closed = {.period_s = held_s(loop), .delay_s = delay_s(loop, device)};
  point.limit_n_per_mm = passive_stiffness_n_per_mm(device.damping_n_s_per_mm, point.closed);
  point.exact_n_per_mm = exact_stiffness(device.mass_kg, device.damping_n_s_per_mm, point.closed);
  point.stable_n_per_mm = bisect(loop, device, 0.05 * point.limit_n_per_mm, 20 * point.limit_n_per_mm);
  for (const double share : kSharesUnder) {
    if (rings(loop, device, share * point.limit_n_per_mm)) break;
    point.greatest_calm_share = share;
  }
  for (const double share : kSharesOver) {
    const bool ringing = rings(loop, device, share * point.limit_n_per_mm);
    if (!ringing)
      point.least_ringing_share = 0;
    else if (point.least_ringing_share == 0)
      point.least_ringing_share = share;
  }
  return point;
}

std::vector<ZWidthCase> zwidth_cases(bool quick) {
  const std::vector<double> rates_hz =
      quick ? std::vector<double>{200, 1000} : std::vector<double>{200, 500, 1000, 2000};
  const std::vector<double> delays_s =
      quick ? std::vector<double>{0, 0.01, 0.05}
            : std::vector<double>{0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.035, 0.05};
  std::vector<ZWidthCase> cases;
  for (const bool local_model : {true, false})
    for (const double rate_hz : rates_hz)
      for (const double delay : delays_s) cases.push_back({local_model, rate_hz, delay});
  return cases;
}

std::string to_json(const std::vector<ZWidthPoint>& points, const DeviceDynamicsSettings& device) {
  using OrderedJson = nlohmann::ordered_json;
  OrderedJson rows = OrderedJson::array();
  for (const ZWidthPoint& p : points)
    rows.push_back({{"loop", p.loop.local_model ? "local" : "wire"},
                    {"rate_hz", p.loop.rate_hz},
                    {"added_delay_ms", 1e3 * p.loop.added_delay_s},
                    {"held_ms", 1e3 * p.closed.period_s},
                    {"loop_delay_ms", 1e3 * p.closed.delay_s},
                    {"limit_n_per_mm", p.limit_n_per_mm},
                    {"exact_n_per_mm", p.exact_n_per_mm},
                    {"stable_n_per_mm", p.stable_n_per_mm},
                    {"greatest_calm_share", p.greatest_calm_share},
                    {"least_ringing_share", p.least_ringing_share}});
  const OrderedJson json = {
      {"mass_kg", device.mass_kg}, {"damping_n_s_per_mm", device.damping_n_s_per_mm}, {"points", rows}};
  return json.dump(1) + "\n";
}

std::string to_markdown(const std::vector<ZWidthPoint>& points) {
  std::string text =
      "| loop | rate, Hz | network there and back, ms | held T, ms | delay τ, ms | 2b/(T + 2τ), N/m | of "
      "this mass, N/m | largest stable, N/m | of the limit | calm up to | ringing from |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const ZWidthPoint& p : points)
    text += fmt::format(
        "| {} | {:g} | {:g} | {:g} | {:g} | {:.1f} | {:.1f} | {:.1f} | {:.3f} | {:g} | {} |\n",
        p.loop.local_model ? "local model" : "wire", p.loop.rate_hz, 1e3 * p.loop.added_delay_s,
        1e3 * p.closed.period_s, 1e3 * p.closed.delay_s, 1e3 * p.limit_n_per_mm, 1e3 * p.exact_n_per_mm,
        1e3 * p.stable_n_per_mm, p.stable_n_per_mm / p.limit_n_per_mm, p.greatest_calm_share,
        p.least_ringing_share > 0 ? fmt::format("{:g}", p.least_ringing_share) : "none");
  return text;
}

}  // namespace brachy
