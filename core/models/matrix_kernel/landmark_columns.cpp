#include "core/models/matrix_kernel/landmark_columns.h"

#include <algorithm>
#include <cmath>

#include "core/elasticity/kelvin.h"

namespace brachy {

using Eigen::Index;

namespace {

constexpr std::size_t kMostParts = 2 * NeedleRings::kMaxRingsBetween + 1;  // of a landmark

// Points of a core's force, 15 s² / 8π(r² + s)^7/2 with s = c²: of it a quarter lies within 0.57 c, half within 0.84 c,
// three quarters within 1.25 c.
template <class Visit>
void visit_core(const Vec3& centre, double c, const Visit& visit) {
  constexpr double kInMiddle = 0.25;
  visit(centre, kInMiddle);
  for (Index k = 0; k < 6; ++k) visit(centre + (k % 2 ? c : -c) * Vec3::Unit(k / 2), (1 - kInMiddle) / 6);
}

// The same in 27 points, a third each about 0.46, 0.84 and 1.5 c away.
template <class Visit>
void visit_core_finely(const Vec3& centre, double c, const Visit& visit) {
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const int away = x * x + y * y + z * z;
        if (away == 0) continue;
        const double radius = away == 1   ? 0.46
                              : away == 2 ? 0.84
                                          : 1.5,
                     of_all = away == 1   ? 6
                              : away == 2 ? 12
                                          : 8;
        visit(centre + radius * c / std::sqrt(away) * Vec3(x, y, z), 1 / (3 * of_all));
      }
}

}  // namespace

LandmarkColumns::LandmarkColumns(const ElasticKernel& kernel, const RemainderTable& table, SimdTarget target,
                                 std::size_t max_landmarks)
    : kernel_(kernel),
      table_(table),
      loops_(near_loops(target)),
      slots_(max_landmarks, kMostParts),
      columns_(max_landmarks),
      max_landmarks_(max_landmarks),
      table_blocks_(max_landmarks * max_landmarks, Mat3::Zero()) {
  nodes_.weight.assign(table.nodes(), 0);
  nodes_.is_taken.assign(table.nodes(), 0);
  for (Column& column : columns_) {
    column.nodes.reserve(table.nodes());
    column.weights.reserve(table.nodes());
    column.fields.assign(3 * table.field_size(), 0);
    if (table.keeps_held()) column.held_fields.assign(column.fields.size(), 0);
    if (table.is_mixed()) column.lumps.reserve(kMostParts);
  }
  of_core_.nodes.reserve(table.nodes());
  of_core_.weights.reserve(table.nodes());
  for (std::uint32_t node = 0; table.is_mixed() && node < table.nodes(); ++node)
    node_positions_.push_back(table.position(node));
  for (auto* exact : {&exact_.landmarks, &exact_.last}) exact->reserve(2 * max_landmarks);
  is_outside_.reserve(max_landmarks);
  for (auto* moduli : {&moduli_, &field_moduli_})
    moduli->reserve(max_landmarks * NeedleRings::kMaxRingsBetween);
  const auto rows = static_cast<Index>(3 * max_landmarks);
  exact_.matrix.resize(rows, rows);
}

std::size_t LandmarkColumns::bytes() const {
  std::size_t floats = 0;
  for (const Column& column : columns_) floats += column.fields.size() + column.held_fields.size();
  return floats * sizeof(float);
}

void LandmarkColumns::place(std::size_t landmarks, const NeedleRings& rings) noexcept {
  count_ = landmarks;
  take_moduli(count_, rings.rings());
  take_parts(rings);
  std::swap(exact_.landmarks, exact_.last);
  exact_.landmarks.clear();
  for (std::size_t l = 0; l < count_; ++l) {
    const auto landmark = static_cast<std::uint32_t>(l);
    const std::size_t slot = slots_.slot(l);
    Column& fresh = columns_[slot];
    if (is_outside_[l] != 0)
      for (const std::uint32_t which : {landmark, static_cast<std::uint32_t>(slot)})
        exact_.landmarks.push_back(which);
    if (!slots_.is_fresh(l)) continue;
    if (is_outside_[l] != 0) exact_.last.clear();
    fresh.is_exact = is_outside_[l] != 0;
    if (fresh.is_exact)
      gather_exactly(fresh, landmark, rings);
    else
      gather(fresh, landmark, rings.rings());
  }
  if (exact_.landmarks != exact_.last) prepare_exact_pairs(rings);
}

