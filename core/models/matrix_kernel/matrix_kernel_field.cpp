#include "core/models/matrix_kernel/matrix_kernel_field.h"

#include <algorithm>
#include <cassert>
#include <Eigen/Eigenvalues>
#include <numeric>
#include <utility>

#include "core/base/error.h"
#include "core/base/share_out.h"
#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/elastic_kernel.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/matrix_models.h"

namespace brachy {
namespace {

constexpr double kOutside = 1e-6;  // mm

bool is_elastic(const MatrixKernel& kernel) {
  return dynamic_cast<const ElasticKernel*>(&kernel) != nullptr;
}

// `elastic` and `fem` yield forces in N; a compact kernel is scaled to the stiffness, if one is given.
double force_scale_of(const MatrixKernel& kernel, double landmark_stiffness) {
  if (is_elastic(kernel) || !(landmark_stiffness > 0)) return 1;
  return landmark_stiffness * dynamic_cast<const CompactKernel&>(kernel).value(Vec3::Zero())(0, 0);
}

}  // namespace

void require_in_box(const Tissue& tissue, const ElasticBody& body) {
  for (const Block& block : tissue.blocks)
    for (const Vec3& corner : {block.min, block.max})
      if (((corner - body.box_centre).cwiseAbs() - 0.5 * body.box_size).maxCoeff() > kOutside)
        throw UserError(
            "the tissue reaches out of [box], which says what holds it; raise box.size_mm or move "
            "box.centre_mm");
}

MatrixKernelField::MatrixKernelField(const Tissue& tissue, std::string_view model_name,
                                     const ElasticBody& body, const Options& options)
    : MatrixKernelField(tissue, (require_in_box(tissue, body), make_matrix_kernel(model_name, body)), body,
                        options) {}

MatrixKernelField::MatrixKernelField(const Tissue& tissue, std::shared_ptr<const MatrixKernel> kernel,
                                     const ElasticBody& body, const Options& options)
    : MatrixKernelField(tissue, kernel, make_smooth_tables(tissue, *kernel, options.target), body, options) {}

MatrixKernelField::Factorized::Factorized(const Options& options)
    : near_matrix(options.max_landmarks, options.target),
      factor(options.max_landmarks, options.target, options.keeps_matrix ? options.max_landmarks / 2 : 0),
      beam_columns(options.max_landmarks) {}

MatrixKernelField::MatrixKernelField(const Tissue& tissue, std::shared_ptr<const MatrixKernel> kernel,
                                     std::shared_ptr<const SmoothTables> tables, const ElasticBody& body,
                                     const Options& options)
    : TissueField({.max_landmarks = options.max_landmarks,
                   .force_scale = force_scale_of(*kernel, options.landmark_stiffness_n_per_mm),
                   .uses_spreads = is_elastic(*kernel),  // to the compact kernels landmarks are points
                   .gives_way = true}),
      threads_(options.threads),
      evaluates_points_(options.evaluates_points),
      needle_radius_(body.needle_radius),
      kernel_(std::move(kernel)),
      factorized_(options),
      all_blocks_(tissue.blocks.size()),
      displacements_(tissue.blocks.size()),
      sources_(static_cast<std::size_t>(std::max(1, options.threads))) {
  require_in_box(tissue, body);
  const std::size_t n = options.max_landmarks;
  if (const auto* elastic = dynamic_cast<const ElasticKernel*>(kernel_.get())) {
    assert(tables);
    smooth_.emplace(*elastic, std::move(tables), options.target, n);
    near_.emplace(tissue, *elastic, smooth_->near_weight(), options.target);
  } else {
    const auto& compact = dynamic_cast<const CompactKernel&>(*kernel_);
    near_.emplace(tissue, compact, needle_radius_, options.target);
  }

  const std::size_t rings = max_sources();
  cells_.emplace(tissue, *near_, smooth_ ? &*smooth_ : nullptr, needle_radius_, options.target, rings,
                 options.budget);
  factorized_.cores.reserve(n);
  factorized_.rings.reserve(n);
  shown_.rings.reserve(n);
  shown_.ring_forces.reserve(rings);
  shown_.pieces.reserve(rings);
  kept_.is_asked = options.keeps_matrix;
  if (kept_.is_asked) kept_.matrix.resize(static_cast<Eigen::Index>(3 * n), static_cast<Eigen::Index>(3 * n));
  std::iota(all_blocks_.begin(), all_blocks_.end(), 0u);
  for (auto& sources : sources_) sources.reserve(n * NeedleRings::kMaxRingsBetween * NeedleRings::kPoints);
}

std::size_t MatrixKernelField::bytes() const {
  return kernel_->bytes() + near_->bytes() + (smooth_ ? smooth_->bytes() : 0) +
         displacements_.size() * sizeof(displacements_[0]);
}

FactorStatus MatrixKernelField::do_factorize(const LandmarkSet& landmarks, double& condition) noexcept {
  const std::vector<Vec3>& positions = landmarks.positions;
  const std::vector<LandmarkSpread>& spreads = landmarks.spreads;
  const LandmarkCompliance& compliance = landmarks.compliance;
  // Of many landmarks K is mostly that of the last tick, and stays factored; needles that bend are added to it.
  bool adds_beams = factorized_.factor.takes(positions.size(), 1);
  if (adds_beams) {
    factorized_.beam_columns.find(compliance);
    const std::size_t columns = factorized_.beam_columns.count();
    adds_beams = columns > 0 && factorized_.factor.takes(positions.size(), columns);
  }
  const double scale = force_scale();
  if (remembers(landmarks.revision())) {
    // Where K was kept beside its factor, the needles are in that factor.
    if (adds_beams && !kept_.has_matrix && factorized_.factor.keeps(factorized_.count) &&
        landmarks.revision().held == kept_.landmarks.held) {
      factorized_.factor.begin_again();
      add_beams(scale);
      return factor(condition);
    }
    if (!adds_beams && kept_.has_matrix) {
      auto K = factorized_.factor.begin(factorized_.count);
      K.triangularView<Eigen::Lower>() = kept_.matrix.topLeftCorner(K.rows(), K.cols());
      compliance.add_to(K, scale);
      return factor(condition);
    }
  }
  const double duplicate = FactorStatus::kDuplicateDistance * needle_radius_;
  if (const FactorStatus status = check_landmarks(positions, duplicate); !status) return status;
  factorized_.count = positions.size();
  factorized_.cores.assign(factorized_.count,
                           smooth_ ? 0.0 : 1.0);  // one of its own makes a landmark a point
  if (smooth_)
    for (std::size_t l = 0; l < factorized_.count; ++l)
      factorized_.cores[l] =
          spreads[l].core_mm > 0 ? spreads[l].core_mm : core_in_free_space(spreads[l].stiffness_n_per_mm);
  factorized_.rings.build(positions, factorized_.cores, needle_radius_, spreads);
  if (smooth_) {
    smooth_->columns().place(factorized_.count, factorized_.rings);
    find_cores(spreads);
  }
  if (kept_.is_asked) kept_.landmarks = landmarks.revision();
  FactorStatus status = assemble_and_factor(compliance, adds_beams, condition);
  while (!status && narrow_cores()) status = assemble_and_factor(compliance, adds_beams, condition);
  return status;
}

FactorStatus MatrixKernelField::assemble_and_factor(const LandmarkCompliance& compliance, bool adds_beams,
                                                    double& condition) noexcept {
  auto K = factorized_.factor.begin(factorized_.count);
  assemble(K);
  kept_.has_matrix = kept_.is_asked && !adds_beams;
  if (kept_.has_matrix) kept_.matrix.topLeftCorner(K.rows(), K.cols()).triangularView<Eigen::Lower>() = K;
  const double scale = force_scale();
  if (adds_beams) {
    compliance.add_without_beams_to(K, scale);
    add_beams(scale);
  } else {
    compliance.add_to(K, scale);
  }
  return factor(condition);
}

void MatrixKernelField::add_beams(double scale) noexcept {
  LowRankTerm& U = factorized_.factor.add_columns(factorized_.beam_columns.count(),
                                                  scale * factorized_.beam_columns.norm());
  factorized_.beam_columns.each(scale, [&](std::size_t landmark, std::size_t column, const Vec3& value) {
    U.add(landmark, column, value);
  });
}

// Whether the tissue's K as it was last assembled is of these landmarks: only needles or the body give otherwise.
bool MatrixKernelField::remembers(const LandmarkSet::Revision& revision) const noexcept {
  return factorized_.count > 0 && revision.positions == kept_.landmarks.positions &&
         revision.spreads == kept_.landmarks.spreads;
}

// Of a lone landmark in an unbounded solid of the tissue's modulus; no narrower than a rigid disc of the needle's.
double MatrixKernelField::core_in_free_space(double stiffness_n_per_mm) const noexcept {
  if (!(stiffness_n_per_mm > 0)) return 0;
  return std::max(stiffness_n_per_mm * near_->compliance_times_core(),
                  NeedleRings::kDiscCore * needle_radius_);
}

// A landmark's compliance is that of its core, which is in proportion to 1/c, and what boundary and regions add at it,
// S: c from 1/k = w A/c + aᵀ S a, A of core_in_free_space. A core so wide that S could take more than it gives would
// leave K indefinite: a landmark stiffer than that is as stiff as one of the widest core. So is one whose core is given
// but too wide for where it lies: in a nodule that is smaller than the core, S takes what soft tissue would give.
void MatrixKernelField::find_cores(std::span<const LandmarkSpread> spreads) noexcept {
  constexpr double kDefinite = 1.25;  // times a bound of S's eigenvalues, at least
  const auto rings = factorized_.rings.rings();
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const std::size_t l = rings[r].landmark[0];
    if (rings[r].count > 1) continue;
    if (rings[r].along[0] == 0) {  // its core across, no wider than the one along
      limit_core(r, factorized_.cores[l]);
      continue;
    }
    if (spreads[l].core_mm > 0) {
      const Mat3 S = smooth_->columns().self_compliance(l);
      Eigen::SelfAdjointEigenSolver<Mat3> eigen;
      eigen.computeDirect(0.5 * (S + S.transpose()), Eigen::EigenvaluesOnly);
      const double taken = -kDefinite * eigen.eigenvalues().minCoeff();
      if (!(taken > 0)) continue;
      const double widest = core_in_free_space(smooth_->near_factor(r, 0, r, 0) / taken);
      if (widest >= factorized_.cores[l]) continue;
      factorized_.cores[l] = widest;
      factorized_.rings.set_core(r, widest);
      continue;
    }
    if (!(spreads[l].stiffness_n_per_mm > 0)) continue;
    const Mat3 S = smooth_->columns().self_compliance(l);
    const Vec3& a = spreads[l].axis;
    const double most = S.cwiseAbs().rowwise().sum().maxCoeff();
    const double own = std::max(1 / spreads[l].stiffness_n_per_mm - a.dot(S * a), kDefinite * most);
    factorized_.cores[l] = core_in_free_space(smooth_->near_factor(r, 0, r, 0) / own);
    factorized_.rings.set_core(r, factorized_.cores[l]);
  }
}

