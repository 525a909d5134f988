#include "core/ladder/ladder_deformation.h"

#include <algorithm>
#include <cassert>
#include <numeric>

#include <Eigen/Cholesky>

#include "core/compact/compact_kernel.h"
#include "core/elastic/elastic_kernel.h"
#include "core/error.h"
#include "core/ladder/ladder.h"
#include "core/ladder/ladder_system.h"
#include "core/ladder/matrix_condition.h"

namespace brachy {
namespace {

constexpr double kOutside = 1e-6;  // mm

}  // namespace

void require_in_box(const Tissue& tissue, const ElasticBody& body) {
  for (const Block& block : tissue.blocks)
    for (const Vec3& corner : {block.min, block.max})
      if (((corner - body.box_centre).cwiseAbs() - 0.5 * body.box_size).maxCoeff() > kOutside)
        throw UserError(
            "the tissue reaches out of [box], which says what holds it; raise box.size_mm or move "
            "box.centre_mm");
}

LadderDeformation::LadderDeformation(const Tissue& tissue, std::string_view rung, const ElasticBody& body,
                                     const Options& options)
    : options_(options),
      needle_radius_(body.needle_radius),
      inverse_block_(3 * options.max_landmarks, options.max_landmarks, options.target),
      all_blocks_(tissue.blocks.size()),
      displacements_(tissue.blocks.size()),
      sources_(static_cast<std::size_t>(std::max(1, options.threads))) {
  require_in_box(tissue, body);
  const std::size_t n = options.max_landmarks;
  kernel_ = make_matrix_kernel(rung, body);
  if (const auto* elastic = dynamic_cast<const ElasticKernel*>(kernel_.get())) {
    smooth_.emplace(tissue, *elastic, options.target, n);
    near_.emplace(tissue, *elastic, smooth_->near_weight(), options.target);
  } else {
    const auto& compact = dynamic_cast<const CompactKernel&>(*kernel_);
    near_.emplace(tissue, compact, needle_radius_, options.target);
    if (options.landmark_stiffness_n_per_mm > 0)
      force_scale_ = options.landmark_stiffness_n_per_mm * compact.value(Vec3::Zero())(0, 0);
  }

  const std::size_t rings = max_sources();
  cells_.emplace(tissue, *near_, smooth_ ? &*smooth_ : nullptr, needle_radius_, options.target, rings);
  for (auto* v : {&positions_, &displacements_wanted_, &forces_}) v->reserve(n);
  cores_.reserve(n);
  rings_.reserve(n);
  field_rings_.reserve(n);
  ring_forces_.reserve(rings);
  matrix_.resize(static_cast<Eigen::Index>(3 * n), static_cast<Eigen::Index>(3 * n));
  solution_.resize(static_cast<Eigen::Index>(3 * n));
  scratch_.resize(static_cast<Eigen::Index>(3 * n), 3);
  std::iota(all_blocks_.begin(), all_blocks_.end(), 0u);
  for (auto& sources : sources_) sources.reserve(n * NeedleRings::kMaxRingsBetween * NeedleRings::kPoints);
}

std::size_t LadderDeformation::bytes() const {
  return kernel_->bytes() + near_->bytes() + (smooth_ ? smooth_->bytes() : 0) +
         displacements_.size() * sizeof(displacements_[0]);
}

// Whether the kernel looks at cores: the compact ones see points.
bool LadderDeformation::is_placed(std::span<const Vec3> positions,
                                  std::span<const double> cores) const noexcept {
  if (!is_factored_ || !std::ranges::equal(positions, positions_)) return false;
  if (!smooth_) return true;
  for (std::size_t l = 0; l < positions.size(); ++l)
    if ((l < cores.size() ? cores[l] : 0) != cores_[l]) return false;
  return true;
}

FactorStatus LadderDeformation::place(std::span<const Vec3> positions,
                                      std::span<const double> cores) noexcept {
  if (is_placed(positions, cores)) return {};
  is_factored_ = is_field_of_placed_ = false;
  const double duplicate = FactorStatus::kDuplicateDistance * needle_radius_;
  if (const FactorStatus status = check_landmarks(positions, duplicate); !status) return status;
  positions_.assign(positions.begin(), positions.end());
  cores_.assign(positions.size(), smooth_ ? 0.0 : 1.0);  // one of its own makes a landmark a point
  if (smooth_) std::ranges::copy(cores.first(std::min(cores.size(), positions.size())), cores_.begin());
  rings_.build(positions_, cores_, needle_radius_);
  if (smooth_) smooth_->columns().place(positions_.size(), rings_);
  assemble();
  const FactorStatus status = factor();
  is_factored_ = static_cast<bool>(status);
  return status;
}

FactorStatus LadderDeformation::update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                                       std::span<const double> cores) noexcept {
  if (const FactorStatus status = place(positions, cores); !status) return status;
  if (is_field_of_placed_ && std::ranges::equal(displacements, displacements_wanted_)) {
    evaluation_ = Evaluation::kIdle;
    return {};
  }
  if (!is_field_of_placed_) field_rings_ = rings_;
  is_field_of_placed_ = true;
  displacements_wanted_.assign(displacements.begin(), displacements.end());
  forces_.resize(positions.size());
  solve(displacements_wanted_, forces_);
  spread_forces();
  evaluate();
  evaluation_ = Evaluation::kDirect;
  return {};
}

