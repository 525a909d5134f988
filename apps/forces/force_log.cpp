#include "apps/forces/force_log.h"

#include <stdexcept>

namespace brachy {

ForceSample force_sample(double t_s, std::uint32_t needle, const NeedleState& state, double min_det) {
  ForceSample sample{t_s,           needle,
                     state.contact, state.tip_depth_mm,
                     state.forces,  state.landmark_count,
                     min_det,       state.shape.tip_deflection_mm()};
  sample.forces.tip_torque_nmm = sample.forces.hub_torque_nmm = Vec3::Zero();
  return sample;
}

void ForceLogWriter::close() {
  flush();
  if (has_failed()) throw std::runtime_error(failure());
}

}  // namespace brachy
