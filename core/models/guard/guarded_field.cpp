#include "core/models/guard/guarded_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "core/models/landmark_state.h"
#include "core/models/step_flag.h"

namespace brachy {
namespace {

// Shares of the way to the nearest fold_candidate fold that one field may go: as a sub-step, which leaves a margin
// for a bound that is found quickly, and where landmarks are held.
constexpr double kSubstepReach = 0.6, kClampReach = 0.9;
constexpr double kShorter = 0.6;  // of a step that could not be certified
constexpr double kMissed = 0.01;  // mm: landmarks that are off by less are not called clamped
constexpr double kMargin = 0.8;   // share of the way to a fold that the margin asks for

}  // namespace

GuardedField::GuardedField(const Tissue& tissue, std::unique_ptr<TissueField> field,
                           std::unique_ptr<Composition> composition, const GuardSettings& settings,
                           const WorkBudget& budget)
    : tissue_(tissue),
      field_(std::move(field)),
      composition_(std::move(composition)),
      settings_(settings),
      budget_(budget),
      search_(field_->max_sources()),
      sources_{std::vector<std::uint32_t>(field_->max_sources()),
               std::vector<std::uint32_t>(field_->max_sources())} {
  // One more for what begins the composition.
  const std::size_t most_parts =
      composition_ && composition_->kept_fields() > 0 ? composition_->kept_fields() + 1 : 1;
  parts_.searches.reserve(most_parts);
  for (std::size_t k = 0; k < most_parts; ++k) parts_.searches.emplace_back(field_->max_sources());
  block_bounds_.reserve(tissue.blocks.size());
  std::iota(sources_.all.begin(), sources_.all.end(), 0u);
}

FactorStatus GuardedField::update(const LandmarkSet& landmarks) noexcept {
  assert(landmarks.revision().displacements != 0);
  evaluation_ = Evaluation::kIdle;
  if (shows(landmarks)) {
    parts_.spent_pairs = 0;
    if (is_composed_ && composition_->is_unfinished())
      evaluate_composition();
    else if (is_composed_)
      go_on_certifying();
    return field_->factorize(landmarks);
  }
  shown_ = {};
  for (std::size_t i = 0; i < landmarks.displacements.size(); ++i)
    if (!landmarks.displacements[i].allFinite()) return {FactorStatus::kNotFinite, static_cast<int>(i)};
  if (const FactorStatus status = field_->update(landmarks); !status) return status;
  shown_ = landmarks.revision();
  // The field may have been rescaled or composed since it was last evaluated: so it is new in any case.
  evaluation_ = field_->evaluation() == Evaluation::kIdle ? Evaluation::kDirect : field_->evaluation();
  is_composed_ = false;
  flags_ = 0;
  certificate_ = {};
  parts_.count = parts_.steps = parts_.blocks = 0;
  if (landmarks.positions.empty()) {
    if (composition_) composition_->end();
    return {};
  }
  guard();
  return {};
}

Certificate GuardedField::certificate() const {
  Certificate shown = certificate_;
  if (shown.verdict == Verdict::kFolded) return shown;
  if (shown.vertex_det <= 0) {
    shown.verdict = Verdict::kFolded;
    shown.place = least_vertex_;
  } else if (is_composed_ && composition_->is_late()) {
    shown.verdict = Verdict::kUnknown;
  }
  if (shown.verdict != Verdict::kInjective) shown.det_bound = Certificate::kNotKnown;
  return shown;
}

std::uint32_t GuardedField::flags() const {
  switch (certificate().verdict) {
    case Verdict::kFolded:
      return (flags_ & ~kStepUncertified) | kStepFolded;
    case Verdict::kUnknown:
      return flags_ | kStepUncertified;
    default:
      return flags_;
  }
}

Vec3 GuardedField::displacement_at(const Vec3& X) const noexcept {
  return is_composed_ ? composition_->displacement_at(X) : field_->displacement_at(X);
}

void GuardedField::displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept {
  is_composed_ ? composition_->displacements_at(X, u) : field_->displacements_at(X, u);
}

void GuardedField::guard() noexcept {
  parts_.spent_pairs = 0;
  if (always_composes()) return compose();
  const CellField& cells = field_->cells();
  FoldCandidate fold_candidate = search_.find_fold_candidate(cells);
  certificate_.substeps = 1;
  if (is_flagged_only() || fold_candidate.scale * (may_compose() ? kSubstepReach : kClampReach) >= 1) {
    const InjectivitySearch::Result result =
        search(search_, cells, 1, fold_candidate, allowance(cells).certificate_pairs);
    if (is_flagged_only() || result.verdict != Verdict::kFolded) {
      add_to_certificate(result);
      find_margin(cells, 1, fold_candidate);
      find_least_vertex(cells);
      return;
    }
    fold_candidate = {1, result.place};
  }
  if (may_compose())
    compose();
  else
    clamp(cells, fold_candidate);
}

// Adds one more field's result to the tick's certificate.
void GuardedField::add_to_certificate(const InjectivitySearch::Result& result) noexcept {
  certificate_.place = result.place;
  if (result.verdict == Verdict::kInjective) {
    certificate_.det_bound *= result.det_bound;
    return;
  }
  certificate_.verdict = result.verdict;
  certificate_.det_bound = Certificate::kNotKnown;
  flags_ |= result.verdict == Verdict::kFolded ? kStepFolded : kStepUncertified;
}

// If the rest of the way is gone in steps of `scale`.
void GuardedField::expect_steps(double scale) noexcept {
  if (parts_.steps > 0 && composition_->reached() < 1)
    parts_.steps = composition_->steps() + static_cast<std::size_t>(std::ceil(composition_->rest() / scale));
}

// Of what is composed, with the blocks that are evaluated after it.
Allowance GuardedField::allowance(const CellField& cells) const noexcept {
  TickWork work = parts_.steps > 0 ? composition_->work_ahead(parts_.steps) : TickWork();
  work.sources = cells.sources();
  work.reaches_everywhere = cells.reaches_everywhere();
  work.is_undecided = certificate_.verdict == Verdict::kUnknown;
  work.certificate_pairs = parts_.spent_pairs;
  return budget_.allowance(work);
}

// The last cell that a search looks at may take it past its pairs.
const InjectivitySearch::Result& GuardedField::search(InjectivitySearch& search, const CellField& cells,
                                                      double scale, const FoldCandidate& fold_candidate,
                                                      std::uint64_t pairs) noexcept {
  const InjectivitySearch::Result& result = search.run(cells, scale, fold_candidate, pairs);
  parts_.spent_pairs += result.work;
  return result;
}

// The longest of some steps towards `scale` that is certified; if none is, the shortest. Once a tick's work is
// spent, steps only stay below their candidate folds, and are flagged as uncertified.
const InjectivitySearch::Result& GuardedField::find_step(InjectivitySearch& of_step, const CellField& cells,
                                                         const FoldCandidate& fold_candidate,
                                                         double& scale) noexcept {
  expect_steps(scale);
  Allowance may = allowance(cells);
  search(of_step, cells, scale, fold_candidate, may.certificate_pairs);
  for (std::size_t tried = 1; of_step.result().verdict != Verdict::kInjective; ++tried) {
    expect_steps(kShorter * scale);
    may = allowance(cells);
    const bool is_hopeless = of_step.result().verdict == Verdict::kUnknown && !may.may_certify;
    if (tried >= may.step_tries || is_hopeless || may.certificate_pairs == 0) break;
    scale *= kShorter;
    search(of_step, cells, scale, fold_candidate, may.certificate_pairs);
  }
  return of_step.result();
}

void GuardedField::clamp(const CellField& cells, const FoldCandidate& fold_candidate) noexcept {
  double scale = std::min(1.0, kClampReach * fold_candidate.scale);
  add_to_certificate(find_step(search_, cells, fold_candidate, scale));
  find_least_vertex(cells, scale);
  certificate_.margin_mm = 0;
  certificate_.held_mm = (1 - scale) * largest_displacement();
  certificate_.held_n = (1 - scale) * field_->total_force_n();
  flags_ |= kStepClamped;
  field_->rescale(scale);
}

void GuardedField::compose() noexcept {
  parts_.begun = composition_->begin(field_->landmark_positions(), field_->landmark_displacements());
  parts_.steps = 1;
  parts_.blocks = composition_->wanted_blocks();
  const auto next_part = [&]() -> InjectivitySearch& {
    return parts_.searches[std::min(parts_.count, parts_.searches.size() - 1)];
  };
  const std::size_t most_steps =
      std::min(static_cast<std::size_t>(settings_.max_substeps), composition_->most_steps());
  FoldCandidate fold_candidate;
  while (composition_->next()) {
    const CellField& cells = composition_->cells();
    if (!composition_->is_like_last()) fold_candidate = search_.find_fold_candidate(cells);
    const double rest = composition_->rest();
    // A step more begins with nothing, so nothing jumps. The last steps may go farther than the others before landmarks
    // are clamped.
    const double left = static_cast<double>(most_steps - std::min(most_steps - 1, composition_->steps()));
    double scale = std::min({rest, kSubstepReach * fold_candidate.scale,
                             std::max(composition_->reach() * fold_candidate.scale, rest / left)});
    const InjectivitySearch::Result& result = find_step(next_part(), cells, fold_candidate, scale);
    if (result.verdict == Verdict::kFolded) break;
    add_to_certificate(result);
    ++parts_.count;
    if (scale == rest) find_margin(cells, scale, fold_candidate);
    composition_->accept(scale,
                         fold_candidate.scale < FoldCandidate::kMaxScale ? &fold_candidate.place : nullptr);
  }
  if (const CellField* cells = composition_->cells_of_beginning(); cells && !(parts_.begun > 0)) {
    add_to_certificate(search(next_part(), *cells, 1, {}, allowance(*cells).certificate_pairs));
    ++parts_.count;
    parts_.begun = 1;
  } else if (certificate_.verdict == Verdict::kInjective) {
    certificate_.det_bound *= parts_.begun;
  }
  certificate_.substeps = static_cast<std::uint32_t>(composition_->steps());
  evaluate_composition();
  if (certificate_.substeps > 1) flags_ |= kStepSubstepped;
  const double missed = composition_->missed_mm();
  const double held =
      std::max((1 - composition_->reached()) * largest_displacement(), missed > kMissed ? missed : 0);
  if (held > 0) {
    flags_ |= kStepClamped;
    certificate_.margin_mm = 0;
    certificate_.held_mm = held;
  }
}

// The landmarks rest, so what was left undecided may be decided now, where the parts' fields are kept.
void GuardedField::go_on_certifying() noexcept {
  if (certificate_.verdict != Verdict::kUnknown || parts_.count > parts_.searches.size() ||
      composition_->kept_fields() == 0)
    return;
  const std::uint64_t pairs =
      budget_.allowance({.landmarks = field_->landmark_positions().size()}).resting_pairs;
  certificate_.verdict = Verdict::kInjective;
  certificate_.det_bound = parts_.begun;
  flags_ &= ~kStepUncertified;
  for (std::size_t k = 0; k < parts_.count; ++k) {
    InjectivitySearch& part = parts_.searches[k];
    if (part.is_open() && parts_.spent_pairs < pairs) {
      const std::uint64_t before = part.result().work;
      parts_.spent_pairs += part.go_on(pairs - parts_.spent_pairs).work - before;
    }
    add_to_certificate(part.result());
    if (certificate_.verdict == Verdict::kFolded) return;
  }
  certificate_.place = least_vertex_;
}

void GuardedField::evaluate_composition() noexcept {
  composition_->evaluate(parts_.spent_pairs);
  is_composed_ = true;
  evaluation_ = Evaluation::kDirect;
  flags_ = composition_->is_late() ? flags_ | kStepLate : flags_ & ~kStepLate;
  certificate_.vertex_det = composition_->least_determinant();
  certificate_.place = least_vertex_ = composition_->least_place();
}

void GuardedField::find_margin(const CellField& cells, double scale,
                               const FoldCandidate& fold_candidate) noexcept {
  certificate_.margin_mm = 0;
  if (certificate_.verdict != Verdict::kInjective || fold_candidate.scale <= scale) return;
  const double further = kMargin * (fold_candidate.scale - scale);
  const std::uint64_t pairs = allowance(cells).margin_pairs;
  if (search(search_, cells, scale + further, fold_candidate, pairs).verdict == Verdict::kInjective)
    certificate_.margin_mm = further * largest_displacement();
}

// Block after block, those first whose bound is least, until no other can be below what was found.
void GuardedField::find_least_vertex(const CellField& cells, double scale) noexcept {
  const auto cell_of = [&](std::uint32_t b) {
    const Block& block = tissue_.blocks[b];
    return Cell::around(block.min, block.max);
  };
  const std::span<const std::uint32_t> all(sources_.all.data(), cells.sources());
  block_bounds_.clear();
  CellBounds bounds;
  for (const std::uint32_t b : field_->touched())
    if (cells.narrow(cell_of(b), all, sources_.near.data(), bounds) > 0)
      block_bounds_.push_back({InjectivitySearch::bound_by_norms(bounds, scale), b});
  std::ranges::sort(block_bounds_);
  for (const auto& [bound, b] : block_bounds_) {
    if (bound >= certificate_.vertex_det) return;
    const Block& block = tissue_.blocks[b];
    const Cell cell = cell_of(b);
    const std::size_t count = cells.narrow(cell, all, sources_.near.data(), bounds);
    bounds.cusp = -1;
    for (std::size_t first = 0; first < block.count; first += CellPoints::kCount) {
      const std::size_t points = std::min(CellPoints::kCount, block.count - first);
      const Vec3* rest = &tissue_.rest_vertices[block.first + first];
      CellPoints X{};
      for (std::size_t i = 0; i < points; ++i) X.set(i, rest[i] - cell.centre);
      CellGradients A;
      cells.gradients(cell, {sources_.near.data(), count}, bounds, X, A);
      alignas(64) float det[CellPoints::kCount];
      cells.loops().determinants(A, static_cast<float>(scale), det);
      for (std::size_t i = 0; i < points; ++i) {
        if (static_cast<double>(det[i]) >= certificate_.vertex_det || !cells.covers(rest[i])) continue;
        certificate_.vertex_det = static_cast<double>(det[i]);
        least_vertex_ = rest[i];
      }
    }
  }
}

void GuardedField::save(StateWriter& writer, const LandmarkSet::Revision& landmarks) const {
  const bool is_of_these = shown_ == landmarks;
  writer(parts_.blocks, is_of_these);
  if (is_of_these) field_->save(writer);
  if (composition_) composition_->save(writer);
  for (std::size_t k = 0; k < parts_.searches.size(); ++k)
    writer(k < parts_.count && is_of_these ? parts_.searches[k].result().work : 0);
  writer(evaluation_, certificate_, least_vertex_, flags_);
}

// The field is that of its landmarks alone, but for what blocks show that are late, and work that is spread over ticks.
// Where the field of the settled landmarks is still due, the next update makes it.
void GuardedField::restore(StateReader& reader, const LandmarkSet& landmarks) {
  bool is_of_these = false;
  reader(parts_.blocks, is_of_these);
  if (composition_) composition_->expect_blocks(parts_.blocks);
  if (landmarks.revision().displacements != 0 && !update(landmarks))
    throw UserError("the saved state is another scene's");
  if (is_of_these) field_->restore(reader);
  if (composition_) composition_->restore(reader);
  for (InjectivitySearch& part : parts_.searches) {
    std::uint64_t work = 0;
    reader(work);
    if (part.is_open() && part.result().work < work) part.go_on(work - part.result().work);
  }
  reader(evaluation_, certificate_, least_vertex_, flags_);
  shown_ = is_of_these ? landmarks.revision() : LandmarkSet::Revision();
}

double GuardedField::largest_displacement() const noexcept {
  double largest = 0;
  for (const Vec3& d : field_->landmark_displacements()) largest = std::max(largest, d.norm());
  return largest;
}

}  // namespace brachy
