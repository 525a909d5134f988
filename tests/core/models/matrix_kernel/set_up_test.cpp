// How much a model of small regions or of large tissue takes to set up: counts, not times.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "core/base/error.h"
#include "core/base/set_up.h"
#include "core/elasticity/elastic_kernel.h"
#include "core/elasticity/fem/fem_remainder.h"
#include "core/geometry/tissue/tissue.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/models/matrix_kernel/smooth_tables.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

ElasticBody body_with(std::initializer_list<Vec3> centres, double radius, double box_mm = 96) {
  ElasticBody body;
  body.box_size = Vec3::Constant(box_mm);
  for (const Vec3& centre : centres)
    body.regions.push_back(
        std::make_shared<EllipsoidRegion>(centre, Vec3::Constant(radius), 10 * body.shear_modulus));
  return body;
}

// Corners and middle of a tissue's box: tables need no more.
Tissue tissue_of(const Vec3& size) {
  std::vector<Vec3> points = {Vec3::Zero()};
  for (int corner = 0; corner < 8; ++corner)
    points.push_back(0.5 * Vec3(corner & 1 ? size.x() : -size.x(), corner & 2 ? size.y() : -size.y(),
                                corner & 4 ? size.z() : -size.z()));
  return build_tissue({}, points);
}

MeshBounds bounds_of(const Vec3& size) {
  return {-0.5 * size, 0.5 * size};
}

int widest_cells_across(const MeshPlanes& planes, double from, double to) {
  int least = 1000;
  for (const std::vector<double>& p : planes)
    least = std::min(
        least, static_cast<int>(std::ranges::count_if(p, [&](double x) { return x > from && x < to; })));
  return least;
}

TEST(MeshSizes, SmallRegionsKeepTheTablesWorkWithinItsLimit) {
  const MeshSizes sizes;
  const Vec3 gland(50, 40, 45);
  for (const double box_mm : {60.0, 96.0, 384.0})
    for (const double radius : {1.5, 3.0, 5.0, 8.0, 12.0, 20.0}) {
      SCOPED_TRACE(testing::Message() << box_mm << " mm, radius " << radius);
      const MeshPlanes planes =
          mesh_planes(body_with({Vec3::Zero()}, radius, box_mm), sizes, bounds_of(gland));
      EXPECT_LE(table_work(planes, bounds_of(gland)), sizes.max_work);
      EXPECT_GE(widest_cells_across(planes, -1.3 * radius, 1.3 * radius), 2);
    }
  const ElasticBody apart = body_with({{-18, 10, 15}, {18, -10, -15}}, 3);
  EXPECT_LE(table_work(mesh_planes(apart, sizes, bounds_of(gland)), bounds_of(gland)), sizes.max_work);
}

TEST(MeshSizes, ARegionThatFillsTheTissueKeepsItsCells) {
  ElasticBody body;
  body.regions.push_back(
      std::make_shared<EllipsoidRegion>(Vec3::Zero(), Vec3(24, 18, 21), 3 * body.shear_modulus));
  MeshSizes unlimited;
  unlimited.max_work = 1e30;
  EXPECT_EQ(mesh_planes(body, {}), mesh_planes(body, unlimited));
}

TEST(MeshSizes, RefuseInWordsWhatNoMeshCanDo) {
  MeshSizes sizes;
  sizes.max_work = 1e3;
  try {
    mesh_planes(body_with({Vec3::Zero()}, 5), sizes);
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("box.size_mm"), std::string::npos) << e.what();
  }
}

TEST(RemainderTable, LargeTissueHasNoMoreNodesThanItsLimit) {
  for (const double width : {200.0, 1000.0}) {
    ElasticBody body;
    body.box_size = Vec3::Constant(1.1 * width);
    const auto kernel = make_matrix_kernel("elastic", body);
    const auto tables = make_smooth_tables(tissue_of(Vec3(1, 0.8, 0.9) * width), *kernel, best_simd_target());
    EXPECT_LE(tables->remainder.nodes(), static_cast<std::size_t>(RemainderTable::kMaxSmoothNodes));
    EXPECT_GE(tables->remainder.nodes(), 700u);
  }
}

// The table's spreading of materials keeps K definite, also where it is coarse.
TEST(RemainderTable, LetsAShaftThroughAStiffNoduleBeSolved) {
  if (test::kIsSanitized) GTEST_SKIP() << "skipped: finite elements take long under a sanitizer";
  const Tissue tissue = tissue_of(Vec3(50, 40, 45));
  const ElasticBody body = body_with({{8, 0, 2}}, 8);
  MatrixKernelField field(tissue, "elastic", body, {.max_landmarks = 16, .evaluates_points = false});
  std::vector<Vec3> shaft;
  for (double z = -18; z <= 12; z += 3) {
    shaft.emplace_back(4, 1, z);
    EXPECT_TRUE(field.factorize(LandmarkSet::of(shaft, {}, std::vector<LandmarkSpread>(shaft.size())))) << z;
  }
}

// A small mesh with a stiff nodule in softer tissue.
struct FilledTable {
  explicit FilledTable(const SetUp& set_up) {
    const ElasticBody body = body_with({{4, 0, 2}}, 6, 60);
    FemOptions options;
    options.sizes.core_cells = 27;
    options.sizes.growth = options.sizes.coarse_growth = 2;
    const ElasticKernel kernel(body, std::make_unique<FemRemainder>(body, options));
    table = std::make_unique<RemainderTable>(tissue_of(Vec3(40, 30, 35)), kernel, 5, SimdTarget::kGeneric,
                                             set_up);
  }
  std::vector<float> column(std::uint32_t node) const {
    std::vector<float> field(table->field_size());
    table->add_column(node, node % 3, 1, field.data());
    return field;
  }
  std::unique_ptr<RemainderTable> table;
};

TEST(RemainderTable, IsTheSameBitsForAnyNumberOfThreads) {
  brachy::SetUp one, three;  // not gtest's
  one.threads = 1;
  three.threads = 3;
  const FilledTable a(one), b(three);
  ASSERT_EQ(a.table->nodes(), b.table->nodes());
  for (std::uint32_t node = 0; node < a.table->nodes(); ++node)
    EXPECT_EQ(a.column(node), b.column(node)) << node;
}

TEST(RemainderTable, ReportsProgressUpToOne) {
  std::vector<double> shares;
  brachy::SetUp set_up;
  set_up.threads = 1;
  set_up.progress = [&](double share) { shares.push_back(share); };
  const FilledTable table(set_up);
  ASSERT_GE(shares.size(), 3u);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GE(shares.front(), 0);
  EXPECT_DOUBLE_EQ(shares.back(), 1);
}

}  // namespace
}  // namespace brachy
