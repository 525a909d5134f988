// Random sessions with one to four causes: each is named, nobody else is, and its cost is that of a second session
// with the same random numbers without it. BRACHY_SESSIONS: how many (scripts/nightly.sh: 300).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <random>
#include <set>

#include "apps/score/score.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/load_structures.h"
#include "test_paths.h"

namespace brachy {
namespace {

constexpr double kInnocentMm = 2;

/// Something that is planted: what it does to a seed, and how it may be told.
struct Planted {
  std::string name;
  std::set<std::string> told_as;     // Finding::cause
  std::vector<std::size_t> needles;  // empty: all
  std::function<void(std::size_t seed, Vec3& dropped)> drop =
      {};  // from where it would fall to where it falls
  std::function<Vec3(std::size_t seed, const Vec3& dropped)> move = {};  // from there to where it rests
  std::set<std::size_t> missing = {};                                    // planned seeds that do not fall
  bool is_unpunctured = false;
  double mm = 0;
};

bool holds(const std::vector<std::size_t>& all, std::size_t one) {
  return std::ranges::find(all, one) != all.end();
}

/// Whether a text names a hole: not D4 in D40, or 2D4.
bool names(const std::string& text, const std::string& hole) {
  for (std::size_t at = text.find(hole); at != std::string::npos; at = text.find(hole, at + 1)) {
    const bool begins = at == 0 || !std::isalnum(static_cast<unsigned char>(text[at - 1]));
    const std::size_t end = at + hole.size();
    if (begins && (end == text.size() || !std::isalnum(static_cast<unsigned char>(text[end])))) return true;
  }
  return false;
}

class RandomSession {
 public:
  RandomSession(std::uint32_t number, const Plan& plan, const TemplateGrid& grid)
      : random_(number), plan_(plan), grid_(grid), planned_(plan.seeds(grid)), used_(plan.needles.size(), 0) {
    const double kind = uniform(0, 3);  // no noise; each seed by itself; each needle as a whole
    across_ = kind < 1 ? 0 : 0.5;
    along_ = kind < 1 ? 0 : 0.8;
    is_by_needle_ = kind > 2;
    std::normal_distribution<double> normal(0, 1);
    for (std::size_t n = 0; n < plan.needles.size(); ++n)
      of_needle_.emplace_back(across_ * normal(random_), across_ * normal(random_), along_ * normal(random_));
    for (std::size_t i = 0; i < planned_.size(); ++i)
      of_seed_.emplace_back(across_ * normal(random_), across_ * normal(random_), along_ * normal(random_));
  }

  void plant(int count) {
    while (static_cast<int>(causes.size()) < count) {
      Planted cause = one();
      const bool is_double =
          std::ranges::any_of(causes, [&](const Planted& c) { return c.told_as == cause.told_as; });
      if (!is_double && !cause.name.empty()) causes.push_back(std::move(cause));
    }
  }

  Recording recording(std::size_t without = 99) const {
    Recording all;
    all.seeds.emplace();
    double t_s = 0;
    std::size_t last = planned_.size();
    for (std::size_t i = 0; i < planned_.size(); ++i) {
      t_s += last < planned_.size() && planned_[last].needle == planned_[i].needle ? 0.5 : 5;
      last = i;
      bool is_missing = false, is_unpunctured = false;
      Vec3 dropped = planned_[i].position;
      for (std::size_t c = 0; c < causes.size(); ++c) {
        if (c == without) continue;
        is_missing |= causes[c].missing.contains(i);
        is_unpunctured |= causes[c].is_unpunctured && holds(causes[c].needles, planned_[i].needle);
        if (causes[c].drop) causes[c].drop(i, dropped);
      }
      if (is_missing) continue;
      dropped += is_by_needle_ ? of_needle_[planned_[i].needle] : of_seed_[i];
      Vec3 rest = dropped;
      for (std::size_t c = 0; c < causes.size(); ++c)
        if (c != without && causes[c].move) rest += causes[c].move(i, dropped);
      Seed seed;
      seed.id = static_cast<std::uint32_t>(all.seeds->size() + 1);
      seed.t_s = t_s;
      seed.planned = static_cast<std::int32_t>(i);
      seed.source = planned_[i].source;
      seed.air_kerma_strength_u = planned_[i].air_kerma_strength_u;
      seed.dropped = dropped;
      seed.rest = seed.position = rest;
      all.seeds->push_back(seed);
      ForceSample force;
      force.t_s = t_s;
      force.state = is_unpunctured ? ContactState::kTouching : ContactState::kInserted;
      all.forces.emplace_back(force);
    }
    return all;
  }

