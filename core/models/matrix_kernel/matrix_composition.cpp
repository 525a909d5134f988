#include "core/models/matrix_kernel/matrix_composition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/share_out.h"
#include "core/injectivity/injectivity_search.h"

namespace brachy {
namespace {

constexpr std::size_t kPoints = Tissue::kBlockSize;
constexpr double kMet = 2e-3;      // mm: a landmark missed by no more needs no correction
constexpr double kNotFelt = 2e-3;  // mm
// Within this many of the landmarks' largest displacement, and some mm, the tissue has stayed where it was.
constexpr double kStays = 1.5, kStaysBeyond = 1;
constexpr double kClose = 2;  // clearances of a needle within which a point is close to it

// How far along the way between its landmarks a ring lies, 0 … 1.
double share_between(const NeedleRings::Ring& ring, std::span<const Vec3> positions) {
  const Vec3& a = positions[ring.landmark[0]];
  const Vec3 way = positions[ring.landmark[1]] - a;
  const double length = way.squaredNorm();
  return length > 0 ? std::clamp((ring.centre - a).dot(way) / length, 0.0, 1.0) : 0;
}

// x += scale u, and the box about the points.
void move(const BlockDisplacement<float>& u, double scale, std::size_t count, BlockPoints<float>& X,
          const Vec3& centre, Block& box) {
  const auto s = static_cast<float>(scale);
  for (std::size_t i = 0; i < kPoints; ++i) {
    X.x[i] += s * u.ux[i];
    X.y[i] += s * u.uy[i];
    X.z[i] += s * u.uz[i];
  }
  Eigen::Vector3f min(X.x[0], X.y[0], X.z[0]), max = min;
  for (std::size_t i = 1; i < count; ++i) {
    const Eigen::Vector3f x(X.x[i], X.y[i], X.z[i]);
    min = min.cwiseMin(x);
    max = max.cwiseMax(x);
  }
  box.min = centre + min.cast<double>();
  box.max = centre + max.cast<double>();
}

void add(const BlockDisplacement<float>& more, double scale, BlockDisplacement<float>& u) {
  const auto s = static_cast<float>(scale);
  for (std::size_t i = 0; i < kPoints; ++i) {
    u.ux[i] += s * more.ux[i];
    u.uy[i] += s * more.uy[i];
    u.uz[i] += s * more.uz[i];
  }
}

// The point whose displacements differ most.
std::uint32_t farthest_apart(const BlockDisplacement<float>& a, const BlockDisplacement<float>& b,
                             std::size_t count) {
  alignas(64) float apart2[kPoints];
  for (std::size_t i = 0; i < kPoints; ++i) {
    const float x = a.ux[i] - b.ux[i], y = a.uy[i] - b.uy[i], z = a.uz[i] - b.uz[i];
    apart2[i] = x * x + y * y + z * z;
  }
  return static_cast<std::uint32_t>(std::max_element(apart2, apart2 + count) - apart2);
}

}  // namespace

MatrixComposition::MatrixComposition(const Tissue& tissue, const MatrixKernelField& field, SimdTarget target,
                                     std::size_t max_landmarks, std::size_t max_steps,
                                     const WorkBudget& budget)
    : Composition(tissue.blocks.size()),
      tissue_(tissue),
      field_(field),
      max_steps_(max_steps),
      steps_(max_steps + kCorrections),
      budget_(budget),
      sources_(static_cast<std::size_t>(std::max(1, field.threads()))) {
  blocks_.all.resize(tissue.blocks.size());
  blocks_.shown.resize(tissue.blocks.size());
  smooth_.blocks.resize(tissue.blocks.size());
  smooth_.block_determinants.resize(tissue.blocks.size());
  const std::size_t rings = field.max_sources();
  if (field.parts().smooth) smooth_cells_.emplace(tissue, *field.parts().smooth, target);
  cells_.reserve(steps_.size());
  for (std::size_t k = 0; k < steps_.size(); ++k)
    cells_.emplace_back(tissue, field.parts().near, nullptr, field.needle_radius(), target, rings, budget);
  for (Step& step : steps_) {
    step.rings.reserve(2 * max_landmarks);
    step.pieces.reserve(rings);
    step.forces.reserve(rings);
  }
  for (auto* v : {&smooth_.landmarks, &carried_.images, &correction_.misses, &correction_.forces})
    v->reserve(max_landmarks);
  carried_.lots.resize(1 + max_landmarks / NearLoops::kFew);
  smooth_.rings.reserve(rings);
  correction_.near_forces.reserve(rings);
  correction_.of_steps.reserve(max_landmarks);
  correction_.close.reserve(max_landmarks * max_landmarks);
  correction_.close_blocks.reserve(max_landmarks * max_landmarks);
  for (auto* v : {&correction_.cores, &correction_.own_blocks}) v->reserve(max_landmarks);
  correction_.close_ends.reserve(max_landmarks);
  blocks_.refined.reserve(WorkBudget::kRefinedBlocks + steps_.size());
  for (auto& sources : sources_) sources.reserve(rings * NeedleRings::kPoints);
  std::iota(blocks_.all.begin(), blocks_.all.end(), 0u);
  blocks_.chosen.reserve(blocks_.all.size());
  blocks_.last_landmarks.reserve(max_landmarks);
  blocks_.movers.reserve(max_landmarks);
}

double MatrixComposition::begin(std::span<const Vec3> positions,
                                std::span<const Vec3> displacements) noexcept {
  begin_way(positions, displacements);
  count_ = carried_.steps = 0;
  for (Shown& block : blocks_.shown) block.is_present = false;
  note_motion();
  correction_.is_on = correction_.has_blocks = false;
  correction_.cores.clear();
  missed_ = 0;
  const MatrixKernelField::Parts parts = field_.parts();
  const auto smooth_at = [&](const Vec3& X) {
    Vec3 u = Vec3::Zero();
    if (parts.smooth) parts.smooth->add_displacement_at(X, u);
    return u;
  };
  smooth_.landmarks.clear();
  smooth_.rings.clear();
  for (const Vec3& p : positions) smooth_.landmarks.push_back(smooth_at(p));
  for (const NeedleRings::Ring& ring : parts.rings.rings()) smooth_.rings.push_back(smooth_at(ring.centre));
  largest_ = 0;
  for (const Vec3& d : displacements) largest_ = std::max(largest_, d.norm());
  prepare_forces();
  return parts.smooth ? 1 - parts.smooth->steepest() : 1;
}

bool MatrixComposition::next() noexcept {
  if (reached() >= 1) {
    correction_.is_on = true;
    if (!prepare_correction()) return false;
  } else {
    if (steps() == max_steps_ || !allowance().may_add_step) {
      missed_ = find_misses();
      return false;
    }
    place_rings();
  }
  const Step& step = steps_[count_];
  cells_[count_].set_field(step.rings, step.forces, step.pieces, kStays * largest_ + kStaysBeyond);
  return true;
}

// The same forces in every step, because what is between a needle's landmarks hardly changes as they move together;
// with those that correct what one whole step would miss.
void MatrixComposition::prepare_forces() noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  correction_.near_forces.assign(parts.ring_forces.begin(), parts.ring_forces.end());
  correction_.of_steps.clear();
  if (!allowance().may_correct_steps) return;
  place_rings();
  steps_[0].scale = 1;
  count_ = 1;
  const double worst = find_misses();
  count_ = carried_.steps = 0;
  if (worst <= kMet) return;
  for (std::size_t i = 0; i < positions_.size(); ++i)
    carried_.images[i] = positions_[i] + smooth_.landmarks[i];
  solve_correction(worst, correction_.of_steps);
  correction_.near_forces.insert(correction_.near_forces.end(), correction_.forces.begin(),
                                 correction_.forces.end());
}

