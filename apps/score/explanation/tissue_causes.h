#pragma once

#include <vector>

#include "apps/score/explanation/explanation.h"

namespace brachy {

/// What the tissue did between a seed's fall and its rest: causes of SeedDeviation::moved. Needles push the gland
/// before them, and most when their foremost seeds fall; so a needle's motion is compared with that of the others'
/// seeds at the same place in the train.
class TissueCauses {
 public:
  TissueCauses(const Deviations& deviations, Explanation& to);
  void find();

 private:
  void set_apart();
  void unpunctured();
  void dragged();
  void pushed();
  void swelling();
  void gland();
  std::vector<double> usual_along() const;
  std::vector<std::vector<std::size_t>> needles(bool with_apart) const;
  void take(Cause cause);
  bool is_right(std::size_t seed) const;

  const Deviations& deviations_;
  Explanation& to_;
  std::vector<Vec3> rest_;      // of each seed, mm: not explained yet
  std::vector<char> is_apart_;  // of each needle: it has a cause of its own
};

}  // namespace brachy
