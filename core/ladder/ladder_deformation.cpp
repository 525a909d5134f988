#include "core/ladder/ladder_deformation.h"

#include <algorithm>
#include <Eigen/Cholesky>
#include <limits>
#include <numbers>

#include "core/elastic/kelvin.h"
#include "core/error.h"
#include "core/ladder/ladder.h"

namespace brachy {
namespace {

constexpr double kOutside = 1e-6;  // mm

void require_inside(const Tissue& tissue, const ElasticBody& body) {
  for (const Block& block : tissue.blocks)
    for (const Vec3& corner : {block.min, block.max})
      if (((corner - body.box_centre).cwiseAbs() - 0.5 * body.box_size).maxCoeff() > kOutside)
        throw UserError(
            "the tissue reaches out of [box], which says what holds it; raise box.size_mm or move "
            "box.centre_mm");
}

double squared_distance(const Vec3& p, const Block& box) {
  return (box.min - p).cwiseMax(p - box.max).cwiseMax(0.0).squaredNorm();
}

}  // namespace

LadderDeformation::LadderDeformation(const Tissue& tissue, std::string_view rung, const ElasticBody& body,
                                     const Options& options)
    : tissue_(tissue),
      options_(options),
      needle_radius_(body.needle_radius),
      loops_(near_loops(options.target)),
      displacements_(tissue.blocks.size()),
      sources_(static_cast<std::size_t>(std::max(1, options.threads))) {
  require_inside(tissue, body);
  kernel_ = make_matrix_kernel(rung, body);
  elastic_ = dynamic_cast<const ElasticKernel*>(kernel_.get());
  compact_ = dynamic_cast<const CompactKernel*>(kernel_.get());
  const std::size_t n = options.max_landmarks;
  if (elastic_) {
    table_.emplace(tissue, *elastic_, body.regions.empty() ? kSmoothSpacing : kTableSpacing, options.target);
    near_scale_ = table_->near_weight() / body.shear_modulus;
    node_weight_.assign(table_->nodes(), 0);
    is_node_taken_.assign(table_->nodes(), 0);
    node_field_.assign(table_->field_size(), 0);
  } else {
    near_scale_ = compact_->compliance();
    point_cores_.assign(n, 1);
    for (const CompactTerm& term : compact_->terms()) {
      shape_.inverse_radius[shape_.count] = static_cast<float>(1 / term.support);
      shape_.w[shape_.count] = static_cast<float>(term.w);
      shape_.v[shape_.count++] = static_cast<float>(term.v);
    }
  }

  for (auto* v : {&positions_, &displacements_wanted_, &forces_}) v->reserve(n);
  rings_.reserve(n);
  ring_forces_.reserve(n * NeedleRings::kMaxRingsBetween);
  moduli_.reserve(n * NeedleRings::kMaxRingsBetween);
  const auto rows = static_cast<Eigen::Index>(3 * n);
  matrix_.resize(rows, rows);
  table_matrix_.resize(rows, rows);
  exact_matrix_.resize(rows, rows);
  is_outside_.reserve(n);
  solution_.resize(rows);
  columns_.resize(n);
  for (Column& column : columns_) {
    column.at = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    if (!table_) continue;
    column.nodes.reserve(table_->nodes());
    column.weights.reserve(table_->nodes());
    column.fields.assign(3 * table_->field_size(), 0);
    if (!body.regions.empty()) column.held_fields.assign(column.fields.size(), 0);
  }

  for (auto& sources : sources_) sources.reserve(n * NeedleRings::kMaxRingsBetween * NeedleRings::kPoints);
  grid_points_.resize(tissue.blocks.size() * Tissue::kBlockSize);
  for (std::size_t b = 0; b < tissue.blocks.size(); ++b) {
    const Block& block = tissue.blocks[b];
    all_blocks_.push_back(static_cast<std::uint32_t>(b));
    block_centres_.push_back(0.5 * (block.min + block.max));
    BlockPoints<float>& points = block_points_.emplace_back();
    for (std::size_t i = 0; i < Tissue::kBlockSize; ++i) {
      const Vec3& X = tissue.rest_vertices[block.first + (i < block.count ? i : 0)];
      const Vec3 local = X - block_centres_.back();
      points.x[i] = static_cast<float>(local.x());
      points.y[i] = static_cast<float>(local.y());
      points.z[i] = static_cast<float>(local.z());
      if (table_) grid_points_[b * Tissue::kBlockSize + i] = table_->locate(X);
    }
  }
}

std::size_t LadderDeformation::bytes() const {
  std::size_t bytes = kernel_->bytes() + (table_ ? table_->bytes() : 0);
  for (const Column& column : columns_)
    bytes += (column.fields.size() + column.held_fields.size()) * sizeof(float);
  return bytes + displacements_.size() * (sizeof(displacements_[0]) + sizeof(block_points_[0])) +
         grid_points_.size() * sizeof(GridPoint);
}

FactorStatus LadderDeformation::update(std::span<const Vec3> positions,
                                       std::span<const Vec3> displacements) noexcept {
  const bool same_positions = is_factored_ && std::ranges::equal(positions, positions_);
  if (same_positions && std::ranges::equal(displacements, displacements_wanted_)) {
    evaluation_ = Evaluation::kIdle;
    return {};
  }
  if (!same_positions) {
    is_factored_ = false;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      if (!positions[i].allFinite()) return {FactorStatus::kNotFinite, static_cast<int>(i)};
      for (std::size_t j = 0; j < i; ++j)
        if (positions[i] == positions[j])
          return {FactorStatus::kDuplicate, static_cast<int>(j), static_cast<int>(i)};
    }
    rings_.build(positions, point_cores_, needle_radius_);
    positions_.assign(positions.begin(), positions.end());
    take_moduli();
    if (table_) refresh_columns(positions);
    assemble();
    ring_forces_.clear();
    if (!factor()) return {FactorStatus::kNotPositiveDefinite};
    is_factored_ = true;
  }
  displacements_wanted_.assign(displacements.begin(), displacements.end());
  solve();
  evaluate();
  evaluation_ = Evaluation::kDirect;
  return {};
}

