#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_goal.h"
#include "core/brachytherapy/dose/dose_grid.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/robust/implant_draw.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// Of a structure's box, mm: what a gland swells about.
Vec3 middle_of(const Structure& structure);

/// The dose of treatments that differ from their plan, quickly: TG-43U1 in float at points spread evenly over each
/// structure and what its surface may take in beside it. V100 of the gland is right to 0.3 points
/// (tests/apps/brachy/robust_draws.py); 0.1 cc of an organ has some 40 points.
/// Threads: const from any. Memory: some 0.5 MB.
class DrawnDose {
 public:
  /// Structures as of ImplantDose: closed, the gland first; of each the part that lies in the grid's voxels.
  DrawnDose(const std::vector<Structure>& structures, const DoseGrid& grid, double prescription_gy,
            const UncertaintySettings& uncertainty);

  /// The figures of all structures, in their order.
  std::vector<StructureDose> evaluate(const ImplantDraw& draw) const;

 private:
  enum class Kind { kGland, kUrethra, kOrgan };
  struct Part {
    std::string name;
    Kind kind = Kind::kOrgan;
    double point_mm3 = 0, step_mm = 0;  ///< what each point stands for, and the side of a cube of that volume
    std::array<std::vector<float>, 3> places;  ///< x, y, z of each point, mm
    std::vector<float> outside_mm;             ///< ascending, negative inside
  };
  static Part part_of(const Structure& structure, Kind kind, double most_outward_mm, const Vec3& least,
                      const Vec3& most);
  static double outline_mm(Kind kind, const ImplantDraw& draw);

  Vec3 middle_;
  double prescription_gy_;
  std::vector<Part> parts_;
};

/// A goal, what the plan has of it, and what treatments by the plan have.
struct RobustGoal {
  DoseGoal goal;
  double planned = 0;         ///< in the figure's unit
  std::vector<double> drawn;  ///< of each draw
  std::size_t met = 0;        ///< by so many of them

  double share_met() const { return static_cast<double>(met) / static_cast<double>(drawn.size()); }
  double quantile(double share) const;  ///< of `drawn`; the nearest
};

struct RobustSettings {
  UncertaintySettings uncertainty;
  SeedMisplacement misplacement;
  std::size_t draws = 1000;
  std::uint64_t random_seed = 1;
};

struct RobustResult {
  std::vector<RobustGoal> goals;  ///< those of structures that there are
  std::size_t all_met = 0;        ///< draws that meet all of them
  std::size_t worst = 0;          ///< the draw that misses them by most, as a share of each limit
};

/// Judges `settings.draws` treatments by plans. Goals of an implant are left out, as are those of structures that are
/// not there. `dose.prescription_gy` is the plans'. Deterministic, the same for any number of threads.
/// Threads: one. Not real-time: some 6 s for 1,000 draws of 20 catheters on two cores.
class RobustJudge {
 public:
  /// Errors: UserError where outlines are so uncertain that nothing may be left of a structure.
  RobustJudge(const std::vector<Structure>& structures, const DoseSettings& dose,
              const std::vector<DoseGoal>& goals, const RobustSettings& settings);

  /// Errors: UserError where no goal is left. `progress`, if any, is called with the share done, by this thread.
  RobustResult judge(const PlannedSources& plan, const std::function<void(double share)>& progress = {});

 private:
  std::vector<DoseGoal> goals_;
  RobustSettings settings_;
  Vec3 middle_;
  ImplantDose planned_;
  DrawnDose drawn_;
};

}  // namespace brachy
