#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/score/report.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;  // NaN becomes null

OrderedJson to_json_point(const Vec3& p) {
  return {p.x(), p.y(), p.z()};
}

OrderedJson to_json_spread(const Spread& s) {
  return {{"count", s.count}, {"mean", s.mean}, {"sd", s.sd}, {"max", s.max}};
}

OrderedJson to_json_errors(const MisplacementSpread& s) {
  return {{"total_mm", to_json_spread(s.total_mm)},
          {"axial_mm", to_json_spread(s.axial_mm)},
          {"lateral_mm", to_json_spread(s.lateral_mm)},
          {"mean_signed_axial_mm", s.mean_signed_axial_mm},
          {"axial_share", s.axial_share}};
}

OrderedJson to_json_error(const Misplacement& m) {
  return {{"total_mm", m.total_mm}, {"axial_mm", m.axial_mm}, {"lateral_mm", m.lateral_mm}};
}

OrderedJson to_json_seed(const Seed& s) {
  return {{"seed", s.id},
          {"t_s", s.t_s},
          {"needle", s.needle},
          {"certified", s.is_certified},
          {"dropped_mm", to_json_point(s.dropped)},
          {"rest_mm", to_json_point(s.rest)},
          {"gland_motion_mm", s.gland_motion.norm()}};
}

OrderedJson to_json_pair(const SeedScore& s) {
  return {{"planned", s.planned_index},
          {"hole", s.hole},
          {"offset_mm", s.planned.offset_mm},
          {"planned_mm", to_json_point(s.planned.position)},
          {"dropped_error", to_json_error(s.dropped)},
          {"rest_error", to_json_error(s.rest)}};
}

OrderedJson to_json_assignment(const SeedAssignment& assignment) {
  OrderedJson each = OrderedJson::array(), extra = OrderedJson::array();
  for (const SeedScore& s : assignment.placed) {
    each.push_back({{"seed", s.seed.id}});
    each.back().update(to_json_pair(s));
  }
  for (const Seed& s : assignment.extra) extra.push_back(s.id);
  return {{"farthest_mm", SeedAssignment::kFarthestMm},
          {"placed", assignment.placed.size()},
          {"dropped_error", to_json_errors(assignment.dropped)},
          {"rest_error", to_json_errors(assignment.rest)},
          {"missing", assignment.missing},
          {"extra", extra},
          {"each", each}};
}

OrderedJson to_json_seeds(const SeedsScore& score) {
  OrderedJson each = OrderedJson::array(), unplanned = OrderedJson::array();
  for (const SeedScore& s : score.planned) {
    each.push_back(to_json_pair(s));
    each.back().update(to_json_seed(s.seed));
  }
  for (const Seed& s : score.unplanned) unplanned.push_back(to_json_seed(s));
  return {{"dropped", score.planned.size() + score.unplanned.size()},
          {"dropped_error", to_json_errors(score.dropped)},
          {"rest_error", to_json_errors(score.rest)},
          {"gland_motion_mm", to_json_spread(score.gland_motion_mm)},
          {"missing", score.missing},
          {"unplanned", unplanned},
          {"each", each},
          {"headline", headline(score)},
          {"by_position", to_json_assignment(score.by_position)}};
}

OrderedJson to_json_contacts(const std::vector<StructureContact>& contacts) {
  OrderedJson all = OrderedJson::array();
  for (const StructureContact& contact : contacts)
    all.push_back({{"structure", contact.structure},
                   {"hole", contact.hole.empty() ? OrderedJson(nullptr) : OrderedJson(contact.hole)},
                   {"passes", contact.passes},
                   {"depth_mm", contact.depth_mm},
                   {"time_s", contact.time_s}});
  return all;
}

OrderedJson to_json_failed_drops(const std::vector<FailedDrop>& drops) {
  OrderedJson all = OrderedJson::array();
  for (const FailedDrop& drop : drops)
    all.push_back({{"t_s", drop.t_s},
                   {"needle", drop.needle},
                   {"planned", drop.planned < 0 ? OrderedJson(nullptr) : OrderedJson(drop.planned)},
                   {"lost", drop.why == DropRefusal::kLost},
                   {"why", to_string(drop.why)},
                   {"at_mm", to_json_point(drop.at)}});
  return all;
}

OrderedJson to_json_change(const DoseChange& change) {
  return {{"v100_percent", change.v100_percent},
          {"d90_gy", change.d90_gy},
          {"urethra_d30_gy", change.urethra_d30_gy},
          {"rectum_d2cc_gy", change.rectum_d2cc_gy}};
}

