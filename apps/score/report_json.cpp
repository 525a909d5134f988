#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/score/report.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

using Json = nlohmann::ordered_json;  // NaN becomes null

Json to_json_point(const Vec3& p) {
  return {p.x(), p.y(), p.z()};
}

Json to_json_spread(const Spread& s) {
  return {{"count", s.count}, {"mean", s.mean}, {"sd", s.sd}, {"max", s.max}};
}

Json to_json_errors(const MisplacementSpread& s) {
  return {{"total_mm", to_json_spread(s.total_mm)},
          {"axial_mm", to_json_spread(s.axial_mm)},
          {"lateral_mm", to_json_spread(s.lateral_mm)},
          {"mean_signed_axial_mm", s.mean_signed_axial_mm},
          {"axial_share", s.axial_share}};
}

Json to_json_error(const Misplacement& m) {
  return {{"total_mm", m.total_mm}, {"axial_mm", m.axial_mm}, {"lateral_mm", m.lateral_mm}};
}

Json to_json_seed(const Seed& s) {
  return {{"seed", s.id},
          {"t_s", s.t_s},
          {"needle", s.needle},
          {"certified", s.is_certified},
          {"dropped_mm", to_json_point(s.dropped)},
          {"rest_mm", to_json_point(s.rest)},
          {"gland_motion_mm", s.gland_motion.norm()}};
}

Json to_json_pair(const SeedScore& s) {
  return {{"planned", s.planned_index},
          {"hole", s.hole},
          {"offset_mm", s.planned.offset_mm},
          {"planned_mm", to_json_point(s.planned.position)},
          {"dropped_error", to_json_error(s.dropped)},
          {"rest_error", to_json_error(s.rest)}};
}

Json to_json_assignment(const SeedAssignment& assignment) {
  Json each = Json::array(), extra = Json::array();
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

Json to_json_seeds(const SeedsScore& score) {
  Json each = Json::array(), unplanned = Json::array();
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

Json to_json_findings(const std::vector<Finding>& findings) {
  Json all = Json::array();
  for (const Finding& finding : findings) all.push_back({{"text", finding.text}, {"weight", finding.weight}});
  return all;
}

Json to_json_contacts(const std::vector<StructureContact>& contacts) {
  Json all = Json::array();
  for (const StructureContact& contact : contacts)
    all.push_back({{"structure", contact.structure},
                   {"hole", contact.hole.empty() ? Json(nullptr) : Json(contact.hole)},
                   {"passes", contact.passes},
                   {"depth_mm", contact.depth_mm},
                   {"time_s", contact.time_s}});
  return all;
}

template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json to_json_needles(const NeedlesScore& score) {
  Json each = Json::array();
  for (const NeedleScore& n : score.needles)
    each.push_back({{"hole", n.hole.empty() ? Json(nullptr) : Json(n.hole)},
                    {"planned", or_null(n.planned)},
                    {"path_in_tissue_mm", n.path_in_tissue_mm},
                    {"time_in_tissue_s", n.time_in_tissue_s},
                    {"passes", or_null(n.passes)},
                    {"insertions", or_null(n.insertions)},
                    {"punctures", or_null(n.punctures)},
                    {"largest_force_n", n.largest_force_n}});
  const NeedleMetrics* m = score.motion ? &*score.motion : nullptr;
  const auto of = [&](double NeedleMetrics::*value) { return m ? m->*value : kNoNumber; };
  const Json total = {{"elapsed_time_s", of(&NeedleMetrics::elapsed_time_s)},
                      {"path_length_mm", of(&NeedleMetrics::path_length_mm)},
                      {"path_in_tissue_mm", of(&NeedleMetrics::path_in_tissue_mm)},
                      {"time_in_tissue_s", of(&NeedleMetrics::time_in_tissue_s)},
                      {"passes", m ? Json(m->passes) : Json(nullptr)},
                      {"punctures", or_null(score.punctures)},
                      {"largest_force_n", score.largest_force_n},
                      {"speed_p50_mm_s", of(&NeedleMetrics::speed_p50_mm_s)},
                      {"speed_p95_mm_s", of(&NeedleMetrics::speed_p95_mm_s)},
                      {"speed_max_mm_s", of(&NeedleMetrics::speed_max_mm_s)}};
  return {{"total", total}, {"each", each}};
}

Json to_json_structure(const StructureDose& s) {
  Json share = Json::array();
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
          {"volume_share", share}};
}

Json to_json_stage(const DoseStage& stage) {
  if (stage.structures.empty()) return nullptr;
  Json structures = Json::array();
  for (const StructureDose& s : stage.structures) structures.push_back(to_json_structure(s));
  return {{"seeds", stage.seeds}, {"structures", structures}};
}

Json to_json_goals(const DoseScore& dose) {
  Json goals = Json::array();
  for (const DoseFigure& f : dose_figures()) {
    if (f.goal == DoseFigure::Goal::kNone) continue;
    const auto met = [&](const DoseStage& stage) {
      const double figure = figure_of(stage, f);
      return std::isnan(figure) ? Json(nullptr) : Json(f.is_met_by(figure, dose.prescription_gy));
    };
    goals.push_back(
        {{"structure", f.structure},
         {"figure", f.name},
         {"unit", f.unit},
         {f.goal == DoseFigure::Goal::kAbove ? "above" : "below", f.limit_for(dose.prescription_gy)},
         {"plan", met(dose.plan)},
         {"dropped", met(dose.dropped)},
         {"rest", met(dose.rest)}});
  }
  return goals;
}

}  // namespace

std::string to_json(const Score& score) {
  const Json json = {{"notice", kNotice},
                     {"recording", score.recording},
                     {"plan", score.plan},
                     {"remarks", score.remarks},
                     {"planned_seeds", score.planned_seeds},
                     {"findings", to_json_findings(score.findings)},
                     {"structures_entered", to_json_contacts(score.contacts)},
                     {"seeds", score.seeds ? to_json_seeds(*score.seeds) : Json(nullptr)},
                     {"needles", to_json_needles(score.needles)},
                     {"dose",
                      {{"prescription_gy", score.dose.prescription_gy},
                       {"goals", to_json_goals(score.dose)},
                       {"plan", to_json_stage(score.dose.plan)},
                       {"dropped", to_json_stage(score.dose.dropped)},
                       {"rest", to_json_stage(score.dose.rest)}}}};
  // Names of folders need not be UTF-8.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace brachy