std::size_t MatrixComposition::most_steps() const {
  return std::min(allowance().steps, max_steps_);
}

void MatrixComposition::place_rings() noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  const std::size_t own = parts.ring_forces.size();
  Step& step = steps_[count_];
  step.rings = parts.rings;
  step.rings.append(correction_.of_steps);
  step.forces = correction_.near_forces;
  const auto way = [&](std::size_t l) { return Vec3(landmark_displacements_[l] - smooth_.landmarks[l]); };
  for (std::size_t r = 0; r < own; ++r) {
    const NeedleRings::Ring& ring = parts.rings.rings()[r];
    const double t = share_between(ring, positions_);
    step.rings.move(
        r, smooth_.rings[r] + reached() * ((1 - t) * way(ring.landmark[0]) + t * way(ring.landmark[1])));
  }
  for (std::size_t r = own; r < step.forces.size(); ++r) step.rings.move(r, reached() * way(r - own));
  NearField::take_pieces(step.rings, step.forces, step.pieces);
  limit_reach(step, own);
}

// A correction of e at its place is about 2.7 e (c/r)³ at r beyond two of its cores: felt as far as that counts.
void MatrixComposition::limit_reach(Step& step, std::size_t first) const noexcept {
  for (NearField::Piece& piece : step.pieces) {
    if (piece.first < first) continue;
    const double core = std::sqrt(step.rings.rings()[piece.first].core.s);
    const double there = 0.5 * field_.parts().near.compliance_times_core() / core * piece.size;
    piece.reach = core * std::max(2.0, std::cbrt(2.7 * there / kNotFelt));
  }
}

