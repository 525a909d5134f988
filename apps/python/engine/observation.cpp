#include "apps/python/engine/observation.h"

#include <cassert>
#include <cmath>

namespace brachy {
namespace {

/// Writes numbers one after the other.
class ObservationWriter {
 public:
  explicit ObservationWriter(std::span<double, kObservationSize> out) : out_(out) {}
  ~ObservationWriter() { assert(count_ == out_.size()); }
  ObservationWriter(const ObservationWriter&) = delete;
  ObservationWriter& operator=(const ObservationWriter&) = delete;

  void put(double x) { out_[count_++] = x; }
  void put(const Vec3& v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }

 private:
  std::span<double, kObservationSize> out_;
  std::size_t count_ = 0;
};

bool is_in_tissue(ContactState contact) {
  return contact == ContactState::kInserted || contact == ContactState::kThrough;
}

}  // namespace

void write_observation(const MeshState& state, const Simulator& simulator, std::size_t id,
                       std::span<double, kObservationSize> out) noexcept {
  const NeedleState& needle = state.needles.states[id];
  const NeedleShape& shape = needle.shape;
  const Vec3 tip = shape.is_bent ? shape.points.back() : needle.X_WN.p;
  // The probe, after the needles, has neither cut nor organs.
  const bool is_needle = id < simulator.needles().size();
  double organs_in = 0, organ_passes = 0;
  if (is_needle) {
    const std::size_t organs = simulator.model()->organs.size();
    for (const OrganContact& contact : std::span(state.needles.organ_contacts).subspan(id * organs, organs)) {
      organs_in += contact.is_in;
      organ_passes += contact.passes;
    }
  }
  const Certificate& certificate = state.summary.certificate;

  ObservationWriter writer(out);
  writer.put(tip);
  writer.put(shape.is_bent ? shape.tip_axis : Vec3(needle.X_WN.R.col(2)));
  writer.put(shape.is_bent ? shape.tip_deflection : Vec3(Vec3::Zero()));
  writer.put(is_needle && is_in_tissue(needle.contact) ? simulator.needles()[id].material_tip() : tip);
  writer.put(needle.forces.force_n);
  writer.put(needle.forces.axial_n);
  writer.put(needle.forces.lateral_n);
  writer.put(needle.forces.cutting_n);
  writer.put(needle.forces.friction_n);
  writer.put(needle.tip_depth_mm);
  writer.put(needle.insertion_depth_mm);
  writer.put(static_cast<double>(needle.contact));
  writer.put(organs_in);
  writer.put(organ_passes);
  writer.put(static_cast<double>(certificate.verdict));
  writer.put(std::isnan(certificate.det_bound) ? 0.0 : certificate.det_bound);
  writer.put(certificate.substeps);
  writer.put(certificate.held_mm);
  writer.put(state.summary.lag_mm);
  writer.put(state.summary.max_displacement_mm);
  writer.put(state.summary.step_flags);
}

}  // namespace brachy
