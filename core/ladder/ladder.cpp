#include "core/ladder/ladder.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "core/elastic/elastic_kernel.h"
#include "core/elastic/surface_remainder.h"
#include "core/fem/fem_remainder.h"
#include "core/kernels/kernels.h"

namespace brachy {
namespace {

constexpr std::array<std::string_view, 4> kMatrixRungs = {"multiscale", "compact_elastic", "elastic", "fem"};

}  // namespace

std::vector<std::string> rung_names() {
  std::vector<std::string> names;
  for_each_kernel([&](auto kernel) { names.emplace_back(kernel.kName); });
  names.insert(names.end(), kMatrixRungs.begin(), kMatrixRungs.end());
  return names;
}

bool is_matrix_rung(std::string_view rung) {
  return std::find(kMatrixRungs.begin(), kMatrixRungs.end(), rung) != kMatrixRungs.end();
}

std::optional<CompactRung> find_compact_rung(std::string_view rung) {
  if (rung == "multiscale") return CompactRung::kMultiscale;
  if (rung == "compact_elastic") return CompactRung::kCompactElastic;
  return {};
}

std::unique_ptr<MatrixKernel> make_matrix_kernel(std::string_view rung, const ElasticBody& body) {
  if (const auto compact = find_compact_rung(rung))
    return std::make_unique<CompactKernel>(CompactKernel::of_body(body, *compact));
  if (rung == "elastic")
    return std::make_unique<ElasticKernel>(body, std::make_unique<SurfaceRemainder>(body));
  assert(rung == "fem");
  return std::make_unique<ElasticKernel>(body, std::make_unique<FemRemainder>(body));
}

}  // namespace brachy
