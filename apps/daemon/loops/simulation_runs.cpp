#include "apps/daemon/loops/simulation_runs.h"

#include <algorithm>
#include <cassert>
#include <exception>
#include <utility>

#include "core/scene/load_simulation_model.h"

namespace brachy {

void SimulationRuns::begin(const Scene& scene, std::function<void(const std::string&)> on_failure) {
  const Tissue* tissue = &in_use_->simulator.tissue();  // stays until the next one is in use
  // One processor stays with the threads that run.
  SetUp set_up;
  set_up.threads = std::max<std::size_t>(1, set_up.threads - 1);
  build([scene, tissue, set_up] { return load_simulation_model(scene, *tissue, set_up); }, true,
        std::move(on_failure));
}

void SimulationRuns::restart(std::function<void(const std::string&)> on_failure) {
  build([model = in_use_->simulator.model()] { return model; }, false, std::move(on_failure));
}

void SimulationRuns::build(MakeModel make_model, bool resumes,
                           std::function<void(const std::string&)> on_failure) {
  assert(!is_preparing_);
  is_preparing_ = true;
  worker_.post([this, make = std::move(make_model), resumes, number = in_use_->number + 1,
                failed = std::move(on_failure)] {
    std::shared_ptr<SimulationRun> built;
    std::string failure;
    try {
      built = std::make_shared<SimulationRun>(number, resumes, make());
    } catch (const std::exception& e) {
      failure = e.what();
    }
    loop_.post([this, built, failure, failed] {
      if (!built) {
        is_preparing_ = false;
        return failed(failure);
      }
      next_ = built;
      if (on_model) on_model(built->number, built->simulator.model());
      next_for_loop_.writer.slot() = built.get();
      next_for_loop_.writer.publish();
    });
  });
}

bool SimulationRuns::on_snapshot(std::uint64_t run) {
  if (!next_ || run != next_->number) return false;
  in_use_ = std::move(next_);
  is_preparing_ = false;
  return true;
}

}  // namespace brachy