void MatrixKernelField::limit_core(std::size_t r, double widest) noexcept {
  if (factorized_.rings.rings()[r].core.s > widest * widest) factorized_.rings.set_core(r, widest);
}

// K of these landmarks is not definite: cores of their own become narrower, down to a disc's, and K more diagonal.
// False where none can.
bool MatrixKernelField::narrow_cores() noexcept {
  constexpr double kNarrower = 0.6;
  const double least = NeedleRings::kDiscCore * needle_radius_;
  bool any = false;
  const auto rings = factorized_.rings.rings();
  for (std::size_t r = 0; smooth_ && r < rings.size(); ++r) {
    const std::size_t l = rings[r].landmark[0];
    if (rings[r].count > 1) continue;
    any |= rings[r].along[0] > 0 && factorized_.cores[l] > least;
    if (rings[r].along[0] > 0) factorized_.cores[l] = std::max(least, kNarrower * factorized_.cores[l]);
    limit_core(r, factorized_.cores[l]);
  }
  return any;
}

Evaluation MatrixKernelField::do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept {
  if (is_new_set) shown_.rings = factorized_.rings;
  do_solve(displacements(), weights);
  spread_forces(weights);
  if (evaluates_points_) evaluate_blocks();
  return Evaluation::kDirect;
}