void MatrixComposition::accept(double scale, const Vec3* weakest) noexcept {
  Step& step = steps_[count_++];
  step.scale = scale;
  step.begin = reached();
  step.weakest.reset();
  if (weakest) step.weakest = *weakest;
  if (!correction_.is_on) go_on(scale);
}

// Where the landmarks' tissue is by the steps so far, evaluated as the tissue's points are: together, or where they are
// more than a block, in lots that are far from most rings, as many needles' landmarks come one needle after the other.
void MatrixComposition::find_images() noexcept {
  const NearField& near = field_.parts().near;
  const std::size_t lot = positions_.size() > kPoints ? NearLoops::kFew : kPoints;
  if (carried_.steps == 0) begin_lots(lot);
  carried_.images.clear();
  for (std::size_t first = 0; first < positions_.size(); first += lot) {
    const std::size_t count = std::min(lot, positions_.size() - first);
    const Vec3& centre = positions_[first];
    Lot& carried = carried_.lots[first / lot];
    for (std::size_t k = carried_.steps; k < count_; ++k) {
      const Step& step = steps_[k];
      BlockDisplacement<float> u{};
      near.add_to_points(carried.X, centre, carried.box, step.rings, step.forces, step.pieces, sources_[0], u,
                         lot);
      move(u, step.scale, count, carried.X, centre, carried.box);
    }
    for (std::size_t i = 0; i < count; ++i)
      carried_.images.push_back(
          centre + Eigen::Vector3f(carried.X.x[i], carried.X.y[i], carried.X.z[i]).cast<double>());
  }
  carried_.steps = count_;
}

void MatrixComposition::begin_lots(std::size_t lot) noexcept {
  for (std::size_t first = 0; first < positions_.size(); first += lot) {
    const std::size_t count = std::min(lot, positions_.size() - first);
    const Vec3& centre = positions_[first];
    Lot& carried = carried_.lots[first / lot];
    for (std::size_t i = 0; i < kPoints; ++i) {
      const std::size_t k = first + (i < count ? i : 0);
      const Eigen::Vector3f x = (positions_[k] + smooth_.landmarks[k] - centre).cast<float>();
      carried.X.x[i] = x.x();
      carried.X.y[i] = x.y();
      carried.X.z[i] = x.z();
    }
    move({}, 0, count, carried.X, centre, carried.box);
  }
}

double MatrixComposition::correction_core(std::size_t landmark) const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < positions_.size(); ++i)
    if (i != landmark) least = std::min(least, (positions_[i] - positions_[landmark]).squaredNorm());
  return std::clamp(kOfDistance * std::sqrt(least), kLeastCore * field_.needle_radius(),
                    kWidestCore * field_.needle_radius());
}

