// The loop of apps/python/examples/ticks_per_second.py in C++: prints ticks a second.   engine_loop [KERNEL [TICKS]]
#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>

#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"

int main(int argc, char** argv) {
  brachy::Scene scene;
  scene.model.kernel = argc > 1 ? argv[1] : "psi31";
  const int ticks = argc > 2 ? std::stoi(argv[2]) : 20000;
  brachy::Simulator simulator(brachy::load_simulation_model(scene, brachy::load_tissue(scene).tissue));
  brachy::MeshState state = simulator.initial_state();
  brachy::NeedlePose pose;
  pose.present = true;
  pose.X_WN.p.x() = 5;
  const auto begin = std::chrono::steady_clock::now();
  for (int k = 0; k < ticks; ++k) {
    pose.X_WN.p.z() = -10 - 20 * std::cos(k * 2 * std::numbers::pi / 2000);
    simulator.step(pose, state);
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  std::cout << ticks / seconds.count() << " ticks/s\n";
}
