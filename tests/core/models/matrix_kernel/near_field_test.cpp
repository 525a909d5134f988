// What stands for rings far away, against all of their points.
#include "core/models/matrix_kernel/near_field.h"

#include <gtest/gtest.h>

#include "core/elasticity/elastic_body.h"
#include "core/kernels/matrix_kernel.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "tests/core/injectivity/random_scene.h"
#include "tests/core/models/blocks/small_tissue.h"

namespace brachy {
namespace {

constexpr double kLength = 6;  // mm, of the piece: 1.75 of it are more than 8 radii

class FarRings : public testing::Test {
 protected:
  FarRings() {
    const std::vector<Vec3> landmarks = {
        {0, 0, -1.5 * kLength}, {0, 0, -0.5 * kLength}, {0, 0, 0.5 * kLength}};
    rings_.reserve(landmarks.size());
    rings_.build(landmarks, {}, radius());
    const std::size_t count = rings_.rings().size();
    forces_.assign(count, Vec3::Zero());
    first_ = rings_.piece_at(0, count).count;
    end_ = first_ + rings_.piece_at(first_, count).count;
  }
  double radius() const { return body_.needle_radius; }

  // The largest |u − u of all points| / |u| at places that are `least` mm and up to a half more from any ring.
  double worst_error(double least) {
    std::vector<NearField::Piece> pieces;
    pieces.reserve(forces_.size());
    NearField::take_pieces(rings_, forces_, pieces);
    std::vector<NearSource> sources;
    test::RandomScenes random(5);
    double worst = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 X = random.between(least, 1.5 * least + kLength) * random.direction();
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t r = 0; r < forces_.size(); ++r)
        if (forces_[r] != Vec3::Zero()) nearest = std::min(nearest, (X - rings_.rings()[r].centre).norm());
      if (nearest < least || nearest > 1.5 * least) continue;
      Block box;
      box.min = box.max = X;
      box.count = 1;
      const BlockPoints<float> at{};
      BlockDisplacement<float> u{};
      near_.add_to_points(at, X, box, rings_, forces_, pieces, sources, u);
      const Vec3 all = near_.displacement_at(X, rings_, forces_);
      worst = std::max(worst, (Vec3(u.ux[0], u.uy[0], u.uz[0]) - all).norm() / all.norm());
    }
    return worst;
  }

  ElasticBody body_;
  Tissue tissue_ = test::small_phantom(Vec3::Zero());
  std::shared_ptr<const MatrixKernel> kernel_ = make_matrix_kernel("elastic", body_);
  NearField near_{tissue_, dynamic_cast<const ElasticKernel&>(*kernel_), 1, best_simd_target()};
  NeedleRings rings_;
  std::vector<Vec3> forces_;
  std::size_t first_ = 0, end_ = 0;  // rings of the last piece, away from the shaft's ends
};

TEST_F(FarRings, OneRingIsItsCentre) {
  for (const Vec3& force : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)}) {
    forces_.back() = force;  // the ring at the end has no neighbour to be one point with
    const double error = worst_error(NearField::kFarRadii * radius());
    EXPECT_LT(error, 0.005);
    EXPECT_GT(error, 1e-5);  // it is not summed by its points
  }
}

TEST_F(FarRings, TwoNeighboursAreOnePoint) {
  for (const Vec3& force : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)}) {
    forces_[first_ + 2] = force;
    forces_[first_ + 3] = 0.8 * force;
    const double error = worst_error(NearField::Piece::kFarPairs * radius());
    EXPECT_LT(error, 0.006);
    EXPECT_GT(error, 1e-5);
  }
}

TEST_F(FarRings, APieceOfShaftIsTwoPoints) {
  for (const Vec3& force : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)}) {
    for (std::size_t r = first_; r < end_; ++r)
      forces_[r] = (0.5 + static_cast<double>(r - first_) / static_cast<double>(end_ - first_)) * force;
    const double error = worst_error(NearField::Piece::kFarPieces * kLength);
    EXPECT_LT(error, 0.0023);
    EXPECT_GT(error, 1e-5);
  }
}

}  // namespace
}  // namespace brachy