OrderedJson to_json_findings(const std::vector<Finding>& findings) {
  OrderedJson all = OrderedJson::array();
  for (const Finding& finding : findings)
    all.push_back({{"text", finding.text},
                   {"cause", finding.cause},
                   {"needles", finding.needles},
                   {"seeds", finding.seeds},
                   {"at_s", finding.at_s ? OrderedJson(*finding.at_s) : OrderedJson(nullptr)},
                   {"cost", finding.cost ? to_json_change(*finding.cost) : OrderedJson(nullptr)},
                   {"weight", finding.weight},
                   {"harm_percent", finding.harm_percent},
                   {"is_of_organ", finding.is_of_organ}});
  return all;
}

OrderedJson to_json_unexplained(const std::optional<Unexplained>& left) {
  if (!left) return nullptr;
  OrderedJson json = to_json_change(left->change);
  json["mean_mm"] = left->mean_mm;
  json["largest_mm"] = left->largest_mm;
  return json;
}

OrderedJson to_json_consequences(const Consequences& c) {
  OrderedJson needles = OrderedJson::array(), sectors = OrderedJson::array();
  for (const NeedleCost& n : c.needles) {
    needles.push_back({{"needle", n.needle}});
    needles.back().update(to_json_change(n.change));
  }
  for (const Sector& s : c.sectors)
    sectors.push_back({{"name", s.name},
                       {"volume_cc", s.volume_cc},
                       {"cold_cc", s.cold_cc},
                       {"coldest_gy", s.coldest_gy},
                       {"coldest_mm", to_json_point(s.coldest)}});
  OrderedJson json = {{"whole", to_json_change(c.whole)},
                      {"needles", needles},
                      {"unplanned", to_json_change(c.unplanned)},
                      {"sectors", sectors},
                      {"urethra_hottest", nullptr}};
  if (c.urethra)
    json["urethra_hottest"] = {{"gy", c.urethra->gy},
                               {"at_mm", to_json_point(c.urethra->at)},
                               {"over_150_cc", c.urethra->over_150_cc}};
  return json;
}

OrderedJson to_json_verdict(const std::vector<GoalResult>& results) {
  OrderedJson each = OrderedJson::array();
  for (const GoalResult& r : results)
    each.push_back({{"stage", r.goal.stage},
                    {"structure", r.goal.structure},
                    {"figure", r.goal.figure},
                    {r.goal.is_above() ? "at_least" : "below", r.limit},
                    {"is", r.value},
                    {"met", r.is_met ? OrderedJson(*r.is_met) : OrderedJson(nullptr)},
                    {"source", r.goal.source}});
  return {{"text", verdict(results)}, {"goals", each}};
}

template <class T>
OrderedJson or_null(const std::optional<T>& value) {
  return value ? OrderedJson(*value) : OrderedJson(nullptr);
}

OrderedJson to_json_needles(const NeedlesScore& score) {
  OrderedJson each = OrderedJson::array();
  for (const NeedleScore& n : score.needles)
    each.push_back({{"hole", n.hole.empty() ? OrderedJson(nullptr) : OrderedJson(n.hole)},
                    {"planned", or_null(n.planned)},
                    {"path_in_tissue_mm", n.path_in_tissue_mm},
                    {"time_in_tissue_s", n.time_in_tissue_s},
                    {"passes", or_null(n.passes)},
                    {"insertions", or_null(n.insertions)},
                    {"punctures", or_null(n.punctures)},
                    {"largest_force_n", n.largest_force_n}});
  const NeedleMetrics* m = score.motion ? &*score.motion : nullptr;
  const auto of = [&](double NeedleMetrics::*value) { return m ? m->*value : kNoNumber; };
  const OrderedJson total = {{"elapsed_time_s", of(&NeedleMetrics::elapsed_time_s)},
                             {"path_length_mm", of(&NeedleMetrics::path_length_mm)},
                             {"path_in_tissue_mm", of(&NeedleMetrics::path_in_tissue_mm)},
                             {"time_in_tissue_s", of(&NeedleMetrics::time_in_tissue_s)},
                             {"passes", m ? OrderedJson(m->passes) : OrderedJson(nullptr)},
                             {"punctures", or_null(score.punctures)},
                             {"largest_force_n", score.largest_force_n},
                             {"speed_p50_mm_s", of(&NeedleMetrics::speed_p50_mm_s)},
                             {"speed_p95_mm_s", of(&NeedleMetrics::speed_p95_mm_s)},
                             {"speed_max_mm_s", of(&NeedleMetrics::speed_max_mm_s)}};
  return {{"total", total}, {"each", each}};
}

