#pragma once

#include <vector>

#include "apps/score/explanation/explanation.h"
#include "apps/score/explanation/needle_places.h"

namespace brachy {

/// What the hand did: causes of SeedDeviation::dropped, from the largest model to the smallest. Each takes its part
/// away from what the next ones see.
class HandCauses {
 public:
  HandCauses(const Deviations& deviations, Explanation& to);
  void find();

 private:
  void spacing_of_all();
  void spacing_of_needles();
  void template_motion();
  void depth_of_all();
  void measure_scatter();
  void exchanged();
  void groups_across();
  void groups_along();
  void single_seeds();
  void scatter();

  void take(Cause cause);
  void add_group(const PlaneMotion& motion, const std::vector<std::size_t>& places);
  void add_elsewhere(const NeedlePlace& place);
  void take_depth_of(Cause& cause, const NeedlePlace& place, std::size_t as_planned_for) const;
  void name_role(Cause::Kind kind, std::vector<char>& is_off);
  std::vector<std::size_t> off_across() const;
  bool is_right_across(const NeedlePlace& place) const;
  bool is_right_along(const NeedlePlace& place) const;
  std::size_t most_single() const;

  const Deviations& deviations_;
  Explanation& to_;
  std::vector<Vec3> rest_;           // of each seed, mm: not explained yet
  std::vector<NeedlePlace> places_;  // by rest_
  double across_mm_ = 2, along_mm_ = 2, seed_mm_ = 3, seed_across_mm_ = 3,
         hole_mm_ = 1;  // beyond the session's own scatter
  bool scatters_across_ = false, scatters_along_ = false;
};

}  // namespace brachy
