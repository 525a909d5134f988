#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_goal.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// By how much dose figures differ; of a structure that the scene has not, NaN.
struct DoseChange {
  double d90_gy = 0, v100_percent = 0;            ///< of the prostate; > 0: more
  double urethra_d30_gy = 0, rectum_d2cc_gy = 0;  ///< > 0: more

  /// How bad it is, in % of the prescription and of the volume together: dose that the prostate lacks, and that the
  /// organs have too much.
  double harm_percent(double prescription_gy) const;
};

/// Of doses to the same structures.
DoseChange dose_change(const std::vector<StructureDose>& from, const std::vector<StructureDose>& to);
/// " (V100 -6.9 points, D90 -20.1 Gy)": what is worth telling of a change, the V100 in points of a percentage; empty:
/// nothing is.
std::string cost_text(const DoseChange& cost);

/// What a needle's errors cost: the implant as it is, against the same with this needle's seeds where the plan has
/// them.
struct NeedleCost {
  std::size_t needle = 0;  ///< index in Plan::needles
  DoseChange change;
};

/// A twelfth of the prostate: a third of its length (base, mid, apex), anterior or posterior, left or right of the
/// middle of its bounding box.
struct Sector {
  std::string name;  ///< "base anterior left"
  double volume_cc = 0;
  double cold_cc = 0;           ///< with less than the prescription
  Vec3 coldest = Vec3::Zero();  ///< mm, W
  double coldest_gy = 0;
};

struct HotSpot {
  Vec3 at = Vec3::Zero();  ///< mm, W
  double gy = 0;
  double over_150_cc = 0;  ///< of the structure, with more than 150 % of the prescription
};

struct Consequences {
  DoseChange whole;                 ///< the implant against the plan
  std::vector<NeedleCost> needles;  ///< the plan's, in its order
  DoseChange unplanned;             ///< of all seeds that are not in the plan: with them against without
  std::vector<Sector> sectors;      ///< all twelve, base first
  std::optional<HotSpot> urethra;   ///< its hottest place; none: the scene has no urethra
};

/// What the errors of several needles cost together: costs of single ones do not add up (where all seeds are missing,
/// no needle alone brings back much). Some 10 ms a question. References outlive this. Threads: one.
class NeedleCosts {
 public:
  /// `at_rest`: the dose of `seeds`, where they are at rest, with the prescription of the plan; its structures are the
  /// score's, "prostate" first.
  NeedleCosts(const Plan& plan, const TemplateGrid& grid, const ImplantDose& at_rest,
              const std::vector<Seed>& seeds);

  /// The implant as it is, against the same with the seeds of these needles (indices in Plan::needles) where the plan
  /// has them.
  DoseChange of(std::span<const std::size_t> needles) const;
  /// The implant as it is, against the same without the seeds `taken`, which it has, and with those `given`.
  DoseChange against(std::span<const DoseSeed> taken, std::span<const DoseSeed> given) const;
  /// Of all seeds that are not in the plan: with them against without.
  DoseChange of_unplanned() const;
  /// The implant against a dose of the plan to the same structures.
  DoseChange of_all(const std::vector<StructureDose>& planned) const;

 private:
  const ImplantDose& at_rest_;
  std::vector<StructureDose> as_is_;                    // of at_rest
  std::vector<std::vector<DoseSeed>> fallen_, wanted_;  // by the plan's needle
  std::vector<DoseSeed> unplanned_;
};

/// `costs`: of the same plan, dose and seeds. `planned`: the dose of the plan. Each needle is taken out and put in as
/// planned by itself.
Consequences find_consequences(const NeedleCosts& costs, const Plan& plan, const ImplantDose& at_rest,
                               const std::vector<StructureDose>& planned);

}  // namespace brachy
