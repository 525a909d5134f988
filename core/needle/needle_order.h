#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/work_budget.h"
#include "core/needle/needle_contact.h"

namespace brachy {

/// The order in which needles' landmarks are put into the landmarks' system, which factors rows again from the first
/// that changed: of more than a few needles in the tissue (WorkBudget::few_needles), those whose landmarks have stayed
/// longest come first. A few are taken by number, whatever they do.
/// Threads: one. Real-time: no allocation after reserve.
class NeedleOrder {
 public:
  void reserve(std::size_t needles, std::size_t landmarks_of_one);
  /// Once a tick, with the landmarks of this tick.
  void update(std::span<const NeedleContact> contacts, const WorkBudget& budget = {}) noexcept;

  bool is_by_rest() const { return is_by_rest_; }
  std::span<const std::uint32_t> needles() const { return order_; }  ///< all of them

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(update_, changed_, places_, order_, is_by_rest_);
  }

 private:
  /// What its rows depend on.
  struct Place {
    Vec3 position;
    LandmarkSpread spread;
    template <class Archive>
    void list_state(Archive& archive) {
      archive(position, spread);
    }
    bool operator==(const Place&) const = default;
  };

  std::uint64_t update_ = 0;
  std::vector<std::uint64_t> changed_;      // of each needle, the update that found it elsewhere
  std::vector<std::vector<Place>> places_;  // of each needle, then
  std::vector<std::uint32_t> order_;
  bool is_by_rest_ = false;
};

}  // namespace brachy
