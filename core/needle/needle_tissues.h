#pragma once

#include <memory>
#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/needle/contact_settings.h"

namespace brachy {

/// Which tissue lies where, and its contact forces on a needle. Tissue 0 is what lies in no part; of parts that
/// overlap, the last counts.
/// Threads: const functions may be called from any. Real-time: they do not allocate.
class NeedleTissues {
 public:
  struct Part {
    std::shared_ptr<const Region> where;
    TissueContact contact;
  };

  /// Contacts as for an 18 G needle; they are scaled to `diameter` (mm): cut and rubbed area both grow with it.
  NeedleTissues(const TissueContact& around, std::vector<Part> parts, double diameter);

  std::size_t at(const Vec3& X) const noexcept;  ///< of the rest position X, mm
  const TissueContact& operator[](std::size_t tissue) const { return contacts_[tissue]; }

 private:
  std::vector<std::shared_ptr<const Region>> regions_;
  std::vector<TissueContact> contacts_;
};

}  // namespace brachy