void LadderDeformation::refresh_columns(std::span<const Vec3> positions) noexcept {
  for (std::size_t l = 0; l < positions.size(); ++l) {
    Column& column = columns_[l];
    const Vec3& at = positions[l];
    const Vec3& before = l > 0 ? positions[l - 1] : at;
    const Vec3& after = l + 1 < positions.size() ? positions[l + 1] : at;
    column.is_fresh = column.at != at || column.before != before || column.after != after;
    if (!column.is_fresh) continue;
    column.before = before;
    column.at = at;
    column.after = after;
    column.is_exact = is_outside_[l] != 0;
    if (column.is_exact)
      gather_exactly(column, static_cast<std::uint32_t>(l));
    else
      gather(column, static_cast<std::uint32_t>(l));
  }
  const auto used = std::span(columns_).first(positions.size());
  if (std::ranges::any_of(used, [](const Column& c) { return c.is_exact && c.is_fresh; }))
    prepare_exact_pairs();
}

// A landmark some of whose rings lie outside the table is asked of the kernel itself. Inside, tissue is all of one
// modulus, but for contacts, which may lie on a region's surface.
void LadderDeformation::take_moduli() noexcept {
  const auto rings = rings_.rings();
  moduli_.assign(rings.size(), {1, 1});
  is_outside_.assign(positions_.size(), 0);
  if (!elastic_) return;
  for (const NeedleRings::Ring& ring : rings) {
    if (table_->covers(ring.centre)) continue;
    for (std::size_t side = 0; side < 2; ++side)
      if (ring.weight[side] > 0) is_outside_[ring.landmark[side]] = 1;
  }
  const bool has_regions = !elastic_->body().regions.empty();
  for (std::size_t r = 0; r < rings.size(); ++r)
    for (std::size_t side = 0; side < 2; ++side)
      moduli_[r][side] = has_regions && (rings[r].count == 1 || is_outside_[rings[r].landmark[side]])
                             ? elastic_->body().relative_modulus(rings[r].centre)
                             : table_->modulus();
}

