#include "core/scene/load_tissues.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/load_body.h"

namespace brachy {
namespace {

[[noreturn]] void refuse(const RegionSettings& region, const std::string& what) {
  throw UserError((region.place.empty() ? "[[region]]" : region.place) + ": " + what);
}

/// What sets one tissue apart from another.
struct Kind {
  double support_mm, shear_modulus;
  bool operator==(const Kind&) const = default;
};

std::shared_ptr<const RegionDistance> load_distance(const Scene& scene, const RegionSettings& s) {
  if (s.shape != "mesh") return std::make_shared<EllipsoidDistance>(s.centre_mm, s.semi_axes_mm);
  return std::make_shared<SampledDistance>(SurfaceBvh(load_region_mesh(scene, s)), s.blend_mm);
}

/// It only says what a needle meets there.
bool is_only_contact(const RegionSettings& region) {
  return !region.shear_modulus_kpa && !region.support_radius_mm;
}

/// Every region's membership in kinds[0], which is what lies in no region, or one that is appended here.
Membership sort_regions(const Scene& scene, bool by_modulus, std::vector<Kind>& kinds) {
  std::vector<Membership::Part> parts;
  for (const RegionSettings& settings : scene.regions) {
    if (is_only_contact(settings)) continue;
    const bool has_modulus = by_modulus && settings.shear_modulus_kpa;
    const Kind kind{*settings.support_radius_mm,
                    has_modulus ? 1e-3 * *settings.shear_modulus_kpa : kinds.front().shear_modulus};
    auto at = std::ranges::find(kinds, kind);
    if (at == kinds.end()) {
      if (kinds.size() == Membership::kMaxTissues)
        refuse(settings, "more than " + std::to_string(Membership::kMaxTissues) +
                             " tissues; give some regions the same support_radius_mm");
      at = kinds.insert(at, kind);
    }
    parts.push_back(
        {load_distance(scene, settings), settings.blend_mm, static_cast<std::size_t>(at - kinds.begin())});
  }
  return {std::move(parts), kinds.size()};
}

}  // namespace

bool has_supports(const Scene& scene, std::string_view model_name) {
  const std::string name(model_name);
  if (knows_forces(model_name)) {
    for (const RegionSettings& region : scene.regions)
      if (!region.shear_modulus_kpa && !is_only_contact(region))
        refuse(region, "'region.shear_modulus_kpa' is missing; " + name + " needs it of every region");
    return false;
  }
  const auto has_support = [](const RegionSettings& region) { return region.support_radius_mm.has_value(); };
  if (std::ranges::none_of(scene.regions, has_support)) return false;
  for (const RegionSettings& region : scene.regions)
    if (!has_support(region) && !is_only_contact(region))
      refuse(region,
             "'region.support_radius_mm' is missing; " + name + " needs it of every region where one has it");
  return true;
}

TissueModel<ScalarKernels> load_scalar_tissues(const Scene& scene, Kernel psi, double support_mm) {
  std::vector<Kind> kinds = {{support_mm, 0}};
  Membership membership = sort_regions(scene, false, kinds);
  ScalarKernels kernels{psi, {}};
  for (const Kind& kind : kinds) kernels.supports.push_back(kind.support_mm);
  return {std::move(membership), std::move(kernels)};
}

TissueModel<CompactKernels> load_compact_tissues(const Scene& scene, const ElasticBody& body) {
  std::vector<Kind> kinds = {{0.5 * body.box_size.minCoeff(), body.shear_modulus}};
  Membership membership = sort_regions(scene, true, kinds);
  CompactKernels kernels;
  for (const Kind& kind : kinds) {
    ElasticBody of_kind = body;
    of_kind.box_size.setConstant(2 * kind.support_mm);
    of_kind.shear_modulus = kind.shear_modulus;
    kernels.kernels.push_back(CompactKernel::of_body(of_kind));
  }
  return {std::move(membership), std::move(kernels)};
}

}  // namespace brachy