// The greatest of what the steps so far miss, mm.
double MatrixComposition::find_misses() noexcept {
  find_images();
  correction_.misses.clear();
  double worst = 0;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    correction_.misses.push_back(positions_[i] + landmark_displacements_[i] - carried_.images[i]);
    worst = std::max(worst, correction_.misses.back().norm());
  }
  return worst;
}

bool MatrixComposition::prepare_correction() noexcept {
  missed_ = find_misses();
  if (missed_ <= kMet || count_ == steps() + kCorrections) return false;
  Step& step = steps_[count_];
  solve_correction(missed_, step.rings);
  step.forces = correction_.forces;
  NearField::take_pieces(step.rings, step.forces, step.pieces);
  limit_reach(step, 0);
  return true;
}

// Forces at the landmarks' images that displace what is there by the misses, of which `worst` is the greatest:
// M g = misses, M_ij what a force at j does at i. Cores of half the way to the nearest landmark make the diagonal
// dominate, so Gauss's and Seidel's sweeps converge, and fast.
void MatrixComposition::solve_correction(double worst, NeedleRings& points) noexcept {
  const std::size_t n = positions_.size();
  if (correction_.cores.empty())
    for (std::size_t i = 0; i < n; ++i) correction_.cores.push_back(correction_core(i));
  points.clear();
  for (std::size_t i = 0; i < n; ++i)
    points.add_point(carried_.images[i], PointCore::of_correction(correction_.cores[i]),
                     static_cast<std::uint32_t>(i));
  // Between one correction and the next many landmarks have hardly moved.
  if (!correction_.has_blocks) find_correction_blocks(points);
  const Allowance may = allowance();
  correction_.has_blocks = correction_.is_on && !may.may_renew_corrections;
  correction_.forces.assign(n, Vec3::Zero());
  for (std::size_t sweep = 0; sweep < may.correction_sweeps && worst > 0.25 * kMet; ++sweep) {
    worst = 0;
    for (std::size_t i = 0, k = 0; i < n; ++i) {
      Vec3 left = correction_.misses[i];
      for (; k < correction_.close_ends[i]; ++k)
        left -= correction_.close_blocks[k] * correction_.forces[correction_.close[k]];
      correction_.forces[i] += left / correction_.own_blocks[i];
      worst = std::max(worst, left.norm());
    }
  }
}

void MatrixComposition::find_correction_blocks(const NeedleRings& points) noexcept {
  const NearField& near = field_.parts().near;
  const std::size_t n = positions_.size();
  const auto rings = points.rings();
  correction_.close.clear();
  correction_.close_blocks.clear();
  correction_.close_ends.clear();
  correction_.own_blocks.clear();
  const double felt = allowance().correction_reach;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const Vec3 apart = carried_.images[i] - carried_.images[j];
      if (apart.squaredNorm() > felt * felt * rings[j].core.s) continue;
      correction_.close.push_back(static_cast<std::uint32_t>(j));
      correction_.close_blocks.push_back(near.of_correction(apart, rings[j].core));
      if (i == j) correction_.own_blocks.push_back(correction_.close_blocks.back()(0, 0));
    }
    correction_.close_ends.push_back(correction_.close.size());
  }
}

void MatrixComposition::end() noexcept {
  std::ranges::fill(displacements_, BlockDisplacement<float>{});
  std::ranges::fill(blocks_.shown, Shown{});
  blocks_.last_landmarks.clear();
  blocks_.wanted = 0;
  blocks_.is_unfinished = false;
  blocks_.lag_mm = 0;
}

void MatrixComposition::save(StateWriter& writer) const {
  writer(displacements_, blocks_.shown, blocks_.last_landmarks, blocks_.wanted, blocks_.is_unfinished,
         blocks_.lag_mm, least_determinant_, least_place_);
}

void MatrixComposition::restore(StateReader& reader) {
  reader(displacements_, blocks_.shown, blocks_.last_landmarks, blocks_.wanted, blocks_.is_unfinished,
         blocks_.lag_mm, least_determinant_, least_place_);
}

// With the steps so far, corrections included where they are composed.
Allowance MatrixComposition::allowance() const noexcept {
  return budget_.allowance(
      {.landmarks = positions_.size(), .steps = count_, .sources = correction_.near_forces.size()});
}