  std::vector<Planted> causes;

 private:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  double sign() { return uniform(-1, 1) < 0 ? -1 : 1; }
  std::size_t index(std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_);
  }
  Vec3 sideways(double mm) {
    const double angle = uniform(0, 6.2831853);
    return mm * Vec3(std::cos(angle), std::sin(angle), 0);
  }
  /// `count` needles without a cause of their own.
  std::vector<std::size_t> some(std::size_t count) {
    std::vector<std::size_t> all;
    for (int tries = 0; tries < 500 && all.size() < count; ++tries) {
      const std::size_t n = index(plan_.needles.size());
      if (used_[n]) continue;
      used_[n] = 1;
      all.push_back(n);
    }
    std::ranges::sort(all);
    return all;
  }
  std::vector<std::size_t> seeds_of(std::size_t needle) const {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < planned_.size(); ++i)
      if (planned_[i].needle == needle) all.push_back(i);
    return all;
  }
  bool is_of_all() {  // once: a template moves one way
    if (has_of_all_) return false;
    return has_of_all_ = true;
  }

  Planted one() {
    const auto for_needles = [this](std::vector<std::size_t> needles, Vec3 off) {
      return [this, needles = std::move(needles), off](std::size_t i, Vec3& p) {
        if (holds(needles, planned_[i].needle)) p += off;
      };
    };
    switch (index(20)) {
      case 0: {
        if (!is_of_all()) return {};
        const double mm = uniform(2, 6);
        const Vec3 off = sideways(mm);
        return {.name = "template aside",
                .told_as = {"aside"},
                .needles = {},
                .drop = [off](std::size_t, Vec3& p) { p += off; },
                .mm = mm};
      }
      case 1: {
        const double mm = sign() * uniform(3, 8);
        return {.name = "template depth",
                .told_as = {"depth"},
                .needles = {},
                .drop = [mm](std::size_t, Vec3& p) { p.z() += mm; },
                .mm = std::abs(mm)};
      }
      case 2: {
        if (!is_of_all()) return {};
        const double angle = sign() * uniform(6, 15) / 57.29578;
        return {.name = "template turned",
                .told_as = {"turned"},
                .needles = {},
                .drop =
                    [angle](std::size_t, Vec3& p) {
                      p = Vec3(std::cos(angle) * p.x() - std::sin(angle) * p.y(),
                               std::sin(angle) * p.x() + std::cos(angle) * p.y(), p.z());
                    },
                .mm = 20 * std::abs(angle)};
      }
      case 3: {
        if (!is_of_all()) return {};
        return {.name = "mirrored",
                .told_as = {"mirrored"},
                .needles = {},
                .drop = [](std::size_t, Vec3& p) { p.x() = -p.x(); },
                .mm = 20};
      }
      case 4: {
        const auto needles = some(3 + index(6));
        const double mm = uniform(3, 8);
        return {.name = "group aside",
                .told_as = {"aside"},
                .needles = needles,
                .drop = for_needles(needles, sideways(mm)),
                .mm = mm};
      }
      case 5: {
        const auto needles = some(3 + index(6));
        const double mm = sign() * uniform(3, 10);
        return {.name = "group depth",
                .told_as = {"depth"},
                .needles = needles,
                .drop = for_needles(needles, {0, 0, mm}),
                .mm = std::abs(mm)};
      }
      case 6: {
        const auto needles = some(1);
        const double mm = uniform(3, 12);
        return {.name = "needle aside",
                .told_as = {"elsewhere", "aside"},
                .needles = needles,
                .drop = for_needles(needles, sideways(mm)),
                .mm = mm};
      }
      case 7: {
        const auto needles = some(1);
        const Vec3 off =
            index(2) == 0 ? Vec3(sign() * grid_.spacing_mm, 0, 0) : Vec3(0, sign() * grid_.spacing_mm, 0);
        return {.name = "wrong hole",
                .told_as = {"elsewhere", "aside"},
                .needles = needles,
                .drop = for_needles(needles, off),
                .mm = grid_.spacing_mm};
      }
      case 8: {
        const auto needles = some(2);
        if (needles.size() < 2) return {};
        const Vec3 way = plan_.planned_tip(grid_, needles[1]) - plan_.planned_tip(grid_, needles[0]);
        return {.name = "swapped",
                .told_as = {"swapped"},
                .needles = needles,
                .drop =
                    [this, needles, way](std::size_t i, Vec3& p) {
                      if (planned_[i].needle == needles[0]) p += way;
                      if (planned_[i].needle == needles[1]) p -= way;
                    },
                .mm = way.norm()};
      }
      case 9: {
        const auto needles = some(1);
        const double mm = sign() * uniform(4, 30);
        return {.name = "needle depth",
                .told_as = {"depth"},
                .needles = needles,
                .drop = for_needles(needles, {0, 0, mm}),
                .mm = std::abs(mm)};
      }
      case 10: {
        const auto needles = some(1);
        if (needles.empty()) return {};
        const auto seeds = seeds_of(needles[0]);
        const std::size_t which = seeds[index(seeds.size())];
        const double mm = sign() * uniform(6, 20);
        return {.name = "one seed",
                .told_as = {"seeds", "foremost_seeds", "last_seeds"},
                .needles = needles,
                .drop =
                    [which, mm](std::size_t i, Vec3& p) {
                      if (i == which) p.z() += mm;
                    },
                .mm = std::abs(mm)};
      }
      case 11: {
        const auto needles = some(1 + index(4));
        Planted cause{.name = "skipped", .told_as = {"missing"}, .needles = needles};
        for (const std::size_t n : needles)
          for (const std::size_t i : seeds_of(n)) cause.missing.insert(i);
        cause.mm = 10;
        return cause;
      }
      case 12: {
        const auto needles = some(1);
        if (needles.empty()) return {};
        const auto seeds = seeds_of(needles[0]);
        Planted cause{.name = "half released", .told_as = {"missing"}, .needles = needles};
        cause.missing.insert(seeds.begin() + static_cast<std::ptrdiff_t>(seeds.size() / 2), seeds.end());
        cause.mm = 10;
        return cause;
      }
      case 13: {
        const double slope = sign() * uniform(0.2, 0.4);
        return {.name = "trains stretched",
                .told_as = {"spacing"},
                .needles = {},
                .drop = [this, slope](
                            std::size_t i,
                            Vec3& p) { p.z() -= slope * (planned_[i].offset_mm - PlanNeedle::kSeedMm / 2); },
                .mm = 6};
      }
      case 14: {
        const auto needles = some(4 + index(6));
        const double mm = uniform(4, 8);
        return {.name = "pushed out",
                .told_as = {"foremost_seeds"},
                .needles = needles,
                .drop =
                    [this, needles, mm](std::size_t i, Vec3& p) {
                      if (holds(needles, planned_[i].needle) && planned_[i].offset_mm < PlanNeedle::kSeedMm)
                        p.z() += mm;
                    },
                .mm = mm};
      }
      case 15: {
        const auto needles = some(1 + index(6));
        const double mm = uniform(6, 14);
        return {.name = "never punctured",
                .told_as = {"unpunctured"},
                .needles = needles,
                .move =
                    [this, needles, mm](std::size_t i, const Vec3&) {
                      return holds(needles, planned_[i].needle) ? Vec3(0, 0, -mm) : Vec3(Vec3::Zero());
                    },
                .is_unpunctured = true,
                .mm = mm};
      }
      case 16: {
        const double mm = uniform(3, 7), reach = uniform(3, 12);
        return {.name = "gland moved",
                .told_as = {"gland_motion"},
                .needles = {},
                .move =
                    [this, mm, reach](std::size_t i, const Vec3&) {
                      return Vec3(0, 0, -mm * std::exp(-(planned_[i].offset_mm - 2.25) / reach));
                    },
                .mm = mm};
      }
      case 17: {
        const std::size_t count = plan_.needles.size(), first = index(count / 2);
        std::vector<std::size_t> needles;
        for (std::size_t n = first; n < first + count / 2; ++n) needles.push_back(n);
        const double mm = uniform(3, 7);
        return {.name = "probe",
                .told_as = {"gland_pushed"},
                .needles = needles,
                .move =
                    [this, needles, mm](std::size_t i, const Vec3&) {
                      return holds(needles, planned_[i].needle) ? Vec3(0, -mm, 0) : Vec3(Vec3::Zero());
                    },
                .mm = mm};
      }
      case 18: {
        const double share = uniform(0.05, 0.12);
        return {.name = "swelling",
                .told_as = {"swelling"},
                .needles = {},
                .move = [share](std::size_t, const Vec3& p) { return Vec3(-share * p); },
                .mm = 20 * share};
      }
      default: {
        const auto needles = some(1 + index(3));
        const double mm = uniform(4, 10);
        return {.name = "dragged",
                .told_as = {"dragged"},
                .needles = needles,
                .move =
                    [this, needles, mm](std::size_t i, const Vec3&) {
                      return holds(needles, planned_[i].needle) ? Vec3(0, 0, -mm) : Vec3(Vec3::Zero());
                    },
                .mm = mm};
      }
    }
  }