OrderedJson to_json_structure(const StructureDose& s) {
  OrderedJson share = OrderedJson::array();
  for (float v : s.volume_share) share.push_back(std::round(1e6 * v) / 1e6);
  return {{"name", s.name},
          {"volume_cc", s.volume_cc},
          {"mean_gy", s.mean_gy},
          {"min_gy", s.min_gy},
          {"max_gy", s.max_gy},
          {"v100_percent", s.v100_percent},
          {"v150_percent", s.v150_percent},
          {"v200_percent", s.v200_percent},
          {"v100_cc", s.v100_cc},
          {"d90_gy", s.d90_gy},
          {"d30_gy", s.d30_gy},
          {"d10_gy", s.d10_gy},
          {"d2cc_gy", s.d2cc_gy},
          {"d5_gy", s.d5_gy},
          {"d0_1cc_gy", s.d0_1cc_gy},
          {"volume_share", share}};
}

OrderedJson to_json_stage(const DoseStage& stage) {
  if (stage.structures.empty()) return nullptr;
  OrderedJson structures = OrderedJson::array();
  for (const StructureDose& s : stage.structures) structures.push_back(to_json_structure(s));
  return {{"seeds", stage.seeds}, {"structures", structures}};
}

OrderedJson to_json_goals(const Score& score) {
  OrderedJson goals = OrderedJson::array();
  for (const GoalResult& result : score.goals) {
    const auto met = [&](const DoseStage& stage) {
      const double value = result.goal.value_in(stage.structures);
      return std::isnan(value) ? OrderedJson(nullptr)
                               : OrderedJson(result.goal.is_met_by(value, score.dose.prescription_gy));
    };
    const DoseIndex* index = find_dose_index(result.goal.figure);
    goals.push_back({{"structure", result.goal.structure},
                     {"figure", result.goal.figure},
                     {"stage", result.goal.stage},
                     {"unit", index ? unit_text(index->unit) : ""},
                     {result.goal.side, result.limit},
                     {"plan", met(score.dose.plan)},
                     {"dropped", met(score.dose.dropped)},
                     {"rest", met(score.dose.rest)}});
  }
  return goals;
}

OrderedJson to_json_studies(const std::vector<Score::Study>& studies) {
  OrderedJson list = OrderedJson::array();
  for (const auto& [t_s, s] : studies) {
    OrderedJson planes = OrderedJson::array();
    for (const SliceScore& plane : s.slices)
      planes.push_back({{"slice", plane.slice ? OrderedJson(*plane.slice) : OrderedJson(nullptr)},
                        {"offset_mm", plane.offset_mm},
                        {"outlined_mm2", plane.areas.first},
                        {"true_mm2", plane.areas.second},
                        {"dice", plane.dice()},
                        {"hausdorff_mm", plane.hausdorff_mm}});
    list.push_back({{"t_s", t_s},
                    {"dice", s.dice},
                    {"outlined_cm3", s.outlined_cm3},
                    {"true_cm3", s.gland_cm3},
                    {"volume_error_percent",
                     s.step_mm > 0 ? OrderedJson(s.volume_error_percent()) : OrderedJson(nullptr)},
                    {"hausdorff_mm", s.hausdorff_mm},
                    {"hausdorff_95_mm", s.hausdorff_95_mm},
                    {"mean_mm", s.mean_mm},
                    {"missed_planes", s.missed},
                    {"planes_beyond", s.beyond},
                    {"planes", planes}});
  }
  return list;
}

}  // namespace

std::string to_json(const Score& score) {
  const OrderedJson json = {
      {"notice", kNotice},
      {"recording", score.recording},
      {"about",
       {{"trainee", score.about.trainee}, {"exercise", score.about.exercise}, {"began", score.about.began}}},
      {"exercise", score.exercise ? to_json(*score.exercise) : OrderedJson(nullptr)},
      {"plan", score.plan},
      {"remarks", score.remarks},
      {"planned_seeds", score.planned_seeds},
      {"findings", to_json_findings(score.findings)},
      {"unexplained", to_json_unexplained(score.unexplained)},
      {"structures_entered", to_json_contacts(score.contacts)},
      {"failed_drops", score.failed_drops ? to_json_failed_drops(*score.failed_drops) : OrderedJson(nullptr)},
      {"verdict", to_json_verdict(score.goals)},
      {"consequences", score.consequences ? to_json_consequences(*score.consequences) : OrderedJson(nullptr)},
      {"seeds", score.seeds ? to_json_seeds(*score.seeds) : OrderedJson(nullptr)},
      {"needles", to_json_needles(score.needles)},
      {"volume_studies", to_json_studies(score.studies)},
      {"dose",
       {{"prescription_gy", score.dose.prescription_gy},
        {"goals", to_json_goals(score)},
        {"plan", to_json_stage(score.dose.plan)},
        {"dropped", to_json_stage(score.dose.dropped)},
        {"rest", to_json_stage(score.dose.rest)},
        {"day_zero", to_json_stage(score.dose.day_zero)}}}};
  // Names of folders need not be UTF-8.
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace brachy