TickWork MatrixComposition::work_ahead(std::size_t steps) const {
  const std::size_t n = positions_.size();
  return {.landmarks = n,
          .steps = steps + WorkBudget::kUsualCorrections,
          .step_sources = steps * correction_.near_forces.size() + WorkBudget::kUsualCorrections * n,
          .blocks = blocks_.wanted + blocks_.all.size() / WorkCosts::kLagBlocks};
}

// All blocks that do not show the present landmarks yet; or those of them that lag most, as many as lag at all and the
// tick has time for.
void MatrixComposition::choose_blocks(std::uint64_t work) noexcept {
  std::size_t rings = 0;
  for (std::size_t k = 0; k < count_; ++k) rings += steps_[k].forces.size();
  const Allowance may = budget_.allowance({.landmarks = positions_.size(),
                                           .steps = count_,
                                           .step_sources = rings,
                                           .certificate_pairs = work,
                                           .blocks = blocks_.all.size()});
  std::vector<std::uint32_t>& chosen = blocks_.chosen;
  chosen.clear();
  for (const std::uint32_t b : blocks_.all)
    if (!blocks_.shown[b].is_present) chosen.push_back(b);
  // What is stirred stands still for a moment at each end.
  const std::size_t wanted_lately =
      blocks_.wanted - std::min(blocks_.wanted, blocks_.all.size() / WorkBudget::kWantedTicks);
  blocks_.wanted = std::max(wanted_lately, chosen.size());
  blocks_.is_unfinished = may.easy_blocks < chosen.size();
  blocks_.lag_mm = 0;
  if (!blocks_.is_unfinished) return;
  spread_motion();
  find_lags();
  const auto lag_of = [&](std::uint32_t b) { return blocks_.shown[b].lag_mm; };
  const auto lagging = static_cast<std::size_t>(std::ranges::count_if(
      chosen, [&](std::uint32_t b) { return !(static_cast<double>(lag_of(b)) <= may.lag_mm); }));
  blocks_.wanted = std::max(wanted_lately, lagging);
  const std::size_t most =
      std::max(may.easy_blocks, lagging <= may.whole_blocks ? lagging : std::min(may.blocks, lagging));
  blocks_.is_unfinished = most < chosen.size();
  if (!blocks_.is_unfinished) return;
  const auto end = chosen.begin() + static_cast<std::ptrdiff_t>(most);
  std::ranges::nth_element(chosen, end, [&](std::uint32_t a, std::uint32_t b) {
    return lag_of(a) != lag_of(b) ? lag_of(a) > lag_of(b) : a < b;
  });
  blocks_.lag_mm = static_cast<double>(lag_of(*end));  // of those that are left out the most
  chosen.erase(end, chosen.end());
  std::ranges::sort(chosen);
}

// A landmark has gone as far as it is from the nearest of the last tick's; the first of all, all their way.
void MatrixComposition::note_motion() noexcept {
  std::vector<Vec3>& last = blocks_.last_landmarks;
  blocks_.movers.clear();
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    double least2 = landmark_displacements_[i].squaredNorm();
    for (std::size_t k = 0; k < last.size(); ++k) {
      const double distance2 = (positions_[i] + landmark_displacements_[i] - last[k]).squaredNorm();
      least2 = k == 0 ? distance2 : std::min(least2, distance2);
    }
    if (least2 > 0) blocks_.movers.push_back({positions_[i], std::sqrt(least2)});
  }
  last.clear();
  for (std::size_t i = 0; i < positions_.size(); ++i)
    last.push_back(positions_[i] + landmark_displacements_[i]);
}

// To the blocks beside them. Where all blocks are evaluated nothing of it would be left.
void MatrixComposition::spread_motion() noexcept {
  for (const std::uint32_t b : blocks_.all) {
    double farthest = 0;
    for (const auto& [at, motion] : blocks_.movers)
      if (motion > farthest &&
          tissue_.blocks[b].squared_distance(at) <= WorkBudget::kBesideMm * WorkBudget::kBesideMm)
        farthest = motion;
    blocks_.shown[b].moved_beside_mm += static_cast<float>(farthest);
  }
  blocks_.movers.clear();
}

