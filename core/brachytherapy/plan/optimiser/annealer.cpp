#include "core/brachytherapy/plan/optimiser/annealer.h"

#include <cmath>

#include "core/brachytherapy/plan/optimiser/load_moves.h"

namespace brachy {
namespace {

constexpr std::size_t kFreshAfter = 500;  // kept changes: then the sums of floats are made from scratch
constexpr std::size_t kReports = 100;

}  // namespace

Annealed anneal(const std::vector<NeedleChoice>& choices, std::vector<NeedleLoad> start, PlanDose& dose,
                const AnnealingSettings& settings, const std::function<void(double share)>& progress) {
  LoadMoves moves(choices, std::move(start), settings.most_needles, settings.most_seeds,
                  settings.most_seeds_a_needle, settings.seed);
  const auto count_cost = [&](double needles, double seeds) {
    return settings.per_needle * needles + settings.per_seed * seeds;
  };
  double now = dose.reset(moves.loads()) +
               count_cost(static_cast<double>(moves.needles()), static_cast<double>(moves.seeds()));
  Annealed best{moves.loads(), now};

  double temperature = settings.first_temperature;
  const double cooling = std::pow(settings.last_temperature / settings.first_temperature,
                                  1 / static_cast<double>(settings.proposals));
  std::size_t kept = 0;
  for (std::size_t p = 0; p < settings.proposals; ++p) {
    if (progress && p % (settings.proposals / kReports + 1) == 0)
      progress(static_cast<double>(p) / static_cast<double>(settings.proposals));
    temperature *= cooling;
    const std::vector<LoadChange>* changes = moves.propose();
    if (!changes) continue;
    double needles = static_cast<double>(moves.needles()), seeds = static_cast<double>(moves.seeds());
    for (const LoadChange& c : *changes) {
      needles += static_cast<double>(c.after.is_used()) - static_cast<double>(c.before.is_used());
      seeds += c.after.seed_count() - c.before.seed_count();
    }
    const double then = dose.with(*changes) + count_cost(needles, seeds);
    if (then > now && !(moves.random().share() < std::exp((now - then) / temperature))) continue;
    dose.keep();
    moves.keep();
    now = then;
    if (++kept % kFreshAfter == 0) now = dose.reset(moves.loads()) + count_cost(needles, seeds);
    if (now < best.objective) best = {moves.loads(), now};
  }
  return best;
}

}  // namespace brachy
