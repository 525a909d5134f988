// Push depth over support. Theory (core/DESIGN.md, section 4): one landmark folds at |d| = a/M, M = max|ψ′|;
// Φ at a = 2.4576 |d|; a regularised Kelvin point at 2.57 core radii c, a force of 32 μc². Eight anchors at λ
// = ½ have no effect at a = 6 mm; from a = 40 mm on they cap the push of a contact at about half the local
// radius, 9–11 mm (section 2).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/lab/stability/pushed_methods.h"
#include "apps/lab/stability/sweeps.h"
#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/kelvin.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"

namespace brachy {
namespace {

constexpr double kMostPush = 40;  // mm: beyond any gland

PushedLandmarks one_landmark(const Vec3& at) {
  PushedLandmarks one;
  one.add(at, Vec3::UnitZ());
  return one;
}

/// The regularised Kelvin solution of one point of core radius 1 mm, evaluated with a core radius.
Gradients kelvin_point(double poisson, double core_of_fields) {
  const double s = 0.5 + 0.5 * core_of_fields * core_of_fields;
  return gradients_by_differences([=](std::span<const Vec3> X) {
    std::vector<Vec3> u;
    for (const Vec3& x : X)
      u.emplace_back(kelvin(x, s, poisson).col(2) / kelvin(Vec3::Zero(), 1, poisson)(2, 2));
    return u;
  });
}

void add_curve(StabilityReport& report, const StabilityRow& row, const PushedField& field, double unit) {
  StabilityCurve curve{row.method, row.sweep, row.parameter, {}};
  const double most = row.at_failure ? 1.6 * *row.at_failure : row.swept_to;
  for (int k = 0; k <= 16; ++k) {
    curve.at.push_back(most * k * k / 256);
    curve.min_det.push_back(field.least_det(curve.at.back() * unit));
  }
  report.curves.push_back(std::move(curve));
}

/// A row of kind "fold" with at_failure in units of `unit` mm, and the least det on the way there.
void add_fold(StabilityReport& report, StabilityRow row, const PushedField& field, double unit) {
  row.kind = "fold";
  row.swept_to = kMostPush / unit;
  if (!field) {
    row.kind = "singular";
    row.at_failure = 0;
  } else {
    if (const auto push = field.fold(kMostPush)) row.at_failure = *push / unit;
    add_curve(report, row, field, unit);
  }
  report.rows.push_back(std::move(row));
}

/// The displacement at a lone landmark of a model with cores: √2 times its push, since the model prescribes the mean
/// about the landmark.
void measure_lone_landmark(StabilityScene& scene, const std::string& model_name, StabilityReport& report) {
  const std::vector<std::string> models = scene.models();
  if (std::ranges::find(models, model_name) == models.end()) return;
  const PushedLandmarks one = one_landmark(scene.middle());
  MatrixKernelSystem system(scene.kernel(model_name));
  if (!system.factorize(one.positions)) return;
  const Vec3 u = system.evaluate(one.positions, system.solve(one.directions)).front();
  report.rows.push_back({.method = model_name,
                         .sweep = "displacement at a lone landmark over its push",
                         .parameter = "ratio",
                         .at_failure = u.norm(),
                         .kind = "inaccurate",
                         .theory = std::numbers::sqrt2});
}

void sweep_one_landmark(StabilityScene& scene, StabilityReport& report) {
  const PushedLandmarks one = one_landmark(scene.middle());
  const double a = scene.support();
  for (const PushedMethod& method : psi_methods(a))
    add_fold(report,
             {.method = method.name,
              .sweep = "push, one landmark",
              .parameter = "|d|/a",
              .theory = 1 / max_slope(*find_kernel(method.name))},
             method.field(one), a);
  const CompactKernel phi({{a, 0, 1}}, 1);
  const auto search_one = [](Gradients gradients, const Vec3& at, double scale) {
    return linear_field(std::move(gradients), samples_around(std::vector{at}, scale), scale / 12);
  };
  add_fold(report,
           {.method = "phi", .sweep = "push, one landmark", .parameter = "|d|/a", .theory = 1 / 2.4576},
           search_one(matrix_gradients(phi, one), scene.middle(), a), a);
  // Evaluated with the landmark's own core, as in core/DESIGN.md, section 3, u is d there. The model evaluates points
  // without a core (kelvin.h), so that it prescribes the mean about the landmark: there u is √2 d of a core of c/√2,
  // which folds at half the push.
  const double poisson = scene.body().poisson;
  for (const bool has_core : {true, false})
    add_fold(report,
             {.method = "elastic",
              .sweep = has_core ? "push, one point, looked at with its core"
                                : "push, one point, as the model looks at it",
              .parameter = "|d|/core",
              .theory = has_core ? 2.57 : 2.57 / 2},
             search_one(kelvin_point(poisson, has_core ? 1 : 0), Vec3::Zero(), 3), 1);
  const StabilityRow with_core = report.rows[report.rows.size() - 2];
  report.rows.push_back({.method = "elastic",
                         .sweep = "force at the fold of a point looked at with its core, over μ core²",
                         .parameter = "ratio",
                         .at_failure = *with_core.at_failure / kelvin(Vec3::Zero(), 1, poisson)(2, 2),
                         .kind = "law",
                         .theory = 32});
  for (const char* model_name : {"elastic", "fem"}) measure_lone_landmark(scene, model_name, report);
  for (const PushedMethod& method : other_methods(scene))
    add_fold(report, {.method = method.name, .sweep = "push, one landmark", .parameter = "mm"},
             method.field(one), 1);
}

void sweep_shaft(StabilityScene& scene, StabilityReport& report) {
  constexpr std::size_t kLandmarks = 5;
  std::vector<PushedMethod> methods = psi_methods(scene.support());
  for (PushedMethod& method : other_methods(scene)) methods.push_back(std::move(method));
  for (const auto& [direction, name] : {std::pair{Vec3(Vec3::UnitZ()), "push, shaft, along"},
                                        std::pair{Vec3(Vec3::UnitX()), "push, shaft, across"}}) {
    const PushedLandmarks shaft =
        pushed_shaft(scene.middle(), kLandmarks, scene.landmark_spacing(), direction);
    for (const PushedMethod& method : methods)
      if (!scene.is_quick() || method.name != "fem")  // a second
        add_fold(report, {.method = method.name, .sweep = name, .parameter = "mm"}, method.field(shaft), 1);
  }
}

/// The tip on the surface, pushing towards the middle, and the scene's anchors: the least over contacts all round.
void sweep_contact(const StabilityScene& scene, StabilityReport& report) {
  for (const double a : {6.0, 40.0})
    for (const PushedMethod& method : psi_methods(a)) {
      StabilityRow row{.method = method.name,
                       .sweep = fmt::format("push, contact with the scene's anchors, a = {:g} mm", a),
                       .parameter = "mm",
                       .swept_to = kMostPush,
                       .kind = "fold"};
      if (a < 40)  // the anchors are out of reach
        row.theory = a / max_slope(*find_kernel(method.name));
      else
        row.theory_range = {{9, 11}};
      for (std::size_t k = 0; k < compass().size(); k += scene.is_quick() ? 5 : 1) {
        const Vec3& direction = compass()[k];
        const Vec3 tip = *std::ranges::max_element(scene.surface(), {}, [&](const Vec3& v) {
          return direction.dot((v - scene.middle()).normalized());
        });
        PushedLandmarks contact;
        contact.add(tip, (scene.middle() - tip).normalized());
        for (const Vec3& anchor : scene.anchors()) contact.add(anchor, Vec3::Zero());
        const auto push = method.field(contact).fold(kMostPush);
        if (push && push < row.at_failure.value_or(kMostPush)) row.at_failure = push;
      }
      report.rows.push_back(std::move(row));
    }
}

/// The least and the largest det at |d| = a/10.
void measure_bands(const StabilityScene& scene, StabilityReport& report) {
  const double a = scene.support();
  const PushedLandmarks one = one_landmark(scene.middle());
  const CompactKernel phi({{a, 0, 1}}, 1);
  const auto band = [&](const char* name, Gradients gradients, double low, double high) {
    DetSearch search(std::move(gradients), samples_around(one.positions, a), a / 12);
    const auto add = [&](const char* which, double measured, double theory) {
      report.rows.push_back({.method = name,
                             .sweep = std::string(which) + " det at |d|/a = 0.1",
                             .parameter = "det",
                             .at_failure = measured,
                             .kind = "law",
                             .theory = theory});
    };
    add("least", search.least(a / 10).det, low);
    add("largest", search.most(a / 10).det, high);
  };
  band("phi", matrix_gradients(phi, one), 0.951, 1.047);
  band("psi31", psi_gradients(Wendland31{}, a, one), 0.789, 1.211);
}

}  // namespace

void sweep_push(StabilityScene& scene, StabilityReport& report) {
  sweep_one_landmark(scene, report);
  measure_bands(scene, report);
  sweep_shaft(scene, report);
  sweep_contact(scene, report);
}

}  // namespace brachy