// A force at X on the nodes around it.
void LadderDeformation::spread(const Vec3& X, double share, Column& column) noexcept {
  const GridPoint p = table_->locate(X);
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 4; ++x) {
        const float weight = static_cast<float>(share) * p.wx[x] * p.wy[y] * p.wz[z];
        if (weight == 0) continue;
        const std::uint32_t node = table_->node(p, x, y, z);
        if (!is_node_taken_[node]) column.nodes.push_back(node);
        is_node_taken_[node] = 1;
        node_weight_[node] += weight;
      }
}

// The nodes' field of unit forces on one landmark: its rings' centres spread to nodes by their weights, then the table's
// columns of those nodes.
void LadderDeformation::gather(Column& column, std::uint32_t landmark) noexcept {
  column.nodes.clear();
  column.weights.clear();
  column.modulus = table_->modulus();
  const auto rings = rings_.rings();
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const NeedleRings::Ring& ring = rings[r];
    const double share = (ring.landmark[0] == landmark ? ring.weight[0] : 0) +
                         (ring.landmark[1] == landmark && ring.weight[1] > 0 ? ring.weight[1] : 0);
    if (share == 0) continue;
    if (ring.count == 1) column.modulus = moduli_[r][0];
    if (ring.count > 1) {
      spread(ring.centre, share, column);
      continue;
    }
    // A contact's core is as wide as a cell: six points at the mean distance (rms) of its force, 15 s² / 8π(r² + s)^7/2.
    for (Eigen::Index k = 0; k < 6; ++k)
      spread(ring.centre + std::sqrt(1.5 * ring.s) * (k % 2 ? 1 : -1) * Vec3::Unit(k / 2), share / 6, column);
  }
  for (const std::uint32_t node : column.nodes) {
    column.weights.push_back(node_weight_[node]);
    node_weight_[node] = 0;
    is_node_taken_[node] = 0;
  }
  std::ranges::fill(column.fields, 0.0f);
  add_nodes(column, false, 1, column.fields);
  if (column.modulus == table_->modulus()) return;
  std::ranges::fill(column.held_fields, 0.0f);
  add_nodes(column, true, 1, column.held_fields);
  const double excess = 2 / (column.modulus + table_->modulus()) - table_->near_weight();
  loops_.axpy(static_cast<float>(-excess), column.held_fields.data(), column.fields.data(),
              column.fields.size());
}

void LadderDeformation::add_nodes(const Column& column, bool held, double factor,
                                  std::vector<float>& fields) const noexcept {
  for (std::size_t i = 0; i < column.nodes.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float* field = &fields[axis * table_->field_size()];
      const auto weight = static_cast<float>(factor) * column.weights[i];
      if (held)
        table_->add_held_column(column.nodes[i], axis, weight, field);
      else
        table_->add_column(column.nodes[i], axis, weight, field);
    }
}

void LadderDeformation::gather_exactly(Column& column, std::uint32_t landmark) {
  column.nodes.clear();
  column.weights.clear();
  column.modulus = table_->modulus();  // the kernel has seen to it
  PointGroups group;
  group.begin_group();
  rings_.add_to(group, landmark);
  group.finish();
  std::vector<Vec3> nodes;
  for (std::uint32_t node = 0; node < table_->nodes(); ++node) nodes.push_back(table_->position(node));
  const Eigen::MatrixXd u =
      elastic_->smooth_fields(nodes, table_->modulus(), group, Eigen::MatrixXd::Identity(3, 3));
  const std::size_t size = table_->field_size();
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (Eigen::Index i = 0; i < u.rows(); ++i)
      column.fields[axis * size + static_cast<std::size_t>(i)] =
          static_cast<float>(u(i, static_cast<Eigen::Index>(axis)));
}

// K between landmarks that both lie outside the table.
void LadderDeformation::prepare_exact_pairs() {
  PointGroups groups;
  std::vector<Eigen::Index> rows;
  for (std::uint32_t l = 0; l < positions_.size(); ++l) {
    if (!columns_[l].is_exact) continue;
    groups.begin_group();
    rings_.add_to(groups, l);
    rows.push_back(3 * static_cast<Eigen::Index>(l));
  }
  groups.finish();
  const Eigen::MatrixXd C = kernel_->between(groups, groups);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      exact_matrix_.block<3, 3>(rows[i], rows[j]) =
          C.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
}