  std::mt19937 random_;
  const Plan& plan_;
  const TemplateGrid& grid_;
  std::vector<PlannedSeed> planned_;
  std::vector<char> used_;
  bool has_of_all_ = false, is_by_needle_ = false;
  double across_ = 0, along_ = 0;
  std::vector<Vec3> of_needle_, of_seed_;
};

struct Tally {
  int sessions = 0, clean = 0, clean_told = 0, planted = 0, named = 0, costs = 0, exact = 0, accusing = 0;
  std::map<std::string, std::array<int, 3>> of;  // by Planted::name: planted, named, of right cost
};

struct FindingsCampaign : ::testing::Test {
  TemplateGrid grid;
  Plan plan = load_plan(BRACHY_SOURCE_DIR "/config/plan.toml", grid);
  std::vector<Structure> structures = load_structures(Scene{});
  DoseSettings settings{.spacing_mm = 2, .margin_mm = 5, .source = {}};
  SurfaceBvh gland{structures.front().mesh};
  Tally tally;

  /// What score_session does for them.
  std::vector<Finding> findings_of(const Recording& recording) const {
    Score score;
    score.seeds = score_seeds(plan, grid, *recording.seeds);
    score.unpunctured = unpunctured_needles(*score.seeds, recording.forces);
    score.dose.prescription_gy = plan.prescription_gy;
    DoseSettings of_plan = settings;
    of_plan.prescription_gy = plan.prescription_gy;
    ImplantDose implant(structures, of_plan);
    for (const Seed& seed : *recording.seeds) implant.add(seed.at_rest());
    const NeedleCosts costs(plan, grid, implant, *recording.seeds);
    return find_mistakes(score, plan, grid, &costs, gland).all;
  }

