#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>

namespace brachy::test {

/// Fails the test where the rest of its block takes more processor time than this, but only in the campaign
/// scripts/campaigns/timed.sh, which sets BRACHY_TIMED and has the machine to itself: elsewhere a figure in seconds
/// says as much about the machine as about the code.
class MostProcessorTime {
 public:
  explicit MostProcessorTime(double seconds) : most_s_(seconds) {}
  ~MostProcessorTime() {
    if (std::getenv("BRACHY_TIMED")) {
      EXPECT_LT(static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC, most_s_);
    }
  }
  MostProcessorTime(const MostProcessorTime&) = delete;
  MostProcessorTime& operator=(const MostProcessorTime&) = delete;

 private:
  const double most_s_;
  const std::clock_t start_ = std::clock();
};

}  // namespace brachy::test