void LandmarkColumns::take_parts(const NeedleRings& rings) noexcept {
  slots_.begin(count_);
  for (const NeedleRings::Ring& ring : rings.rings())
    for (std::size_t side = 0; side < 2; ++side) {
      const std::uint32_t l = ring.landmark[side];
      if (!(ring.smooth[side] > 0)) continue;
      const bool is_outside = is_outside_[l] != 0;
      slots_.add(l,
                 {ring.centre, is_outside ? rings.points(ring).front() : ring.centre, ring.smooth[side],
                  table_.is_mixed() && ring.core.is_landmark ? ring.core.s : ring.core.smooth_s, is_outside});
    }
  slots_.find();
}

// Tissue is all of one modulus, but for contacts, which may lie on a region's surface; or it is mixed.
void LandmarkColumns::take_moduli(std::size_t landmarks, std::span<const NeedleRings::Ring> rings) noexcept {
  moduli_.resize(rings.size());
  field_moduli_.resize(rings.size());
  is_outside_.assign(landmarks, 0);
  for (const NeedleRings::Ring& ring : rings) {
    if (table_.covers(ring.centre)) continue;
    for (std::size_t side = 0; side < 2; ++side)
      if (ring.carries(side)) is_outside_[ring.landmark[side]] = 1;
  }
  for (std::size_t r = 0; r < rings.size(); ++r)
    for (std::size_t side = 0; side < 2; ++side) {
      const bool is_outside = is_outside_[rings[r].landmark[side]] != 0;
      const bool has_own = is_outside || table_.is_mixed() || (rings[r].count == 1 && table_.keeps_held());
      moduli_[r][side] = has_own ? modulus_in_core(rings[r]) : table_.modulus();
      field_moduli_[r][side] = table_.is_mixed() && !is_outside ? moduli_[r][side] : table_.modulus();
    }
}

// Where the tissue is mixed, of what the core takes up.
double LandmarkColumns::modulus_in_core(const NeedleRings::Ring& ring) const noexcept {
  const ElasticBody& body = kernel_.body();
  if (!table_.is_mixed() || !ring.core.is_landmark) return body.relative_modulus(ring.centre);
  double modulus = 0;
  visit_core_finely(ring.centre, std::sqrt(ring.core.s),
                    [&](const Vec3& X, double share) { modulus += share * body.relative_modulus(X); });
  return modulus;
}

// The landmark's rings' centres spread to nodes by their weights, then the table's columns of those nodes.
void LandmarkColumns::gather(Column& column, std::uint32_t landmark,
                             std::span<const NeedleRings::Ring> rings) noexcept {
  column.nodes.clear();
  column.weights.clear();
  column.lumps.clear();
  of_core_.nodes.clear();
  of_core_.weights.clear();
  column.is_wide = false;
  column.modulus = table_.modulus();
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const NeedleRings::Ring& ring = rings[r];
    const double share = (ring.landmark[0] == landmark ? ring.smooth[0] : 0) +
                         (ring.landmark[1] == landmark && ring.smooth[1] > 0 ? ring.smooth[1] : 0);
    if (share == 0) continue;
    const std::size_t side = ring.landmark[0] == landmark ? 0 : 1;
    if (table_.is_mixed())
      add_to_lump(ring, moduli_[r][side], field_moduli_[r][side], share, column);
    else if (ring.count == 1)
      column.modulus = moduli_[r][0];
    if (table_.is_mixed() && ring.core.is_landmark) {
      column.is_wide = true;
      spread_core(ring, share, column);
      continue;
    }
    if (ring.count > 1 || ring.core.smooth_s == 0) {
      spread(ring.centre, share, column);
      continue;
    }
    // A disc of a needle's radius: six points at the mean distance (rms) of its force, 15 s² / 8π(r² + s)^7/2.
    for (Index k = 0; k < 6; ++k)
      spread(ring.centre + std::sqrt(1.5 * ring.core.smooth_s) * (k % 2 ? 1 : -1) * Vec3::Unit(k / 2),
             share / 6, column);
  }
  finish_nodes(column);
  std::ranges::fill(column.fields, 0.0f);
  add_nodes(column.is_wide ? of_core_ : column, false, column.fields);
  finish_lumps(column);
  if (column.modulus == table_.modulus()) return;
  std::ranges::fill(column.held_fields, 0.0f);
  add_nodes(column, true, column.held_fields);
  const double excess = 2 / (column.modulus + table_.modulus()) - table_.near_weight();
  loops_.axpy(static_cast<float>(-excess), column.held_fields.data(), column.fields.data(),
              column.fields.size());
}

void LandmarkColumns::finish_nodes(Column& column) noexcept {
  for (const std::uint32_t node : column.nodes) {
    column.weights.push_back(nodes_.weight[node]);
    nodes_.weight[node] = 0;
    nodes_.is_taken[node] = 0;
  }
}

