#include "apps/lab/compare/models.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "apps/lab/comparators/chainmail.h"
#include "apps/lab/comparators/global_spline.h"
#include "apps/lab/comparators/mass_spring.h"
#include "apps/lab/comparators/paper_csrbf.h"
#include "apps/lab/compare/engine_model.h"
#include "apps/lab/compare/exact_model.h"

namespace brachy {
namespace {

/// GlobalSpline with c of a multiquadric from the scene: the needle's radius, on which its landmarks stand for a
/// needle.
class Multiquadric : public ComparedModel {
 public:
  explicit Multiquadric(bool holds_walls) : holds_walls_(holds_walls) {}
  void set_up(const ComparedScene& scene) override {
    spline_ =
        std::make_unique<GlobalSpline>(SplineBasis::multiquadric(scene.body.needle_radius), holds_walls_);
    spline_->set_up(scene);
  }
  void tick(std::span<const Vec3> displacements) override { spline_->tick(displacements); }
  void read(std::span<Vec3> u) const override { spline_->read(u); }
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override {
    return spline_->displacements_at(X);
  }

 private:
  bool holds_walls_;
  std::unique_ptr<GlobalSpline> spline_;
};

template <class Model, class... Settings>
ModelEntry entry(std::string name, std::string family, Settings... settings) {
  return {std::move(name), std::move(family), [=] { return std::make_unique<Model>(settings...); }};
}

// With anchors, and with a surface's points.
constexpr std::array<std::pair<bool, bool>, 3> kVariants = {{{false, false}, {true, false}, {false, true}}};
constexpr std::size_t kSurfacePoints = 1520;  // field and targets; the phantom's surface has 1,200

// mm. The paper's 6 and 12; 24 is close to the best for every kernel, 48 reaches the walls.
constexpr std::array<double, 9> kSupports = {6, 8, 12, 16, 24, 32, 48, 64, 96};
constexpr std::array<double, 2> kListedSupports = {12, 24};

void add_psi(std::vector<ModelEntry>& models, bool quick) {
  for_each_kernel([&](auto kernel) {
    for (const double support : kSupports)
      for (const auto& [anchors, surface] : kVariants) {
        const Sparing sparing{1, surface ? kSurfacePoints : 0};
        ModelEntry model{
            fmt::format("{}_a{:g}{}{}", kernel.kName, support, anchors ? "_anchors" : "",
                        surface ? "_surface" : ""),
            "psi", [=, anchors = anchors] { return EngineModel::psi(kernel, support, anchors, sparing); }};
        model.listed = !surface && std::ranges::find(kListedSupports, support) != kListedSupports.end();
        model.is_surface = surface;
        model.kernel = kernel.kName;
        model.support_mm = support;
        model.has_anchors = anchors;
        if (!quick || model.listed) models.push_back(std::move(model));
      }
  });
}

// The matrix-valued models, each also with half of the landmarks and with the points of a surface.
void add_matrix(std::vector<ModelEntry>& models, bool quick) {
  for (const std::string& model_name : all_model_names()) {
    if (!is_matrix_model(model_name)) continue;
    for (const std::size_t every : {1, 2})
      for (const bool surface : {false, true}) {
        const Sparing sparing{every, surface ? kSurfacePoints : 0};
        ModelEntry model{model_name + (every > 1 ? "_sparse" : "") + (surface ? "_surface" : ""), "matrix",
                         [=] { return EngineModel::matrix(model_name, sparing); }};
        model.kernel = model_name;
        model.every_landmark = every;
        model.is_surface = surface;
        model.listed = every == 1 && !surface;
        if (!quick || model.listed) models.push_back(std::move(model));
      }
  }
}

}  // namespace

std::vector<ModelEntry> all_models(bool quick) {
  std::vector<ModelEntry> models;
  add_psi(models, quick);
  add_matrix(models, quick);
  for (const char* model_name : {"elastic", "fem"})
    models.push_back(entry<ExactModel>(std::string(model_name) + "_exact", "exact", std::string(model_name)));
  for (const bool walls : {false, true}) {
    const std::string suffix = walls ? "_walls" : "";
    models.push_back(entry<GlobalSpline>("thin_plate" + suffix, "spline", SplineBasis::thin_plate(), walls));
    models.push_back(entry<Multiquadric>("multiquadric" + suffix, "spline", walls));
  }
  for (const double spacing : {8.0, 4.0})
    models.push_back(entry<MassSpring>(fmt::format("mass_spring_{:g}mm", spacing), "springs", spacing));
  models.push_back(entry<ChainMail>("chainmail_4mm", "chainmail", 4.0));
  models.push_back(entry<PaperCsrbf>("paper_csrbf_psi31_a12", "paper", Kernel(Wendland31{}), 12.0));
  models.back().kernel = "psi31";
  models.back().support_mm = 12;
  models.back().has_anchors = true;
  return models;
}

}  // namespace brachy