  StructureDose prostate_of(const Recording& recording) const {
    DoseSettings of_plan = settings;
    of_plan.prescription_gy = plan.prescription_gy;
    ImplantDose dose(structures, of_plan);
    for (const Seed& seed : *recording.seeds) dose.add(seed.at_rest());
    return dose.evaluate().front();
  }

  void judge(std::uint32_t number, bool is_loud) {
    RandomSession session(number, plan, grid);
    session.plant(number % 8 == 7 ? 0 : 1 + static_cast<int>(number % 4));
    const Recording recording = session.recording();
    const std::vector<Finding> findings = findings_of(recording);
    std::string said;
    for (const Finding& f : findings) said += "\n      [" + f.cause + "] " + f.text;
    std::vector<Finding> told;
    for (const Finding& f : findings)
      if (f.cause != "goals") told.push_back(f);
    ++tally.sessions;
    if (session.causes.empty()) {
      ++tally.clean;
      tally.clean_told += !told.empty();
      if (!told.empty() && is_loud) std::cout << fmt::format("  {} clean, and:{}\n", number, said);
      return;
    }
    const StructureDose whole = prostate_of(recording);
    const auto off = worst_of(recording);
    for (std::size_t c = 0; c < session.causes.size(); ++c) {
      const Planted& cause = session.causes[c];
      const StructureDose other = prostate_of(session.recording(c));
      const double v100 = whole.v100_percent - other.v100_percent, d90 = whole.d90_gy - other.d90_gy;
      if (std::abs(v100) < 1 && cause.mm < 3) continue;
      ++tally.planted;
      auto& of = tally.of[cause.name];
      ++of[0];
      const auto found = std::ranges::find_if(
          told.begin(),
          told.begin() + static_cast<std::ptrdiff_t>(std::min(told.size(), session.causes.size() + 1)),
          [&](const Finding& f) {
            return cause.told_as.contains(f.cause) && std::ranges::all_of(cause.needles, [&](std::size_t n) {
                     return off[n] < kInnocentMm || names(f.text, plan.needles[n].hole);
                   });
          });
      if (found ==
          told.begin() + static_cast<std::ptrdiff_t>(std::min(told.size(), session.causes.size() + 1))) {
        if (is_loud)
          std::cout << fmt::format("  {} {} ({:.1f} mm, V100 {:+.1f}) is not named:{}\n", number, cause.name,
                                   cause.mm, v100, said);
        continue;
      }
      ++tally.named;
      ++of[1];
      ++tally.costs;
      const bool is_exact = found->cost && std::abs(found->cost->v100_percent - v100) <= 0.5 &&
                            std::abs(found->cost->d90_gy - d90) <= 1;
      tally.exact += is_exact;
      of[2] += is_exact;
      if (!is_exact && is_loud && found->cost)
        std::cout << fmt::format("  {} {}: V100 {:+.2f}, not {:+.2f}; D90 {:+.2f}, not {:+.2f}: {}\n", number,
                                 cause.name, found->cost->v100_percent, v100, found->cost->d90_gy, d90,
                                 found->text);
    }
    bool accuses = false;
    for (std::size_t n = 0; n < plan.needles.size(); ++n) {
      const bool is_guilty =
          off[n] > kInnocentMm ||
          std::ranges::any_of(session.causes, [&](const Planted& c) { return holds(c.needles, n); });
      if (is_guilty) continue;
      for (const Finding& f : told)
        if (names(f.text, plan.needles[n].hole)) {
          accuses = true;
          if (is_loud)
            std::cout << fmt::format("  {} {} is innocent: {}\n", number, plan.needles[n].hole, f.text);
        }
    }
    tally.accusing += accuses;
  }

