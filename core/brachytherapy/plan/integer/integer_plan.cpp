#include "core/brachytherapy/plan/integer/integer_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <limits>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/plan/optimiser/dose_rows.h"

namespace brachy {
namespace {

constexpr int kPitchRows = 20;         // 10 mm: a seed and a spacer
constexpr int kTipShortMm = 1;         // the tip stops this far short of the gland's end
constexpr double kNegligible = 0.002;  // of the prescription: no coefficient
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
const PlanPointCounts kPoints{240, 40, 40, 24};

std::string number_of(double value) {
  return exact_text(std::round(1e6 * value) / 1e6);
}

void append_term(std::string& text, double factor, const std::string& name) {
  text.append(factor < 0 ? " - " : " + ").append(number_of(std::abs(factor))).append(1, ' ').append(name);
  if (text.size() - std::min(text.rfind('\n'), text.size()) > 200) text += "\n";
}

std::string name_of(char letter, std::size_t number) {
  std::string name(1, letter);
  name += std::to_string(number);
  return name;
}
void append(std::string& text, std::initializer_list<std::string_view> parts) {
  for (const std::string_view part : parts) text += part;
}

std::string x_name(std::size_t slot) {
  return name_of('x', slot);
}
std::string y_name(std::size_t choice) {
  return name_of('y', choice);
}

/// The spacers whose lengths come nearest to a gap of `rows` between two seeds' centres.
int spacers_for(int rows) {
  return std::max(0,
                  static_cast<int>(std::lround((0.5 * rows - PlanNeedle::kSeedMm) / PlanNeedle::kSpacerMm)));
}

}  // namespace

IntegerProgramme::IntegerProgramme(const std::vector<Structure>& structures, const TemplateGrid& grid,
                                   const PlanSettings& settings, const OptimiserSettings& how)
    : choices_(find_needle_choices(structures, grid, how.clearances, settings.needle_length_mm)),
      per_needle_(how.objective.per_needle),
      per_seed_(how.objective.per_seed) {
  plan_.name = settings.name;
  plan_.source = settings.source;
  plan_.prescription_gy = settings.prescription_gy;
  plan_.air_kerma_strength_u = how.strength_u;
  const PlanPoints points = plan_points(structures, kPoints);
  const DoseRows rows(choices_, points, settings.source, how.strength_u, settings.prescription_gy);
  most_needles_ = most_needles_for(points.parts.front().volume_cc, how);
  most_seeds_ = most_seeds_for(points.parts.front().volume_cc, how);
  std::vector<std::size_t> live;
  for (const PlanPoints::Part& part : points.parts) {
    const double share = 1 / static_cast<double>(part.count);
    const bool is_gland = &part == points.parts.data();
    const Watched watched = is_gland                      ? Watched{1.05, 1.5, 20 * share, 0.4 * share}
                            : part.structure == "urethra" ? Watched{kNone, 1.15, 0, 2 * share}
                                                          : Watched{kNone, 0.95, 0, 5 * share};
    for (std::size_t i = 0; i < part.count; ++i) {
      live.push_back(part.first + i);
      watched_.push_back(watched);
    }
  }
  for (std::size_t c = 0; c < choices_.size(); ++c) {
    const NeedleChoice& choice = choices_[c];
    tips_.push_back(choice.most_tip_mm - kTipShortMm);
    for (int row = 2 * tips_[c]; row >= choice.first_row; row -= kPitchRows) {
      Slot slot{c, row, {}};
      for (const std::size_t i : live) slot.dose.push_back(rows.row(c, row)[i]);
      slots_.push_back(std::move(slot));
    }
  }
}

std::size_t IntegerProgramme::binaries() const {
  return slots_.size() + choices_.size();
}

std::string IntegerProgramme::text() const {
  std::string text = "Minimize\n cost:";
  for (std::size_t p = 0; p < watched_.size(); ++p) {
    if (watched_[p].below > 0) append_term(text, watched_[p].below, name_of('u', p));
    append_term(text, watched_[p].above, name_of('o', p));
  }
  for (std::size_t c = 0; c < choices_.size(); ++c) append_term(text, per_needle_, y_name(c));
  for (std::size_t s = 0; s < slots_.size(); ++s) append_term(text, per_seed_, x_name(s));
  text += "\nSubject To\n";
  for (std::size_t p = 0; p < watched_.size(); ++p) {
    const Watched& watched = watched_[p];
    const std::string n = std::to_string(p), most = number_of(watched.most);
    append(text, {" d", n, ":"});
    for (std::size_t s = 0; s < slots_.size(); ++s)
      if (static_cast<double>(slots_[s].dose[p]) > kNegligible)
        append_term(text, static_cast<double>(slots_[s].dose[p]), x_name(s));
    append(text, {" - D", n, " = 0\n"});
    if (watched.below > 0)
      append(text, {" l", n, ": D", n, " + u", n, " >= ", number_of(watched.least), "\n"});
    append(text, {" m", n, ": D", n, " - o", n, " <= ", most, "\n"});
  }
  for (std::size_t s = 0; s < slots_.size(); ++s)
    append(text, {" i", std::to_string(s), ": ", x_name(s), " - ", y_name(slots_[s].choice), " <= 0\n"});
  text += " needles:";
  for (std::size_t c = 0; c < choices_.size(); ++c) append_term(text, 1, y_name(c));
  append(text, {" <= ", std::to_string(most_needles_), "\n seeds:"});
  for (std::size_t s = 0; s < slots_.size(); ++s) append_term(text, 1, x_name(s));
  append(text, {" <= ", std::to_string(most_seeds_), "\nBinary\n"});
  for (std::size_t c = 0; c < choices_.size(); ++c) append(text, {" ", y_name(c), "\n"});
  for (std::size_t s = 0; s < slots_.size(); ++s) append(text, {" ", x_name(s), "\n"});
  return text + "End\n";
}

Plan IntegerProgramme::plan_of(std::string_view solution) const {
  std::vector<std::vector<int>> rows(choices_.size());  // of each choice, from the tip backwards
  while (!solution.empty()) {
    const std::size_t end = std::min(solution.find('\n'), solution.size());
    const std::string line(solution.substr(0, end));
    solution.remove_prefix(std::min(end + 1, solution.size()));
    char name[32];
    double value = 0;
    unsigned long slot = 0;
    if (std::sscanf(line.c_str(), " %*[*] %*d %31s %lf", name, &value) != 2 &&
        std::sscanf(line.c_str(), " %*d %31s %lf", name, &value) != 2)
      continue;
    if (value > 0.5 && std::sscanf(name, "x%lu", &slot) == 1 && slot < slots_.size())
      rows[slots_[slot].choice].push_back(slots_[slot].row);
  }
  Plan plan = plan_;
  std::vector<std::pair<std::size_t, NeedleLoad>> needles;
  for (std::size_t c = 0; c < choices_.size(); ++c) {
    std::ranges::sort(rows[c], std::greater());
    if (rows[c].empty()) continue;
    std::string train = "s";
    for (std::size_t s = 1; s < rows[c].size(); ++s) {
      for (int n = spacers_for(rows[c][s - 1] - rows[c][s]); n > 0; --n) train += '-';
      train += 's';
    }
    NeedleLoad load = NeedleLoad::from(rows[c].front() / 2, train);
    // Longer gaps than planned: forwards, so that the last seed stays in the gland.
    while (!choices_[c].holds(load) && load.tip_mm < choices_[c].most_tip_mm) ++load.tip_mm;
    if (choices_[c].holds(load)) needles.emplace_back(c, load);
  }
  if (needles.empty())
    throw UserError("the integer programme's solution has no seed; was the solver stopped early?");
  std::ranges::stable_sort(needles, [&](const auto& a, const auto& b) {
    const Vec3 &p = choices_[a.first].position, &q = choices_[b.first].position;
    return p.y() != q.y() ? p.y() > q.y() : p.x() < q.x();
  });
  for (const auto& [c, load] : needles)
    plan.base_plane_mm = std::max<double>(plan.base_plane_mm, load.tip_mm);
  for (const auto& [c, load] : needles)
    plan.needles.push_back({choices_[c].hole, plan.base_plane_mm - load.tip_mm, load.train()});
  return plan;
}

Plan integer_plan(const std::vector<Structure>& structures, const TemplateGrid& grid,
                  const PlanSettings& settings, const OptimiserSettings& how,
                  const std::function<std::string(const std::string&)>& solve) {
  const IntegerProgramme programme(structures, grid, settings, how);
  return programme.plan_of(solve(programme.text()));
}

}  // namespace brachy
