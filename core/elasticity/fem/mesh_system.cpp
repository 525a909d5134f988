#include "core/elasticity/fem/mesh_system.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/error.h"

namespace brachy {
namespace {

using Eigen::Index;

constexpr int kColumns = BandRow::kCount;
constexpr std::size_t kSets = 4;  // of columns that are solved at once

// Rows of free nodes, three each in the order of the nodes; fixed node f has −1 − f.
std::vector<int> number_rows(const HexMesh& mesh, const MeshSystem::IsFixed& is_fixed) {
  std::vector<int> rows;
  int free_rows = 0, fixed = 0;
  for (int node = 0; node < mesh.nodes(); ++node) {
    if (is_fixed(mesh, mesh.place(node))) {
      rows.push_back(-1 - fixed++);
    } else {
      rows.push_back(free_rows);
      free_rows += 3;
    }
  }
  if (free_rows == 0) throw UserError("the body's mesh has no node that can move: its box is too thin");
  return rows;
}

int count_rows(const std::vector<int>& rows) {
  const auto last = std::ranges::max_element(rows);
  return *last + 3;
}

template <class Visit>
void for_each_cell(const HexMesh& mesh, const Visit& visit) {
  HexMesh::Place cell{};
  for (cell[2] = 0; cell[2] + 1 < mesh.planes(2); ++cell[2])
    for (cell[1] = 0; cell[1] + 1 < mesh.planes(1); ++cell[1])
      for (cell[0] = 0; cell[0] + 1 < mesh.planes(0); ++cell[0]) visit(cell);
}

int half_band(const HexMesh& mesh, const std::vector<int>& rows) {
  int widest = 0;
  for_each_cell(mesh, [&](const HexMesh::Place& cell) {
    int first = std::numeric_limits<int>::max(), last = 0;
    for (int a = 0; a < 8; ++a) {
      const int row = rows[static_cast<std::size_t>(mesh.cell_node(cell, a))];
      if (row < 0) continue;
      first = std::min(first, row);
      last = std::max(last, row);
    }
    widest = std::max(widest, last + 2 - first);
  });
  return widest;
}

}  // namespace

MeshSystem::MeshSystem(HexMesh mesh, double poisson, const CellModulus& modulus, const IsFixed& is_fixed,
                       SimdTarget target)
    : mesh_(std::move(mesh)),
      rows_(number_rows(mesh_, is_fixed)),
      factor_(count_rows(rows_), half_band(mesh_, rows_), target) {
  for (int node = 0; node < mesh_.nodes(); ++node)
    if (rows_[static_cast<std::size_t>(node)] < 0) fixed_.push_back(mesh_.position(mesh_.place(node)));
  assemble(poisson, modulus);
  if (!factor_.factor())
    throw UserError("the body's mesh is not stiff in every direction: hold at least one face of the box");
}

void MeshSystem::assemble(double poisson, const CellModulus& modulus) {
  for_each_cell(mesh_, [&](const HexMesh::Place& cell) {
    const auto K = hex_stiffness(mesh_.cell_size(cell), poisson, modulus(mesh_, cell));
    for (int a = 0; a < 8; ++a) {
      const int row = rows_[static_cast<std::size_t>(mesh_.cell_node(cell, a))];
      if (row < 0) continue;
      for (int b = 0; b < 8; ++b) {
        const int column = rows_[static_cast<std::size_t>(mesh_.cell_node(cell, b))];
        if (column < 0)
          couplings_.push_back({row, static_cast<std::size_t>(-1 - column), K.block<3, 3>(3 * a, 3 * b)});
        for (int i = 0; column >= 0 && i < 3; ++i)
          for (int j = 0; j < 3 && column + j <= row + i; ++j)
            factor_.at(row + i, column + j) += K(3 * a + i, 3 * b + j);
      }
    }
  });
  merge_couplings();
}

// Cells that share a free and a fixed node have each given the pair a coupling.
void MeshSystem::merge_couplings() {
  const auto pair_of = [](const Coupling& c) { return std::pair(c.row, c.fixed); };
  std::ranges::stable_sort(couplings_, {}, pair_of);
  std::vector<Coupling> merged;
  for (const Coupling& c : couplings_)
    if (!merged.empty() && pair_of(merged.back()) == pair_of(c))
      merged.back().stiffness += c.stiffness;
    else
      merged.push_back(c);
  couplings_ = std::move(merged);
}

std::vector<MeshSystem::Observation> MeshSystem::observe(const PointGroups& groups) const {
  std::vector<Observation> observations(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (std::uint32_t p = groups.first[g]; p < groups.first[g + 1]; ++p) {
      const HexMesh::Shape shape = mesh_.shape(groups.points[p]);
      for (std::size_t a = 0; a < 8; ++a) {
        const int row = rows_[static_cast<std::size_t>(shape.node[a])];
        if (row >= 0 && shape.share[a] != 0)
          observations[g].push_back({row, groups.weights[p] * shape.share[a]});
      }
    }
  return observations;
}

int MeshSystem::load(std::span<const Load> loads, const PointGroups& b, const std::vector<Observation>& of_b,
                     const FixedMotion& fixed_motion, BandRow* x) const {
  int first = factor_.rows() - 1;
  const auto add = [&](int row, const Forces& forces, double share) {
    first = std::min(first, row);
    BandRow* rows = &x[static_cast<std::size_t>(row)];
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < kColumns; ++c) rows[i].column[c] += share * forces(i, c);
  };
  for (const Load& l : loads)
    for (const Term& term : of_b[l.group]) add(term.row, l.forces, term.share);
  if (!fixed_motion) return first;

  std::vector<Forces> motions(fixed_.size(), Forces::Zero());
  for (std::size_t f = 0; f < fixed_.size(); ++f)
    for (const Load& l : loads) motions[f] += fixed_motion(fixed_[f], b, l.group) * l.forces;
  return std::min(first, load_fixed(motions, x));
}

int MeshSystem::load_units(std::span<const std::size_t> groups, const PointGroups& b,
                           const std::vector<Observation>& of_b, const FixedMotion& fixed_motion,
                           BandRow* x) const {
  int first = factor_.rows() - 1;
  for (std::size_t q = 0; q < groups.size(); ++q)
    for (const Term& term : of_b[groups[q]]) {
      first = std::min(first, term.row);
      for (std::size_t i = 0; i < 3; ++i)
        x[static_cast<std::size_t>(term.row) + i].column[3 * q + i] += term.share;
    }
  if (!fixed_motion) return first;

  std::vector<Forces> motions(fixed_.size(), Forces::Zero());
  for (std::size_t f = 0; f < fixed_.size(); ++f)
    for (std::size_t q = 0; q < groups.size(); ++q)
      motions[f].middleCols<3>(static_cast<Index>(3 * q)) = fixed_motion(fixed_[f], b, groups[q]);
  return std::min(first, load_fixed(motions, x));
}

int MeshSystem::load_fixed(const std::vector<Forces>& motions, BandRow* x) const {
  int first = factor_.rows() - 1;
  for (const Coupling& c : couplings_) {
    first = std::min(first, c.row);
    Eigen::Map<Forces>(x[c.row].column).noalias() -= c.stiffness.lazyProduct(motions[c.fixed]);
  }
  return first;
}

void MeshSystem::read(const std::vector<Observation>& of_a, const BandRow* x,
                      Eigen::Ref<Eigen::MatrixXd> out) const {
  for (std::size_t g = 0; g < of_a.size(); ++g) {
    Forces sum = Forces::Zero();
    for (const Term& term : of_a[g]) {
      const BandRow* rows = &x[static_cast<std::size_t>(term.row)];
      for (int i = 0; i < 3; ++i)
        sum.row(i) += term.share * Eigen::Map<const Eigen::Matrix<double, 1, kColumns>>(rows[i].column);
    }
    out.middleRows<3>(static_cast<Index>(3 * g)) = sum.leftCols(out.cols());
  }
}

int MeshSystem::first_row(const std::vector<Observation>& observations) const {
  int first = factor_.rows();
  for (const Observation& terms : observations)
    for (const Term& term : terms) first = std::min(first, term.row);
  return first;
}

// Groups that lie near each other are solved together, so that none begins much before the others, and several sets of
// 24 columns at once.
Eigen::MatrixXd MeshSystem::between(const PointGroups& a, const PointGroups& b,
                                    const FixedMotion& fixed_motion) const {
  const std::vector<Observation> of_a = observe(a), of_b = observe(b);
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Zero(static_cast<Index>(3 * a.size()), static_cast<Index>(3 * b.size()));
  std::vector<std::size_t> order;
  for (std::size_t g = 0; g < b.size(); ++g)
    if (b.first[g] < b.first[g + 1]) order.push_back(g);
  std::ranges::sort(order, {}, [&](std::size_t g) { return of_b[g].empty() ? 0 : of_b[g].front().row; });

  constexpr std::size_t kGroups = kColumns / 3;
  const std::size_t stride = factor_.padded_rows(), most = std::min(order.size(), kSets * kGroups);
  const auto group = [&](std::size_t begin) {
    return std::span(order).subspan(begin, std::min(kGroups, order.size() - begin));
  };
  std::vector<BandRow> x((most + kGroups - 1) / kGroups * stride);
  Eigen::MatrixXd out(all.rows(), kColumns);
  for (std::size_t begin = 0; begin < order.size(); begin += kSets * kGroups) {
    const std::size_t end = std::min(begin + kSets * kGroups, order.size());
    std::ranges::fill(x, BandRow{});
    int first = factor_.rows();
    std::size_t sets = 0;
    for (std::size_t set = begin; set < end; set += kGroups) {
      first = std::min(first, load_units(group(set), b, of_b, fixed_motion, &x[sets++ * stride]));
    }
    factor_.solve(x.data(), sets, first, first_row(of_a));
    for (std::size_t set = 0; set < sets; ++set) {
      read(of_a, &x[set * stride], out);
      Index column = 0;
      for (const std::size_t g : group(begin + set * kGroups)) {
        all.middleCols<3>(static_cast<Index>(3 * g)) = out.middleCols<3>(column);
        column += 3;
      }
    }
  }
  return all;
}

Eigen::MatrixXd MeshSystem::fields(const PointGroups& a, const PointGroups& b, const Eigen::MatrixXd& forces,
                                   const FixedMotion& fixed_motion) const {
  const std::vector<Observation> of_a = observe(a), of_b = observe(b);
  Eigen::MatrixXd all(static_cast<Index>(3 * a.size()), forces.cols());
  std::vector<BandRow> x(factor_.padded_rows());
  for (Index begin = 0; begin < forces.cols(); begin += kColumns) {
    const Index count = std::min<Index>(kColumns, forces.cols() - begin);
    std::vector<Load> loads;
    for (std::size_t g = 0; g < b.size(); ++g) {
      loads.push_back({g, Forces::Zero()});
      loads.back().forces.leftCols(count) = forces.block(static_cast<Index>(3 * g), begin, 3, count);
    }
    std::ranges::fill(x, BandRow{});
    const int first = load(loads, b, of_b, fixed_motion, x.data());
    factor_.solve(x.data(), 1, first, first_row(of_a));
    read(of_a, x.data(), all.middleCols(begin, count));
  }
  return all;
}

std::size_t MeshSystem::bytes() const {
  return factor_.bytes() + couplings_.size() * sizeof(Coupling) + fixed_.size() * sizeof(Vec3) +
         rows_.size() * sizeof(int);
}

}  // namespace brachy
