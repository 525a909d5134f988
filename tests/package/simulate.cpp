#include <iostream>
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"
int main() {
  const brachy::Scene scene;  // the default: a prostate phantom, one needle, elastic
  brachy::Simulator simulator(brachy::load_simulation_model(scene, brachy::load_tissue(scene).tissue));
  brachy::MeshState state = simulator.initial_state();
  brachy::NeedlePose pose;  // along +z, its tip in mm
  pose.present = true;
  for (pose.X_WN.p.z() = -30; pose.X_WN.p.z() < 10; pose.X_WN.p.z() += 0.5) simulator.step(pose, state);
  std::cout << state.needles.states[0].forces.force_n.z() << " N, det > "
            << state.summary.certificate.det_bound << "\n";
}