void MatrixKernelField::do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                                           Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  factorized_.factor.project(first, axes, H);
}

void MatrixKernelField::do_rigid_stiffness(std::span<const std::uint32_t> group_of,
                                           std::span<const Vec3> motions,
                                           std::span<double> stiffness) noexcept {
  factorized_.factor.rigid_stiffness(group_of, motions, stiffness);
}

// K in the lower triangle.
void MatrixKernelField::assemble(Eigen::Ref<Eigen::MatrixXd> K) noexcept {
  if (smooth_)
    smooth_->columns().begin_matrix(K);
  else
    K.setZero();
  factorized_.near_matrix.add_to(K, factorized_.count, factorized_.rings, *near_,
                                 smooth_ ? &*smooth_ : nullptr);
  if (smooth_) smooth_->columns().finish_matrix(K);
}

FactorStatus MatrixKernelField::factor(double& condition) noexcept {
  if (!factorized_.factor.factor()) return {FactorStatus::kNotPositiveDefinite};
  condition = factorized_.factor.condition();
  return FactorStatus::of_condition(condition);
}

void MatrixKernelField::do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept {
  std::ranges::copy(displacements, weights.begin());
  factorized_.factor.solve(weights.first(factorized_.count));
}

// The landmarks' forces over the rings and the table's nodes.
void MatrixKernelField::spread_forces(std::span<const Vec3> forces) noexcept {
  shown_.ring_forces.clear();
  for (std::size_t r = 0; r < factorized_.rings.rings().size(); ++r) {
    const NeedleRings::Ring& ring = factorized_.rings.rings()[r];
    Vec3 force = Vec3::Zero();
    for (std::size_t side = 0; side < 2; ++side) {
      const double w = smooth_ ? smooth_->near_factor(r, side) : 1;
      force += w * ring.share(side, forces[ring.landmark[side]]);
    }
    shown_.ring_forces.push_back(force);
  }
  if (smooth_) smooth_->set_forces(forces);
}

