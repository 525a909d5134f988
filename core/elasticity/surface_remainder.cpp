#include "core/elasticity/surface_remainder.h"

#include <cmath>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/base/error.h"
#include "core/elasticity/kelvin_sums.h"
#include "core/elasticity/kelvin_traction.h"

namespace brachy {

using Eigen::Index;
using Eigen::Lower;
using Eigen::MatrixXd;

namespace {

// Cells of the faces that are held, or of those that are not.
std::vector<SurfacePatch> face_cells(const ElasticBody& body, bool held, int n) {
  std::vector<SurfacePatch> cells;
  for (std::size_t f = 0; f < body.held.size(); ++f) {
    if (body.held[f] != held) continue;
    const Index axis = static_cast<Index>(f / 2), a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double da = body.box_size[a] / n, db = body.box_size[b] / n;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        Vec3 centre = body.face_centre(f);
        centre[a] += (i + 0.5 - 0.5 * n) * da;
        centre[b] += (j + 0.5 - 0.5 * n) * db;
        cells.push_back({centre, ElasticBody::face_normal(f), da * db});
      }
  }
  return cells;
}

MatrixXd tractions(std::span<const SurfacePatch> at, const PointGroups& at_points, std::span<const Vec3> p,
                   std::span<const double> s, double poisson) {
  MatrixXd T(static_cast<Index>(3 * at.size()), static_cast<Index>(3 * p.size()));
  for (std::size_t j = 0; j < p.size(); ++j)
    for (std::size_t i = 0; i < at.size(); ++i)
      T.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * j)) =
          kelvin_traction(at[i].position - p[j], at[i].normal, at_points.s[i] + s[j], poisson);
  return T;
}

// Cholesky factor of M. On a smooth surface the spectrum of κ lies within (−½, ½), that of M between k and 1, and
// this is only checked; on coarse patches it may not, and is clipped, which takes an eigendecomposition.
MatrixXd stiffness_factor(const MatrixXd& kappa, double k) {
  const MatrixXd I = MatrixXd::Identity(kappa.rows(), kappa.cols());
  MatrixXd M = 0.5 * (k + 1) * I + (k - 1) * kappa;
  const auto positive = [](const MatrixXd& A) { return A.llt().info() == Eigen::Success; };
  if (!positive(M - std::min(k, 1.0) * I) || !positive(std::max(k, 1.0) * I - M)) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(kappa);
    const Eigen::VectorXd m = 0.5 * (k + 1) + (k - 1) * eigen.eigenvalues().array().max(-0.5).min(0.5);
    M = eigen.eigenvectors() * m.asDiagonal() * eigen.eigenvectors().transpose();
  }
  return M.llt().matrixL();
}

// (½ + κ)⁻¹ − 1 = U Uᵀ: what a free surface gives, tissue inside its normal and nothing outside. A flat face has κ = 0
// but for its edges; −½ is a rigid motion of tissue that nothing holds.
MatrixXd free_face_root(const MatrixXd& kappa) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(kappa);
  const Eigen::ArrayXd e = eigen.eigenvalues().array().max(-0.49).min(0.5);
  return eigen.eigenvectors() * (1 / (0.5 + e) - 1).sqrt().matrix().asDiagonal();
}

// K += sign · uᵀv, only its lower half where u is v.
template <class Rows>
void add_products(MatrixXd& K, const Rows& u, const Rows& v, double sign, bool same) {
  if (same)
    K.selfadjointView<Lower>().rankUpdate(u.transpose(), sign);
  else
    K.noalias() += sign * u.transpose() * v;
}

}  // namespace

/// Points that have joined the others.
struct SurfaceRemainder::Joined {
  PointGroups points;
  MatrixXd factor;   ///< L, of the kernel between them, condensed on the points before
  MatrixXd weighed;  ///< D h, N × 3n, of the points before
};

SurfaceRemainder::SurfaceRemainder(const ElasticBody& body, const SurfaceRemainderOptions& options)
    : poisson_(body.poisson) {
  if (body.regions.size() > 1)
    throw UserError("[[region]]: kernel = \"elastic\" takes one region, and there are " +
                    std::to_string(body.regions.size()) + "; use kernel = \"fem\"");
  join(face_cells(body, true, options.wall_cells), options.wall_core);
  walls_ = lower_.rows();
  if (const auto cells = face_cells(body, false, options.free_cells); !cells.empty()) {
    const Joined joined = join(cells, options.wall_core);
    free_root_ = free_face_root(spectral(cells, joined));
    free_ = lower_.rows() - walls_;
  }
  const double k = body.materials().back();
  if (k == 1) return;
  const auto patches = body.regions[0]->surface(static_cast<std::size_t>(options.capsule_points));
  const Joined joined = join(patches, options.capsule_core);
  stiffness_ = stiffness_factor(spectral(patches, joined), k);
  capsule_ = lower_.rows() - walls_ - free_;
}