// By all steps. `together`: as many points as add_to_points is asked for.
void MatrixComposition::carry(CentredPoints& points, std::size_t count, std::size_t together) noexcept {
  for (std::size_t k = 0; k < count_; ++k) {
    const Step& step = steps_[k];
    BlockDisplacement<float> u{};
    field_.parts().near.add_to_points(points.local, points.centre, points.box, step.rings, step.forces,
                                      step.pieces, sources_[0], u, together);
    move(u, step.scale, count, points.local, points.centre, points.box);
  }
}

// The point of each block that moved most last, as all are evaluated, those of some neighbouring blocks together.
void MatrixComposition::find_lags() noexcept {
  constexpr std::size_t kTogether = NearLoops::kFew;
  const SmoothField* smooth = field_.parts().smooth;
  std::array<Vec3, kTogether> X;
  for (std::size_t first = 0; first < blocks_.chosen.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, blocks_.chosen.size() - first);
    const auto rest = [&](std::size_t i) {
      const std::uint32_t b = blocks_.chosen[first + i];
      return tissue_.rest_vertices[tissue_.blocks[b].first + blocks_.shown[b].sample];
    };
    for (std::size_t i = 0; i < count; ++i) {
      X[i] = rest(i);
      if (smooth) smooth->add_displacement_at(X[i], X[i]);
    }
    CentredPoints points({X.data(), count});
    carry(points, count, kTogether);
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t b = blocks_.chosen[first + i];
      const Vec3 u = points.centre + Vec3(points.local.x[i], points.local.y[i], points.local.z[i]) - rest(i);
      Shown& shown = blocks_.shown[b];
      shown.lag_mm =
          std::max(static_cast<float>((u - displacement_in(displacements_[b], shown.sample)).norm()),
                   WorkBudget::kMovedShare * shown.moved_beside_mm);
    }
  }
}

void MatrixComposition::evaluate(std::uint64_t work) noexcept {
  choose_blocks(work);
  share_out(blocks_.chosen.size(), sources_.size(),
            [&](std::size_t k, std::size_t thread) { evaluate_block(blocks_.chosen[k], sources_[thread]); });
  find_least_determinant();
}

void MatrixComposition::evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  BlockDisplacement<float>& u = displacements_[b];
  const BlockDisplacement<float> before = u;
  u = {};
  if (parts.smooth) parts.smooth->interpolate(b, parts.near.blocks().points[b], u);
  Block box = tissue_.blocks[b];
  const Vec3& centre = parts.near.blocks().centres[b];
  smooth_.blocks[b] = Eigen::Vector3f(u.ux[0], u.uy[0], u.uz[0]).cast<double>();
  smooth_.block_determinants[b] =
      parts.smooth ? (Mat3::Identity() + parts.smooth->gradient_at(centre)).determinant() : 1;
  BlockPoints<float> X = parts.near.blocks().points[b];
  move(u, 1, box.count, X, centre, box);
  for (std::size_t k = 0; k < count_; ++k) {
    const Step& step = steps_[k];
    BlockDisplacement<float> more{};
    parts.near.add_to_points(X, centre, box, step.rings, step.forces, step.pieces, sources, more);
    add(more, step.scale, u);
    if (k + 1 < count_) move(more, step.scale, box.count, X, centre, box);
  }
  Shown& shown = blocks_.shown[b];
  shown = {.is_present = true, .sample = farthest_apart(before, u, box.count)};
}