  /// Of each needle, how far its worst seed is off, as it fell or at rest; 0: none fell.
  std::vector<double> worst_of(const Recording& recording) const {
    const std::vector<PlannedSeed> planned = plan.seeds(grid);
    std::vector<double> worst(plan.needles.size(), 0);
    for (const Seed& seed : *recording.seeds) {
      const PlannedSeed& at = planned[static_cast<std::size_t>(seed.planned)];
      worst[at.needle] =
          std::max({worst[at.needle], (seed.dropped - at.position).norm(), (seed.rest - at.position).norm()});
    }
    return worst;
  }
};

TEST_F(FindingsCampaign, NamesWhatWasPlantedAndNobodyElse) {
  const char* asked = std::getenv("BRACHY_SESSIONS");
  const char* first = std::getenv("BRACHY_SESSIONS_FROM");
  const int count = asked ? std::atoi(asked) : 16, from = first ? std::atoi(first) : 1;
  for (int k = from; k < from + count; ++k) judge(static_cast<std::uint32_t>(k), true);
  std::cout << fmt::format("{:<20}{:>8}{:>8}{:>12}\n", "cause", "planted", "named", "right cost");
  for (const auto& [name, of] : tally.of)
    std::cout << fmt::format("{:<20}{:>8}{:>8}{:>12}\n", name, of[0], of[1], of[2]);
  std::cout << fmt::format(
      "{} sessions; {} of {} causes named; {} name an innocent needle; {} of {} clean ones have findings; {} "
      "of {} costs "
      "within 0.5 points and 1 Gy\n",
      tally.sessions, tally.named, tally.planted, tally.accusing, tally.clean_told, tally.clean, tally.exact,
      tally.costs);
  EXPECT_GE(tally.named, 0.95 * tally.planted);
  EXPECT_LE(tally.accusing, 0.02 * tally.sessions);
  EXPECT_EQ(tally.clean_told, 0);
  EXPECT_GE(tally.exact, 0.9 * tally.costs);
}

}  // namespace
}  // namespace brachy