// Appends the points' rows to L: what D h of the points before leaves of the kernel between the new ones, factored.
SurfaceRemainder::Joined SurfaceRemainder::join(std::span<const SurfacePatch> patches, double core) {
  Joined joined;
  for (const SurfacePatch& patch : patches) {
    joined.points.begin_group();
    joined.points.add(patch.position, 0.5 * core * core * patch.area, 1);
  }
  joined.points.finish();
  MatrixXd images = kelvin_rows(points_, s_, joined.points, poisson_);
  images_of(images);
  joined.weighed = images;
  weigh(joined.weighed);
  MatrixXd S = kelvin_between(joined.points, joined.points, poisson_);
  S.noalias() -= images.transpose() * joined.weighed;
  const Eigen::LLT<MatrixXd> factor(S);
  if (factor.info() != Eigen::Success)
    throw UserError(
        "[box], [[region]]: kernel = \"elastic\" cannot tell points of their surfaces apart; "
        "move the region off the faces or use kernel = \"fem\"");
  joined.factor = factor.matrixL();
  const Index before = lower_.rows(), n = S.rows();
  MatrixXd all = MatrixXd::Zero(before + n, before + n);
  all.topLeftCorner(before, before) = lower_;
  all.bottomLeftCorner(n, before) = joined.weighed.transpose();
  all.bottomRightCorner(n, n) = joined.factor;
  lower_.swap(all);
  points_.insert(points_.end(), joined.points.points.begin(), joined.points.points.end());
  s_.insert(s_.end(), joined.points.s.begin(), joined.points.s.end());
  return joined;
}

// κ of the points that joined last.
MatrixXd SurfaceRemainder::spectral(std::span<const SurfacePatch> patches, const Joined& joined) const {
  const Index n = joined.factor.rows(), before = lower_.rows() - n;
  const std::size_t sources = points_.size() - patches.size();
  const std::span<const Vec3> p = points_;
  const std::span<const double> s = s_;
  MatrixXd K = tractions(patches, joined.points, p.subspan(sources), s.subspan(sources), poisson_);
  MatrixXd strengths = joined.weighed;
  lower_.topLeftCorner(before, before).triangularView<Lower>().transpose().solveInPlace(strengths);
  K.noalias() -= tractions(patches, joined.points, p.first(sources), s.first(sources), poisson_) * strengths;
  for (Index i = 0; i < n; ++i) K.row(i) *= patches[static_cast<std::size_t>(i / 3)].area;
  K = joined.factor.triangularView<Lower>().transpose() * K;
  joined.factor.triangularView<Lower>().transpose().solveInPlace<Eigen::OnTheRight>(K);
  return 0.5 * (K + K.transpose());
}

// G(points, ·) → h
void SurfaceRemainder::images_of(MatrixXd& rows) const {
  lower_.triangularView<Lower>().solveInPlace(rows);
}

// h → D h
void SurfaceRemainder::weigh(MatrixXd& images) const {
  if (free_ == 0) return;
  const MatrixXd turned = free_root_.transpose() * images.middleRows(walls_, free_);
  images.middleRows(walls_, free_).noalias() = -free_root_ * turned;
}

Remainder::Parts SurfaceRemainder::between(const PointGroups& a, const PointGroups& b) const {
  const bool same = &a == &b;
  const auto split = [&](const PointGroups& groups) {  // h, the free faces' rows turned by Uᵀ
    MatrixXd h = kelvin_rows(points_, s_, groups, poisson_);
    images_of(h);
    if (free_ > 0)
      h.middleRows(walls_, free_) = (free_root_.transpose() * h.middleRows(walls_, free_)).eval();
    return h;
  };
  MatrixXd u = split(a), other;
  if (!same) other = split(b);
  MatrixXd& v = same ? u : other;
  Parts parts;
  parts.held = MatrixXd::Zero(u.cols(), v.cols());
  add_products(parts.held, u.topRows(walls_), v.topRows(walls_), 1, same);
  if (free_ > 0) add_products(parts.held, u.middleRows(walls_, free_), v.middleRows(walls_, free_), -1, same);
  if (capsule_ > 0) {
    add_products(parts.held, u.bottomRows(capsule_), v.bottomRows(capsule_), 1, same);
    for (MatrixXd* h : {&u, &other})
      if (h->size() > 0) {
        auto moved = h->bottomRows(capsule_);
        stiffness_.triangularView<Lower>().solveInPlace(moved);
      }
    parts.motion = MatrixXd::Zero(u.cols(), v.cols());
    add_products(parts.motion, u.bottomRows(capsule_), v.bottomRows(capsule_), 1, same);
  }
  if (same)
    for (MatrixXd* K : {&parts.held, &parts.motion})
      K->triangularView<Eigen::StrictlyUpper>() = K->transpose();
  return parts;
}

Remainder::Parts SurfaceRemainder::fields(std::span<const Vec3> X, const PointGroups& b,
                                          const MatrixXd& forces) const {
  MatrixXd held = kelvin_rows(points_, s_, b, poisson_) * forces;
  images_of(held);
  const Index sets = forces.cols();
  MatrixXd strengths = MatrixXd::Zero(held.rows(), capsule_ > 0 ? 2 * sets : sets);
  if (capsule_ > 0) {
    MatrixXd moved = held.bottomRows(capsule_);
    stiffness_.triangularView<Lower>().solveInPlace(moved);
    stiffness_.triangularView<Lower>().transpose().solveInPlace(moved);
    strengths.bottomRightCorner(capsule_, sets) = moved;
  }
  weigh(held);
  strengths.leftCols(sets) = held;
  lower_.triangularView<Lower>().transpose().solveInPlace(strengths);
  MatrixXd u = kelvin_fields(X, points_, s_, strengths, poisson_);
  Parts parts;
  parts.held = u.leftCols(sets);
  if (capsule_ > 0) parts.motion = u.rightCols(sets);
  return parts;
}

std::size_t SurfaceRemainder::bytes() const {
  const Index doubles = lower_.size() + free_root_.size() + stiffness_.size() + 4 * lower_.rows() / 3;
  return static_cast<std::size_t>(doubles) * sizeof(double);
}

}  // namespace brachy