// A core of its own makes a landmark a point for all else; but where a nodule is smaller than the core, the table of a
// point in its middle would take what the core does not give, and crossing its surface would be a jump. There the
// force is spread as the core's is, and the place is observed as a point.
void LandmarkColumns::spread_core(const NeedleRings::Ring& ring, double share, Column& column) noexcept {
  visit_core(ring.centre, std::sqrt(ring.core.s),
             [&](const Vec3& X, double part) { spread(X, share * part, of_core_); });
  finish_nodes(of_core_);
  spread(ring.centre, share, column);
}

// Where the tissue is mixed the table has what a place's modulus adds to Kelvin's solution only as smoothly as its
// nodes show it, (w − ŵ) G_s. The near part has the weight of the ring's own modulus, w; so what the table has of it is
// taken out of the column again, by one smooth point for all rings in one modulus, which has their centre and
// their variance v, and that of their nodes: averaged over all directions with v, Kelvin's solution is the one of
// s + 2v.
void LandmarkColumns::add_to_lump(const NeedleRings::Ring& ring, double modulus, double field_modulus,
                                  double share, Column& column) noexcept {
  auto lump = std::ranges::find(column.lumps, modulus, &Lump::modulus);
  if (lump == column.lumps.end()) lump = column.lumps.insert(lump, {modulus, 2 / (modulus + field_modulus)});
  const double all = lump->share + share;
  const Vec3 way = ring.centre - lump->at;
  lump->s =
      (lump->share * lump->s + share * (ring.core.smooth_s + 2 * table_.variance_of_nodes(ring.centre))) /
          all +
      2.0 / 3 * lump->share * share / (all * all) * way.squaredNorm();
  lump->at += share / all * way;
  if (ring.core.is_landmark) lump->core_s = ring.core.s;
  lump->share = all;
}

void LandmarkColumns::finish_lumps(Column& column) noexcept {
  const ElasticBody& body = kernel_.body();
  for (const Lump& lump : column.lumps) {
    const double excess = lump.share * (lump.weight - table_.near_weight()) / body.shear_modulus;
    if (excess == 0) continue;
    const std::size_t size = table_.field_size();
    for (std::size_t n = 0; n < node_positions_.size(); ++n) {
      const Mat3 G =
          kelvin(node_positions_[n] - lump.at, table_.smooth_s() + lump.s + lump.core_s, body.poisson);
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t k = 0; k < 3; ++k)
          column.fields[axis * size + 3 * n + k] -=
              static_cast<float>(excess * G(static_cast<Index>(k), static_cast<Index>(axis)));
    }
  }
}

// K's near part has w of both places, b's field that of b's own.
Mat3 LandmarkColumns::between_lumps(const Column& a, const Column& b) const noexcept {
  Mat3 sum = Mat3::Zero();
  for (const Lump& p : a.lumps)
    for (const Lump& q : b.lumps) {
      const double excess = q.weight - 2 / (p.modulus + q.modulus);
      if (excess == 0) continue;
      sum += p.share * q.share * excess / kernel_.body().shear_modulus *
             kelvin(p.at - q.at, table_.smooth_s() + p.s + q.s + q.core_s, kernel_.body().poisson);
    }
  return sum;
}

// A force at X on the nodes around it.
void LandmarkColumns::spread(const Vec3& X, double share, Column& column) noexcept {
  const GridPoint p = table_.locate(X);
  for (std::size_t z = 0; z < 4; ++z)
    for (std::size_t y = 0; y < 4; ++y)
      for (std::size_t x = 0; x < 4; ++x) {
        const float weight = static_cast<float>(share) * p.wx[x] * p.wy[y] * p.wz[z];
        if (weight == 0) continue;
        const std::uint32_t node = table_.node(p, x, y, z);
        if (!nodes_.is_taken[node]) column.nodes.push_back(node);
        nodes_.is_taken[node] = 1;
        nodes_.weight[node] += weight;
      }
}

void LandmarkColumns::add_nodes(const Column& column, bool held, std::vector<float>& fields) const noexcept {
  for (std::size_t i = 0; i < column.nodes.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float* field = &fields[axis * table_.field_size()];
      if (held)
        table_.add_held_column(column.nodes[i], axis, column.weights[i], field);
      else
        table_.add_column(column.nodes[i], axis, column.weights[i], field);
    }
}

