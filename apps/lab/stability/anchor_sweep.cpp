// An anchor beside a needle's path. Theory (core/DESIGN.md, section 4): at 0.25 mm it folds at 0.8–1.35 mm,
// at 1 mm at 2.1–3.4: reproduced by a needle pushed along itself, landmarks every 2.5 mm, the anchor midway
// between two of them, a = 6 and 12 mm. (ψ3,0 is a little below the second range.) Pushed towards an anchor
// beside a landmark nothing passes: it folds before the distance.
#include <fmt/format.h>

#include <algorithm>

#include "apps/lab/stability/pushed_methods.h"
#include "apps/lab/stability/sweeps.h"
#include "core/solve/rbf_system.h"

namespace brachy {
namespace {

constexpr double kMostAnchoredPush = 20, kShaftSpacing = 2.5;  // mm
constexpr std::size_t kLandmarks = 9;

/// `midway`: between the fifth and the sixth landmark, else beside the fifth.
PushedLandmarks with_anchor(const Vec3& middle, double distance, bool midway, const Vec3& direction) {
  PushedLandmarks landmarks = pushed_shaft(middle, kLandmarks, kShaftSpacing, direction);
  landmarks.add(middle + Vec3(distance, 0, midway ? -0.5 * kShaftSpacing : 0), Vec3::Zero());
  return landmarks;
}

StabilityRow fold_row(const PushedMethod& method, std::string sweep, const PushedLandmarks& landmarks) {
  StabilityRow row{.method = method.name,
                   .sweep = std::move(sweep),
                   .parameter = "mm",
                   .swept_to = kMostAnchoredPush,
                   .kind = "fold"};
  if (const PushedField field = method.field(landmarks)) {
    row.at_failure = field.fold(kMostAnchoredPush);
  } else {
    row.kind = "singular";
    row.at_failure = 0;
  }
  return row;
}

void sweep_psi(const StabilityScene& scene, StabilityReport& report) {
  for (const double a : {6.0, 12.0})
    for (const PushedMethod& method : psi_methods(a)) {
      for (const double distance : {0.25, 1.0, 0.5, 2.0, 3.0}) {
        if (scene.is_quick() && distance != 0.25 && distance != 1) continue;
        report.rows.push_back(fold_row(
            method, fmt::format("push along an anchor {:g} mm beside the path, a = {:g} mm", distance, a),
            with_anchor(scene.middle(), distance, true, Vec3::UnitZ())));
        if (distance == 0.25) report.rows.back().theory_range = {{0.8, 1.35}};
        if (distance == 1) report.rows.back().theory_range = {{2.1, 3.4}};
      }
      report.rows.push_back(
          fold_row(method, fmt::format("push towards an anchor 1 mm beside a landmark, a = {:g} mm", a),
                   with_anchor(scene.middle(), 1, false, Vec3::UnitX())));
      report.rows.back().theory = 1;
    }
}

/// How conservative the bound Σ|α_i| < a/M is against the actual fold: shafts with and without an anchor.
void measure_bound(const StabilityScene& scene, StabilityReport& report) {
  const double a = scene.support();
  for (const PushedMethod& method : psi_methods(a)) {
    const Kernel kernel = *find_kernel(method.name);
    std::optional<double> least, most;
    for (const double spacing : {5.0, 2.5, 1.25})
      for (const double distance : {0.0, 0.25, 1.0}) {
        if (scene.is_quick() && distance == 1) continue;
        PushedLandmarks landmarks = pushed_shaft(scene.middle(), kLandmarks, spacing, Vec3::UnitZ());
        if (distance > 0) landmarks.add(scene.middle() + Vec3(distance, 0, 0.5 * spacing), Vec3::Zero());
        const auto n = landmarks.positions.size();
        RbfSystem system(kernel, a, static_cast<int>(n));
        std::vector<Vec3> weights(n);
        if (!system.factorize(landmarks.positions)) continue;
        system.solve(landmarks.directions, weights);
        double sum = 0;
        for (const Vec3& alpha : weights) sum += alpha.norm();
        const auto fold = method.field(landmarks).fold(kMostAnchoredPush);
        if (!fold) continue;
        const double ratio = *fold * sum * max_slope(kernel) / a;
        least = std::min(ratio, least.value_or(ratio));
        most = std::max(ratio, most.value_or(ratio));
      }
    for (const auto& [name, ratio] : {std::pair("least", least), std::pair("most", most)})
      report.rows.push_back({.method = method.name,
                             .sweep = fmt::format("fold over the bound Σ|α| < a/M, shafts, {}", name),
                             .parameter = "ratio",
                             .at_failure = ratio,
                             .kind = "law",
                             .theory_range = {{2, 60}}});
  }
}

}  // namespace

void sweep_anchor(StabilityScene& scene, StabilityReport& report) {
  sweep_psi(scene, report);
  measure_bound(scene, report);
  for (const PushedMethod& method : other_methods(scene)) {
    if (scene.is_quick() && method.name == "fem") continue;  // a second
    // elastic and fem model the needle's radius: the anchor is beside its surface. A lattice of 4 mm does not resolve
    // where its landmarks are.
    const bool has_needle_radius = method.name == "elastic" || method.name == "fem";
    const double surface = has_needle_radius ? scene.body().needle_radius : 0;
    report.rows.push_back(fold_row(method, "push along an anchor 1 mm beside the path",
                                   with_anchor(scene.middle(), surface + 1, true, Vec3::UnitZ())));
  }
}

}  // namespace brachy