void LadderDeformation::reactions(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept {
  solve(displacements, forces);
  for (Vec3& f : forces) f *= force_scale_;
}

void LadderDeformation::axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                                        Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(is_factored_ && first + axes.size() <= positions_.size());
  const auto n = static_cast<Eigen::Index>(3 * positions_.size());
  inverse_block_.project(matrix_.topLeftCorner(n, n), first, axes, H);
  H *= force_scale_;
}

// K in the lower triangle.
void LadderDeformation::assemble() noexcept {
  const auto n = static_cast<Eigen::Index>(3 * positions_.size());
  auto K = matrix_.topLeftCorner(n, n);
  if (smooth_)
    smooth_->columns().begin_matrix(K);
  else
    K.setZero();
  const auto add = [&](std::uint32_t i, std::uint32_t j, double weight, const Mat3& value) {
    if (i >= j)
      K.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j)) += weight * value;
  };
  const auto rings = rings_.rings();
  for (std::size_t i = 0; i < rings.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const NeedleRings::Ring &a = rings[i], &b = rings[j];
      const Mat3 value = near_->between(rings_, a, b);
      for (std::size_t s = 0; s < 2; ++s)
        for (std::size_t t = 0; t < 2; ++t) {
          double weight = a.weight[s] * b.weight[t];
          if (weight == 0) continue;
          if (smooth_) weight *= smooth_->near_factor(i, s, j, t);
          add(a.landmark[s], b.landmark[t], weight, value);
          if (i != j) add(b.landmark[t], a.landmark[s], weight, value.transpose());
        }
    }
  if (smooth_) smooth_->columns().finish_matrix(K);
}

FactorStatus LadderDeformation::factor() noexcept {
  const auto n = static_cast<Eigen::Index>(3 * positions_.size());
  if (n == 0) {
    condition_ = 1;
    return {};
  }
  Eigen::Ref<Eigen::MatrixXd> K = matrix_.topLeftCorner(n, n);
  const double norm = symmetric_norm(K, scratch_.col(0).head(n));
  if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(K).info() != Eigen::Success)
    return {FactorStatus::kNotPositiveDefinite};
  const double condition = norm * inverse_norm(K, scratch_.topRows(n));
  const FactorStatus status = FactorStatus::of_condition(condition);
  if (status) condition_ = condition;
  return status;
}

void LadderDeformation::solve(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept {
  const std::size_t count = positions_.size();
  assert(is_factored_ && displacements.size() == count && forces.size() == count);
  const auto n = static_cast<Eigen::Index>(3 * count);
  auto x = solution_.head(n);
  for (std::size_t l = 0; l < count; ++l) x.segment<3>(static_cast<Eigen::Index>(3 * l)) = displacements[l];
  const auto L = matrix_.topLeftCorner(n, n).triangularView<Eigen::Lower>();
  if (n > 0) {
    L.solveInPlace(x);
    L.transpose().solveInPlace(x);
  }
  for (std::size_t l = 0; l < count; ++l) forces[l] = x.segment<3>(static_cast<Eigen::Index>(3 * l));
}

// The landmarks' forces over the rings and the table's nodes.
void LadderDeformation::spread_forces() noexcept {
  ring_forces_.clear();
  for (std::size_t r = 0; r < rings_.rings().size(); ++r) {
    const NeedleRings::Ring& ring = rings_.rings()[r];
    Vec3 force = Vec3::Zero();
    for (std::size_t side = 0; side < 2; ++side) {
      const double w = smooth_ ? smooth_->near_factor(r, side) : 1;
      force += w * ring.weight[side] * forces_[ring.landmark[side]];
    }
    ring_forces_.push_back(force);
  }
  if (smooth_) smooth_->set_forces(forces_);
}

void LadderDeformation::evaluate() noexcept {
  touched_ = ring_forces_.empty() ? std::span<const std::uint32_t>() : all_blocks_;
  const auto blocks = static_cast<std::ptrdiff_t>(touched_.size());
  // One thread does not enter OpenMP at all: libgomp allocates at every parallel region.
  if (options_.threads <= 1) {
    for (std::ptrdiff_t b = 0; b < blocks; ++b) evaluate_block(static_cast<std::uint32_t>(b), sources_[0]);
    return;
  }
  const auto threads = static_cast<std::ptrdiff_t>(sources_.size());
#pragma omp parallel for schedule(static, 1) num_threads(static_cast <int>(threads))
  for (std::ptrdiff_t t = 0; t < threads; ++t)
    for (std::ptrdiff_t b = t; b < blocks; b += threads)
      evaluate_block(static_cast<std::uint32_t>(b), sources_[static_cast<std::size_t>(t)]);
}

void LadderDeformation::evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept {
  BlockDisplacement<float>& u = displacements_[b];
  if (smooth_)
    smooth_->interpolate(b, u);
  else
    u = {};
  near_->add_to_block(b, field_rings_, ring_forces_, sources, u);
}

void LadderDeformation::rescale(double scale) noexcept {
  for (auto* vectors : {&forces_, &displacements_wanted_, &ring_forces_})
    for (Vec3& v : *vectors) v *= scale;
  if (smooth_) smooth_->rescale(scale);
  evaluate();
}

double LadderDeformation::total_force_n() const {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& f : forces_) sum += f;
  return force_scale_ * sum.norm();
}

const CellField& LadderDeformation::cells() noexcept {
  cells_->set_field(field_rings_, ring_forces_);
  return *cells_;
}

Vec3 LadderDeformation::displacement_at(const Vec3& X) const noexcept {
  Vec3 u = near_->displacement_at(X, field_rings_, ring_forces_);
  if (smooth_) smooth_->add_displacement_at(X, u);
  return u;
}

}  // namespace brachy