void LandmarkColumns::gather_exactly(Column& column, std::uint32_t landmark, const NeedleRings& rings) {
  column.nodes.clear();
  column.weights.clear();
  column.lumps.clear();
  column.is_wide = false;
  column.modulus = table_.modulus();  // the kernel ensures it
  for (std::size_t r = 0; table_.is_mixed() && r < rings.rings().size(); ++r) {
    const NeedleRings::Ring& ring = rings.rings()[r];
    for (std::size_t side = 0; side < 2; ++side)
      if (ring.landmark[side] == landmark && ring.smooth[side] > 0)
        add_to_lump(ring, moduli_[r][side], field_moduli_[r][side], ring.smooth[side], column);
  }
  PointGroups group;
  group.begin_group();
  rings.add_to(group, landmark);
  group.finish();
  std::vector<Vec3> nodes;
  for (std::uint32_t node = 0; node < table_.nodes(); ++node) nodes.push_back(table_.position(node));
  const Eigen::MatrixXd u =
      kernel_.smooth_fields(nodes, table_.modulus(), group, Eigen::MatrixXd::Identity(3, 3));
  const std::size_t size = table_.field_size();
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (Index i = 0; i < u.rows(); ++i)
      column.fields[axis * size + static_cast<std::size_t>(i)] =
          static_cast<float>(u(i, static_cast<Index>(axis)));
}

void LandmarkColumns::prepare_exact_pairs(const NeedleRings& rings) {
  PointGroups groups;
  std::vector<Index> rows;
  for (std::size_t l = 0; l < count_; ++l) {
    if (!column(l).is_exact) continue;
    groups.begin_group();
    rings.add_to(groups, static_cast<std::uint32_t>(l));
    rows.push_back(3 * static_cast<Index>(l));
  }
  groups.finish();
  const Eigen::MatrixXd C = kernel_.between(groups, groups);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      exact_.matrix.block<3, 3>(rows[i], rows[j]) =
          C.block<3, 3>(3 * static_cast<Index>(i), 3 * static_cast<Index>(j));
}

Mat3 LandmarkColumns::observe(const Column& a, const std::vector<float>& fields) const noexcept {
  Mat3 value = Mat3::Zero();
  const std::size_t size = table_.field_size();
  for (std::size_t i = 0; i < a.nodes.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* u = &fields[axis * size + 3 * std::size_t{a.nodes[i]}];
      value.col(static_cast<Index>(axis)) += a.weights[i] * Vec3(u[0], u[1], u[2]);
    }
  return value;
}

// b's field at a; of two wide cores the mean of both ways, which are not quite the same.
Mat3 LandmarkColumns::value_in_mixed(const Column& a, const Column& b) const noexcept {
  const auto seen = [&](const Column& by, const Column& force) {
    return Mat3(observe(by, force.fields) + between_lumps(by, force));
  };
  if (b.is_exact || !a.is_wide) return seen(a, b);
  if (!b.is_wide) return seen(b, a).transpose();
  return 0.5 * (seen(a, b) + seen(b, a).transpose());
}

// b's field at a. It is weighted for tissue of the table's modulus; where a has another, so has the
// weight of Q.
Mat3 LandmarkColumns::value(const Column& a, const Column& b) const noexcept {
  if (table_.is_mixed()) return value_in_mixed(a, b);
  const double k = table_.modulus();
  Mat3 value = observe(a, b.fields);
  if (a.modulus == k || b.is_exact) return value;
  const Mat3 held = b.modulus == k ? Mat3(observe(b, a.held_fields).transpose()) : observe(a, b.held_fields);
  return value + (2 / (b.modulus + k) - 2 / (a.modulus + b.modulus)) * held;
}

Mat3 LandmarkColumns::self_compliance(std::size_t landmark) const noexcept {
  const Column& own = column(landmark);
  return own.is_exact ? Mat3(Mat3::Zero()) : value(own, own);
}

void LandmarkColumns::begin_matrix(Eigen::Ref<Eigen::MatrixXd> K) noexcept {
  for (std::size_t j = 0; j < count_; ++j)
    for (std::size_t i = j; i < count_; ++i) {
      Mat3& known = table_blocks_[slots_.slot(j) * max_landmarks_ + slots_.slot(i)];
      if (slots_.take_pair(i, j)) {
        const Column &a = column(i), &b = column(j);
        const bool through_b = a.is_exact && !b.is_exact;
        known = through_b ? Mat3(value(b, a).transpose()) : value(a, b);
      }
      K.block<3, 3>(3 * static_cast<Index>(i), 3 * static_cast<Index>(j)) = known;
    }
}

void LandmarkColumns::finish_matrix(Eigen::Ref<Eigen::MatrixXd> K) const noexcept {
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const Index row = 3 * static_cast<Index>(i), at = 3 * static_cast<Index>(j);
      if (column(i).is_exact && column(j).is_exact)
        K.block<3, 3>(row, at) = exact_.matrix.block<3, 3>(row, at);
    }
}

void LandmarkColumns::add_fields(std::span<const Vec3> forces, float* field) const noexcept {
  const std::size_t size = table_.field_size();
  for (std::size_t l = 0; l < forces.size(); ++l)
    for (std::size_t axis = 0; axis < 3; ++axis)
      loops_.axpy(static_cast<float>(forces[l][static_cast<Index>(axis)]), &column(l).fields[axis * size],
                  field, size);
}

}  // namespace brachy
