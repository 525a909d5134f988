// A loop of ticks in C++, which Python's are compared with: prints ticks a second, and processor time a tick.
//   engine_loop [KERNEL [TICKS]]    that of apps/python/examples/ticks_per_second.py
//   engine_loop SCENE.toml POSES    poses of needle 0 from a file of doubles, t×3×4; before one of NaN the run begins
//                                   again with the tissue at rest, as an environment's reset does
#include <chrono>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <fstream>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"

namespace {

using Poses = std::vector<brachy::NeedlePose>;

Poses in_and_out(int ticks) {
  Poses poses(static_cast<std::size_t>(ticks));
  for (std::size_t k = 0; k < poses.size(); ++k) {
    poses[k].present = true;
    poses[k].X_WN.p = {5, 0, -10 - 20 * std::cos(static_cast<double>(k) * 2 * std::numbers::pi / 2000)};
  }
  return poses;
}

Poses read_poses(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Poses poses;
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> X;
  while (file.read(reinterpret_cast<char*>(X.data()), sizeof(double) * 12)) {
    poses.emplace_back().present = X.allFinite();
    poses.back().X_WN.R = X.leftCols<3>();
    poses.back().X_WN.p = X.col(3);
  }
  return poses;
}

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "psi31";
  brachy::Scene scene;
  Poses poses;
  if (first.ends_with(".toml")) {
    scene = brachy::with_choice(brachy::load_scene(first));
    poses = read_poses(argc > 2 ? argv[2] : "");
  } else {
    scene.model.kernel = first;
    poses = in_and_out(argc > 2 ? std::stoi(argv[2]) : 20000);
  }
  if (poses.empty()) {
    std::cerr << "engine_loop: no poses\n";
    return 2;
  }
  brachy::Simulator simulator(brachy::load_simulation_model(scene, brachy::load_tissue(scene).tissue));
  const brachy::MeshState rest = simulator.initial_state();
  brachy::MeshState state = rest;
  std::vector<std::byte> at_rest;
  simulator.save(at_rest);
  double ticks = 0;
  const double processor_before = processor_s();
  const auto begin = std::chrono::steady_clock::now();
  for (const brachy::NeedlePose& pose : poses) {
    if (pose.present) {
      simulator.step(pose, state);
      ++ticks;
    } else {
      simulator.restore(at_rest);
      state = rest;
    }
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  std::cout << ticks / seconds.count() << " ticks/s, " << 1e6 * (processor_s() - processor_before) / ticks
            << " us of processor time a tick\n";
}