// Points close to a needle and a few of each block's first; then all of the blocks with the least among these and of
// those where a step would fold first; and the least of all once more, in double.
void MatrixComposition::find_least_determinant() noexcept {
  WorstBlocks worst;
  worst.fill({2, 0});
  std::array<PointAt, CellPoints::kCount> points;
  std::array<double, CellPoints::kCount> det;
  std::size_t count = 0;
  const auto take = [&] {
    determinants({points.data(), count}, det.data());
    for (std::size_t i = 0; i < count; ++i) {
      const auto [block, index] = points[i];
      Shown& shown = blocks_.shown[block];
      if (det[i] < static_cast<double>(shown.least_det)) {
        shown.least_det = static_cast<float>(det[i]);
        shown.weakest = index;
      }
      const auto known = std::ranges::find(worst, block, &std::pair<double, std::uint32_t>::second);
      auto& place = known != worst.end() && known->first < 2 ? *known : worst.back();
      if (det[i] >= place.first) continue;
      place = {det[i], block};
      std::ranges::sort(worst);
    }
    count = 0;
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const double clearance = cells_[0].clearance();
  constexpr std::uint32_t kStride = WorkBudget::kPointStride;
  const auto add = [&](std::uint32_t b, std::uint32_t first, std::uint32_t stride, double within) {
    const Block& block = tissue_.blocks[b];
    for (std::uint32_t i = first; i < block.count; i += stride) {
      const double distance =
          within > 0
              ? cells_[0].distance_to_needles(tissue_.rest_vertices[block.first + i] + smooth_.blocks[b])
              : clearance;
      if (distance >= clearance && (distance <= within || i % kStride == b % kStride))
        points[count++] = {b, i};
      if (count == points.size()) take();
    }
  };
  const double close = kClose * clearance;
  // The more each point costs the fewer are asked.
  const Allowance may = allowance();
  const auto close_stride = static_cast<std::uint32_t>(may.close_stride);
  for (const std::uint32_t b : blocks_.chosen) {
    const Block& block = tissue_.blocks[b];
    const double radius = 0.5 * (block.max - block.min).norm();
    if (cells_[0].distance_to_needles(0.5 * (block.min + block.max) + smooth_.blocks[b]) > close + radius)
      add(b, b % kStride, kStride, 0);  // none of them is near a needle
    else
      add(b, b % close_stride, close_stride, close);
  }
  if (count > 0) take();
  choose_refined(worst, may);
  for (const std::uint32_t b : blocks_.refined) add(b, 0, 1, kFar);
  if (count > 0) take();
  take_least_determinant();
}

// Of all blocks, those too that show an earlier field.
void MatrixComposition::take_least_determinant() noexcept {
  const auto weakest = std::ranges::min_element(blocks_.shown, {}, &Shown::least_det);
  const auto b = static_cast<std::size_t>(weakest - blocks_.shown.begin());
  least_determinant_ = static_cast<double>(weakest->least_det);
  if (least_determinant_ >= 1) return;
  least_place_ = tissue_.rest_vertices[tissue_.blocks[b].first + weakest->weakest];
  if (weakest->is_present) least_determinant_ = std::min(1.0, determinant_at(least_place_));
}

void MatrixComposition::choose_refined(const WorstBlocks& worst, const Allowance& may) noexcept {
  std::vector<std::uint32_t>& refined = blocks_.refined;
  refined.clear();
  for (const auto& [sampled, b] : worst)
    if (sampled < 2 && refined.size() < may.refined_blocks) refined.push_back(b);
  for (std::size_t k = 0; k < may.weakest_steps; ++k)
    if (steps_[k].weakest) refined.push_back(block_at(*steps_[k].weakest, steps_[k].begin));
  std::ranges::sort(refined);
  refined.erase(std::unique(refined.begin(), refined.end()), refined.end());
}

// The one that is nearest to x when so much of the way is gone.
std::uint32_t MatrixComposition::block_at(const Vec3& x, double reached) const noexcept {
  std::uint32_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const std::uint32_t b : blocks_.chosen) {
    const BlockDisplacement<float>& u = displacements_[b];
    const Vec3 moved = Eigen::Vector3f(u.ux[0], u.uy[0], u.uz[0]).cast<double>();
    const double distance = tissue_.blocks[b].squared_distance(x - reached * moved);
    if (distance >= least) continue;
    least = distance;
    nearest = b;
  }
  return nearest;
}

