#include "apps/brachyd/simulation_runs.h"

#include <boost/asio/post.hpp>
#include <cassert>
#include <exception>

namespace brachy {

void SimulationRuns::begin(const Scene& scene, bool goes_on,
                           std::function<void(const std::string&)> on_failure) {
  assert(!is_preparing_);
  is_preparing_ = true;
  const Tissue* tissue = &in_use_->simulator.tissue();  // stays until the next one is in use
  const auto make = [this, scene, goes_on, tissue, number = in_use_->number + 1,
                     failed = std::move(on_failure)] {
    std::shared_ptr<SimulationRun> made;
    std::string failure;
    try {
      made = std::make_shared<SimulationRun>(number, goes_on, scene, *tissue);
    } catch (const std::exception& e) {
      failure = e.what();
    }
    boost::asio::post(io_, [this, made, failure, failed] {
      if (!made) {
        is_preparing_ = false;
        return failed(failure);
      }
      next_ = made;
      writer_.slot() = made.get();
      writer_.publish();
    });
  };
  boost::asio::post(workers_, make);
}

bool SimulationRuns::seen(std::uint64_t run) {
  if (!next_ || run != next_->number) return false;
  in_use_ = std::move(next_);
  is_preparing_ = false;
  return true;
}

}  // namespace brachy
