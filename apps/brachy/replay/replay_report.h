#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/forces/force_summary.h"
#include "apps/reports/certificate_tally.h"
#include "core/simulation/simulator.h"

namespace brachy {

/// Totals of a run of `brachy replay --offline`.
class ReplayTally {
 public:
  /// `needles`: ids that the trajectory moves, ascending.
  explicit ReplayTally(const std::vector<std::uint32_t>& needles);

  /// One tick. `finite`: all that it changed is.
  void add(double t_s, const MeshState& state, bool finite);

  /// The result as JSON on one line, or as readable text.
  std::string to_json(const Simulator& simulator, const std::string& state_hash) const;
  std::string to_text(const Simulator& simulator, const std::string& state_hash) const;

 private:
  struct Needle {
    std::uint32_t id = 0;
    ContactState contact = ContactState::kFree;
    std::uint32_t punctures = 0;
    ForcePeaks peaks;
    ForceWork work;
  };
  std::uint32_t punctures() const;
  double max_depth_mm() const;
  /// The hands' work, all of which is dissipated where no needle is in the tissue in the end; else NaN: part is stored.
  double dissipated_nmm() const;

  std::vector<Needle> needles_;
  CertificateTally certificates_;
  std::uint64_t ticks_ = 0, in_contact_ = 0;
  std::uint32_t seeds_ = 0;
  double max_displacement_ = 0;
  std::uint32_t max_moved_ = 0, all_flags_ = 0;
};

}  // namespace brachy