// det ∇φ at up to CellPoints::kCount of the tissue's points, to about 0.01: rings are single points and the points go
// to their ends along straight lines.
void MatrixComposition::determinants(std::span<const PointAt> points, double* det) noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  std::array<Vec3, CellPoints::kCount> begin, way;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PointAt& p = points[i];
    const BlockDisplacement<float>& u = displacements_[p.block];
    const Vec3& rest = tissue_.rest_vertices[tissue_.blocks[p.block].first + p.index];
    const Vec3& smooth = smooth_.blocks[p.block];
    begin[i] = rest + smooth;
    way[i] = Eigen::Vector3f(u.ux[p.index], u.uy[p.index], u.uz[p.index]).cast<double>() - smooth;
    det[i] = smooth_.block_determinants[p.block];
  }
  for (std::size_t k = 0; k < count_; ++k) {
    const Step& step = steps_[k];
    const double reached = step.begin;
    Vec3 min = begin[0] + reached * way[0], max = min;
    for (std::size_t i = 1; i < points.size(); ++i) {
      min = min.cwiseMin(begin[i] + reached * way[i]);
      max = max.cwiseMax(begin[i] + reached * way[i]);
    }
    const Cell cell = Cell::around(min, max);
    CellPoints X{};
    for (std::size_t i = 0; i < points.size(); ++i) X.set(i, begin[i] + reached * way[i] - cell.centre);
    std::vector<NearSource>& sources = sources_[0];
    sources.clear();
    const auto squared_distance = [&](const Vec3& p) { return cell.squared_distance(p); };
    for (const NearField::Piece& piece : step.pieces)
      if (piece.reaches(squared_distance(piece.centre)))
        parts.near.add_sources(step.rings, step.forces, piece, squared_distance, cell.centre, true, sources);
    CellGradients A{};
    parts.near.add_gradients(X, sources, A);
    alignas(64) float of_step[CellPoints::kCount];
    cells_[k].loops().determinants(A, static_cast<float>(step.scale), of_step);
    for (std::size_t i = 0; i < points.size(); ++i) det[i] *= static_cast<double>(of_step[i]);
  }
}

// The same at one of them, as the blocks' points are evaluated: near rings by their points, along the way that the
// point takes.
double MatrixComposition::determinant_at(const Vec3& X) noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  Vec3 x = X;
  double det = 1;
  if (parts.smooth) {
    det = (Mat3::Identity() + parts.smooth->gradient_at(X)).determinant();
    parts.smooth->add_displacement_at(X, x);
  }
  const BlockPoints<float> here{};
  for (std::size_t k = 0; k < count_; ++k) {
    const Step& step = steps_[k];
    Block box;
    box.min = box.max = x;
    BlockDisplacement<float> u{};
    std::vector<NearSource>& sources = sources_[0];
    parts.near.add_to_points(here, x, box, step.rings, step.forces, step.pieces, sources, u, 1);
    CellGradients A{};
    parts.near.add_gradients(CellPoints{}, sources, A);
    alignas(64) float of_step[CellPoints::kCount];
    cells_[k].loops().determinants(A, static_cast<float>(step.scale), of_step);
    det *= static_cast<double>(of_step[0]);
    x += step.scale * displacement_in(u, 0);
  }
  return det;
}

void MatrixComposition::displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  std::array<Vec3, kPoints> smooth;
  for (std::size_t first = 0; first < X.size(); first += kPoints) {
    const std::size_t count = std::min(kPoints, X.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      smooth[i] = X[first + i];
      if (parts.smooth) parts.smooth->add_displacement_at(X[first + i], smooth[i]);
    }
    CentredPoints points({smooth.data(), count});
    const CentredPoints begin = points;
    carry(points, count, kPoints);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 way(points.local.x[i] - begin.local.x[i], points.local.y[i] - begin.local.y[i],
                     points.local.z[i] - begin.local.z[i]);
      u[first + i] = smooth[i] - X[first + i] + way;
    }
  }
}

Vec3 MatrixComposition::displacement_at(const Vec3& X) const noexcept {
  const MatrixKernelField::Parts parts = field_.parts();
  Vec3 x = X;
  if (parts.smooth) parts.smooth->add_displacement_at(X, x);
  for (std::size_t k = 0; k < count_; ++k)
    x += steps_[k].scale * parts.near.displacement_at(x, steps_[k].rings, steps_[k].forces);
  return x - X;
}

}  // namespace brachy
