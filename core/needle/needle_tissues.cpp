#include "core/needle/needle_tissues.h"

namespace brachy {

NeedleTissues::NeedleTissues(const TissueContact& around, std::vector<Part> parts, double diameter) {
  contacts_.push_back(around);
  for (Part& part : parts) {
    regions_.push_back(std::move(part.where));
    contacts_.push_back(part.contact);
  }
  const double scale = diameter / NeedleSettings::kReferenceDiameter;
  for (TissueContact& contact : contacts_)
    for (double* force : {&contact.puncture_force_n, &contact.capsule_n_per_mm, &contact.capsule_n_per_mm2,
                          &contact.cutting_force_n, &contact.friction_n_per_mm})
      *force *= scale;
}

std::size_t NeedleTissues::at(const Vec3& X) const noexcept {
  for (std::size_t r = regions_.size(); r > 0; --r)
    if (regions_[r - 1]->inside_share(X) >= 0.5) return r;
  return 0;
}

}  // namespace brachy