Mat3 LadderDeformation::near_value(const Vec3& x, double s) const noexcept {
  return elastic_ ? Mat3(near_scale_ * kelvin(x, s, elastic_->body().poisson)) : compact_->value(x);
}

Mat3 LadderDeformation::near(const NeedleRings::Ring& a, const NeedleRings::Ring& b) const noexcept {
  const double far = kFarRadii * needle_radius_;
  if ((a.count == 1 && b.count == 1) || (a.centre - b.centre).squaredNorm() > far * far)
    return near_value(a.centre - b.centre, a.s + b.s);
  Mat3 sum = Mat3::Zero();
  for (const Vec3& p : rings_.points(a))
    for (const Vec3& q : rings_.points(b)) sum += near_value(p - q, a.s + b.s);
  return sum / static_cast<double>(a.count * b.count);
}

Mat3 LadderDeformation::observe(const Column& a, const std::vector<float>& fields) const noexcept {
  Mat3 value = Mat3::Zero();
  const std::size_t size = table_->field_size();
  for (std::size_t i = 0; i < a.nodes.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* u = &fields[axis * size + 3 * std::size_t{a.nodes[i]}];
      value.col(static_cast<Eigen::Index>(axis)) += a.weights[i] * Vec3(u[0], u[1], u[2]);
    }
  return value;
}

// b's field as a sees it. It is weighted for tissue of the table's modulus; where a has another, so has the weight of Q.
Mat3 LadderDeformation::table_value(const Column& a, const Column& b) const noexcept {
  const double k = table_->modulus();
  Mat3 value = observe(a, b.fields);
  if (a.modulus == k || b.is_exact) return value;
  const Mat3 held = b.modulus == k ? Mat3(observe(b, a.held_fields).transpose()) : observe(a, b.held_fields);
  return value + (2 / (b.modulus + k) - 2 / (a.modulus + b.modulus)) * held;
}

// K in the lower triangle.
void LadderDeformation::assemble() noexcept {
  const auto n = static_cast<Eigen::Index>(positions_.size());
  auto K = matrix_.topLeftCorner(3 * n, 3 * n);
  if (table_) {
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j <= i; ++j) {
        const Column &a = columns_[static_cast<std::size_t>(i)], &b = columns_[static_cast<std::size_t>(j)];
        if (!a.is_fresh && !b.is_fresh) continue;
        const bool through_b = a.is_exact && !b.is_exact;
        table_matrix_.block<3, 3>(3 * i, 3 * j) =
            through_b ? Mat3(table_value(b, a).transpose()) : table_value(a, b);
      }
    K = table_matrix_.topLeftCorner(3 * n, 3 * n);
  } else {
    K.setZero();
  }
  const auto rings = rings_.rings();
  const auto add = [&](std::uint32_t i, std::uint32_t j, double weight, const Mat3& value) {
    if (i >= j)
      K.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j)) += weight * value;
  };
  for (std::size_t i = 0; i < rings.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const NeedleRings::Ring &a = rings[i], &b = rings[j];
      const Mat3 value = near(a, b);
      for (std::size_t s = 0; s < 2; ++s)
        for (std::size_t t = 0; t < 2; ++t) {
          double weight = a.weight[s] * b.weight[t];
          if (weight == 0) continue;
          if (table_) weight *= 2 / ((moduli_[i][s] + moduli_[j][t]) * table_->near_weight());
          add(a.landmark[s], b.landmark[t], weight, value);
          if (i != j) add(b.landmark[t], a.landmark[s], weight, value.transpose());
        }
    }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      if (columns_[static_cast<std::size_t>(i)].is_exact && columns_[static_cast<std::size_t>(j)].is_exact)
        K.block<3, 3>(3 * i, 3 * j) = exact_matrix_.block<3, 3>(3 * i, 3 * j);
}

bool LadderDeformation::factor() noexcept {
  const auto n = static_cast<Eigen::Index>(3 * positions_.size());
  if (n == 0) return true;
  Eigen::Ref<Eigen::MatrixXd> K = matrix_.topLeftCorner(n, n);
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(K).info() == Eigen::Success;
}