void MatrixKernelField::evaluate_blocks() noexcept {
  NearField::take_pieces(shown_.rings, shown_.ring_forces, shown_.pieces);
  touched_ = shown_.ring_forces.empty() ? std::span<const std::uint32_t>() : all_blocks_;
  share_out(touched_.size(), sources_.size(),
            [&](std::size_t k, std::size_t thread) { evaluate_block(touched_[k], sources_[thread]); });
}

void MatrixKernelField::evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept {
  BlockDisplacement<float>& u = displacements_[b];
  if (smooth_)
    smooth_->interpolate(b, near_->blocks().points[b], u);
  else
    u = {};
  near_->add_to_block(b, shown_.rings, shown_.ring_forces, shown_.pieces, sources, u);
}

void MatrixKernelField::do_rescale(double scale) noexcept {
  for (Vec3& f : shown_.ring_forces) f *= scale;
  if (smooth_) smooth_->rescale(scale);
  if (evaluates_points_) evaluate_blocks();
}

const CellField& MatrixKernelField::cells() noexcept {
  cells_->set_field(shown_.rings, shown_.ring_forces, shown_.pieces);
  return *cells_;
}

Vec3 MatrixKernelField::displacement_at(const Vec3& X) const noexcept {
  Vec3 u = near_->displacement_at(X, shown_.rings, shown_.ring_forces);
  if (smooth_) smooth_->add_displacement_at(X, u);
  return u;
}

void MatrixKernelField::displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept {
  NearField::take_pieces(shown_.rings, shown_.ring_forces, shown_.pieces);
  for (std::size_t first = 0; first < X.size(); first += Tissue::kBlockSize) {
    const std::size_t count = std::min(Tissue::kBlockSize, X.size() - first);
    const CentredPoints points(X.subspan(first, count));
    BlockDisplacement<float> near{};
    near_->add_to_points(points.local, points.centre, points.box, shown_.rings, shown_.ring_forces,
                         shown_.pieces, sources_[0], near);
    for (std::size_t i = 0; i < count; ++i) {
      Vec3& v = u[first + i] = displacement_in(near, i);
      if (smooth_) smooth_->add_displacement_at(X[first + i], v);
    }
  }
}

}  // namespace brachy
