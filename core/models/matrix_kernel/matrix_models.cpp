#include "core/models/matrix_kernel/matrix_models.h"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/elastic_kernel.h"
#include "core/elasticity/fem/fem_remainder.h"
#include "core/elasticity/wall_remainder.h"
#include "core/kernels/kernels.h"

namespace brachy {
namespace {

using KernelPointer = std::unique_ptr<MatrixKernel>;
using TissueBounds = std::optional<MeshBounds>;

KernelPointer make_compact(const ElasticBody& body, const TissueBounds&) {
  return std::make_unique<CompactKernel>(CompactKernel::of_body(body));
}

KernelPointer make_fem(const ElasticBody& body, const TissueBounds& tissue) {
  FemOptions options;
  options.tissue = tissue;
  return std::make_unique<ElasticKernel>(body, std::make_unique<FemRemainder>(body, options));
}

// What holds the tissue decides: sources on held faces, which take milliseconds to make; finite elements where there
// are regions or free faces, on which they are more accurate (tests/reference/README.md).
KernelPointer make_accurate(const ElasticBody& body, const TissueBounds& tissue) {
  const bool has_regions = std::ranges::any_of(
      body.regions, [&](const auto& region) { return region->shear_modulus != body.shear_modulus; });
  if (has_regions || std::ranges::find(body.held, false) != body.held.end()) return make_fem(body, tissue);
  ElasticBody even = body;
  even.regions.clear();
  return std::make_unique<ElasticKernel>(even, std::make_unique<WallRemainder>(even));
}

struct ListedModel {
  std::string_view name;
  bool is_compact;
  KernelPointer (*make)(const ElasticBody& body, const TissueBounds& tissue);
};

// The matrix-valued models, cheapest first. Everything that names them reads this list.
constexpr ListedModel kMatrixModels[] = {
    {"compact_elastic", true, make_compact}, {"elastic", false, make_accurate}, {"fem", false, make_fem}};

const ListedModel* find_matrix_model(std::string_view name) {
  const ListedModel* found = std::ranges::find(kMatrixModels, name, &ListedModel::name);
  return found == std::end(kMatrixModels) ? nullptr : found;
}

}  // namespace

std::vector<std::string> all_model_names() {
  std::vector<std::string> names;
  for_each_kernel([&](auto kernel) { names.emplace_back(kernel.kName); });
  for (const ListedModel& model : kMatrixModels) names.emplace_back(model.name);
  return names;
}

bool is_matrix_model(std::string_view model_name) {
  return find_matrix_model(model_name) != nullptr;
}

bool is_compact_model(std::string_view model_name) {
  const ListedModel* model = find_matrix_model(model_name);
  return model && model->is_compact;
}

std::string_view retired_model_advice(std::string_view model_name) {
  if (model_name == "multiscale")
    return "was removed: compact_elastic costs the same and errs less; take compact_elastic, or psi31";
  return {};
}

std::unique_ptr<MatrixKernel> make_matrix_kernel(std::string_view model_name, const ElasticBody& body,
                                                 std::span<const Vec3> points) {
  const ListedModel* model = find_matrix_model(model_name);
  assert(model);
  TissueBounds bounds;
  if (!points.empty()) bounds = {points.front(), points.front()};
  for (const Vec3& X : points) *bounds = {bounds->min.cwiseMin(X), bounds->max.cwiseMax(X)};
  return model->make(body, bounds);
}

}  // namespace brachy