void LadderDeformation::solve() noexcept {
  const std::size_t count = positions_.size();
  const auto n = static_cast<Eigen::Index>(3 * count);
  forces_.resize(count);
  auto x = solution_.head(n);
  for (std::size_t l = 0; l < count; ++l)
    x.segment<3>(static_cast<Eigen::Index>(3 * l)) = displacements_wanted_[l];
  const auto L = matrix_.topLeftCorner(n, n).triangularView<Eigen::Lower>();
  if (n > 0) {
    L.solveInPlace(x);
    L.transpose().solveInPlace(x);
  }
  for (std::size_t l = 0; l < count; ++l) forces_[l] = x.segment<3>(static_cast<Eigen::Index>(3 * l));

  ring_forces_.clear();
  for (std::size_t r = 0; r < rings_.rings().size(); ++r) {
    const NeedleRings::Ring& ring = rings_.rings()[r];
    Vec3 force = Vec3::Zero();
    for (std::size_t side = 0; side < 2; ++side) {
      const double w = table_ ? 2 / ((moduli_[r][side] + table_->modulus()) * table_->near_weight()) : 1;
      force += w * ring.weight[side] * forces_[ring.landmark[side]];
    }
    ring_forces_.push_back(force);
  }
  if (!table_) return;
  std::ranges::fill(node_field_, 0.0f);
  const std::size_t size = table_->field_size();
  for (std::size_t l = 0; l < count; ++l)
    for (std::size_t axis = 0; axis < 3; ++axis)
      loops_.axpy(static_cast<float>(forces_[l][static_cast<Eigen::Index>(axis)]),
                  &columns_[l].fields[axis * size], node_field_.data(), size);
}

void LadderDeformation::evaluate() noexcept {
  touched_ = positions_.empty() ? std::span<const std::uint32_t>() : all_blocks_;
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
  if (table_)
    loops_.interpolate(node_field_.data(), table_->row(), table_->slice(),
                       &grid_points_[b * Tissue::kBlockSize], Tissue::kBlockSize, u);
  else
    u = {};

  const Vec3& centre = block_centres_[b];
  const double far = kFarRadii * needle_radius_;
  const double scale = elastic_ ? near_scale_ / (4 * std::numbers::pi) : near_scale_;
  sources.clear();
  const auto add = [&](const Vec3& at, double s, const Vec3& f) {
    const Eigen::Vector3f p = (at - centre).cast<float>(), g = (scale * f).cast<float>();
    sources.push_back({p.x(), p.y(), p.z(), static_cast<float>(s), g.x(), g.y(), g.z(), 0});
  };
  const auto rings = rings_.rings();
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const NeedleRings::Ring& ring = rings[r];
    if (ring.count == 1 || squared_distance(ring.centre, tissue_.blocks[b]) > far * far) {
      add(ring.centre, ring.s, ring_forces_[r]);
    } else {
      for (const Vec3& p : rings_.points(ring))
        add(p, ring.s, ring_forces_[r] / static_cast<double>(ring.count));
    }
  }
  if (elastic_)
    loops_.kelvin(block_points_[b], sources.data(), sources.size(),
                  static_cast<float>(1 / (4 * (1 - elastic_->body().poisson))), u);
  else
    loops_.compact(block_points_[b], sources.data(), sources.size(), shape_, u);
}

Vec3 LadderDeformation::displacement_at(const Vec3& X) const noexcept {
  Vec3 u = Vec3::Zero();
  const auto rings = rings_.rings();
  for (std::size_t r = 0; r < rings.size() && r < ring_forces_.size(); ++r)
    for (const Vec3& p : rings_.points(rings[r]))
      u += near_value(X - p, rings[r].s) * ring_forces_[r] / static_cast<double>(rings[r].count);
  if (!table_) return u;
  const GridPoint p = table_->locate(X);
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 4; ++x) {
        const float* v = &node_field_[3 * std::size_t{table_->node(p, x, y, z)}];
        u += static_cast<double>(p.wx[x] * p.wy[y] * p.wz[z]) * Vec3(v[0], v[1], v[2]);
      }
  return u;
}

}  // namespace brachy
