#include <cmath>
#include <map>
#include <numbers>

#include "apps/import/case/case_plan.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom_out/rt_objects.h"
#include "core/brachytherapy/dose/source.h"
#include "core/needle/contact_settings.h"

namespace brachy {
namespace {

constexpr const char* kRtPlanStorage = "1.2.840.10008.5.1.4.1.1.481.5";
constexpr const char* kRtStructureSet = "1.2.840.10008.5.1.4.1.1.481.3";

/// The source's decay and strength (µGy/h at 1 m) on the export's date.
void put_source(DicomWriter source, const Tg43Source& tg43, double strength_u, const ExportIds& ids) {
  // "Cs-131, IsoRay CS-1 Rev2": nuclide and use, and who makes which.
  const std::string description(tg43.description);
  const std::string isotope = description.substr(0, description.find_first_of(" ,"));
  const auto comma = description.find(", ");
  const std::string manufacturer = comma == std::string::npos ? "" : description.substr(comma + 2);
  source.put(tag::kSourceNumber, "1").put({0x300a, 0x0214}, "LINE");
  source.put({0x300a, 0x0216}, manufacturer.substr(0, 64)).put(tag::kSourceModel, std::string(tg43.name));
  source.put({0x300a, 0x0218}, tg43.capsule_diameter_mm).put({0x300a, 0x021a}, 10 * tg43.active_length_cm);
  source.put(tag::kIsotope, isotope).put({0x300a, 0x0228}, tg43.half_life_days);
  source.put({0x300a, 0x0229}, "AIR_KERMA_RATE").put(tag::kAirKermaRate, strength_u);
  source.put({0x300a, 0x022c}, ids.date).put({0x300a, 0x022e}, "000000");
}

/// What is before the sources: RT General Plan and RT Prescription.
void put_general(DicomWriter data, const ExportIds& ids, double prescription_gy, const char* technique,
                 const char* type) {
  data.put({0x300a, 0x0002}, "brachyd").put({0x300a, 0x0006}, "").put({0x300a, 0x0007}, "");
  data.put({0x300a, 0x000c}, "PATIENT");
  data.item({0x300c, 0x0060}).put({0x0008, 0x1150}, kRtStructureSet).put({0x0008, 0x1155}, ids.structure_set);
  DicomWriter prescription = data.item(tag::kDoseReferences);
  prescription.put({0x300a, 0x0012}, "1").put({0x300a, 0x0014}, "VOLUME").put({0x300a, 0x0020}, "TARGET");
  prescription.put(tag::kReferencedRoi, "1").put(tag::kTargetPrescriptionDose, prescription_gy);
  data.put(tag::kTechnique, technique).put(tag::kTreatmentType, type);
  data.item({0x300a, 0x0206}).put({0x300a, 0x00b2}, "");
}

/// One fraction with `setups` application setups.
void put_fractions(DicomWriter data, std::size_t setups) {
  DicomWriter fractions = data.item({0x300a, 0x0070});
  fractions.put({0x300a, 0x0071}, "1").put({0x300a, 0x0078}, "1").put({0x300a, 0x0080}, "0");
  fractions.put_count({0x300a, 0x00a0}, setups);
  for (std::size_t n = 0; n < setups; ++n)
    fractions.item({0x300c, 0x000a}).put_count({0x300c, 0x000c}, n + 1);
}

/// A channel's number, time, and applicator; one with `movement` STEPWISE has steps.
void put_channel(DicomWriter out, std::size_t number, double total_s, const char* movement,
                 const std::string& hole) {
  out.put_count(tag::kChannelNumber, number).put({0x300a, 0x0284}, "").put(tag::kChannelTotalTime, total_s);
  out.put({0x300a, 0x0288}, movement).put_count({0x300a, 0x0290}, number);
  constexpr std::size_t kMostOfId = 16;  // SH
  out.put(tag::kApplicatorId, hole.substr(0, kMostOfId)).put({0x300a, 0x0292}, "RIGID");
  out.put(tag::kApplicatorName, hole)
      .put({0x300a, 0x0296}, NeedleSettings().length_mm)
      .put({0x300a, 0x02a2}, "");
  out.put(tag::kReferencedRoi, "");  // of the applicator, which is drawn nowhere
  out.put(tag::kReferencedSource, "1");
}

void put_axis(DicomWriter point, const Vec3& axis_ras) {
  // Direction cosines of the source's axis, FL.
  const Vec3 axis = ras_of_lps(axis_ras);
  point.put(tag::kOrientation3D,
            decimal_string(axis.x()) + "\\" + decimal_string(axis.y()) + "\\" + decimal_string(axis.z()));
}

/// A seed stays where it is: both control points of its channel are its centre.
void put_seed(DicomWriter setup, std::size_t channel, const PlannedSeed& seed, const std::string& hole,
              double total_s) {
  DicomWriter out = setup.item(tag::kChannels);
  put_channel(out, channel, total_s, "FIXED", hole);
  out.put({0x300a, 0x0110}, "2").put({0x300a, 0x02c8}, "1");
  for (int n = 0; n < 2; ++n) {
    DicomWriter point = out.item(tag::kControlPoints);
    point.put({0x300a, 0x0112}, std::to_string(n)).put(tag::kCumulativeTimeWeight, std::to_string(n));
    point.put(tag::kRelativePosition, seed.offset_mm).put(tag::kPosition3D, decimal_string(seed.position));
    put_axis(point, seed.axis);
  }
}

/// The source steps through a catheter: two control points a dwell, at its begin and end. Weights are seconds.
void put_catheter(DicomWriter setup, std::size_t number, const HdrPlan& plan,
                  const std::vector<Dwell>& dwells, std::size_t structures) {
  const std::size_t catheter = dwells.front().catheter;
  double total_s = 0;
  for (const Dwell& dwell : dwells) total_s += dwell.seconds;
  DicomWriter out = setup.item(tag::kChannels);
  put_channel(out, number, total_s, "STEPWISE", plan.catheters[catheter].label());
  out.put({0x300a, 0x02a0}, plan.step_mm).put_count({0x300a, 0x0110}, 2 * dwells.size());
  out.put({0x300a, 0x02c8}, total_s);
  if (plan.catheters[catheter].has_course())
    out.put(tag::kReferencedRoi, std::to_string(catheter_roi(structures, catheter)));
  double before_s = 0;
  std::size_t index = 0;
  for (const Dwell& dwell : dwells) {
    const double after_s = before_s + dwell.seconds;
    for (const double weight : {before_s, after_s}) {
      DicomWriter point = out.item(tag::kControlPoints);
      point.put_count({0x300a, 0x0112}, index++).put(tag::kCumulativeTimeWeight, weight);
      point.put(tag::kRelativePosition, plan.offset_mm(catheter, dwell.index))
          .put(tag::kPosition3D, decimal_string(dwell.position));
      put_axis(point, dwell.axis);
    }
    before_s = after_s;
  }
}

}  // namespace

void write_rt_plan(const std::filesystem::path& file, const ExportIds& ids, const Plan& plan,
                   const TemplateGrid& grid) {
  DicomObject object(ids, kRtPlanStorage, ids.plan, "RTPLAN");
  DicomWriter data = object.data();
  const Tg43Source& tg43 = tg43_source(plan.source);
  put_general(data, ids, plan.prescription_gy, "PERMANENT", "LDR");
  data.put(tag::kPlanDescription, template_text(grid, plan.base_plane_mm));
  DicomWriter source = data.item(tag::kSources);
  put_source(source, tg43, plan.air_kerma_strength_u, ids);
  source.put({0x300a, 0x022b}, plan.air_kerma_strength_u);
  // A source that decays gives the dose of its mean life at the first rate.
  const double mean_life_h = tg43.half_life_h() / std::numbers::ln2;
  const std::vector<PlannedSeed> seeds = plan.seeds(grid);
  put_fractions(data, plan.needles.size());
  for (std::size_t n = 0; n < plan.needles.size(); ++n) {
    DicomWriter setup = data.item(tag::kSetups);
    setup.put({0x300a, 0x0232}, "PERINEAL")
        .put_count(tag::kSetupNumber, n + 1)
        .put(tag::kSetupName, plan.needles[n].hole);
    std::size_t channel = 0;
    for (const PlannedSeed& seed : seeds)
      if (seed.needle == n) put_seed(setup, ++channel, seed, plan.needles[n].hole, 3600 * mean_life_h);
    // µGy at 1 m.
    setup.put({0x300a, 0x0250}, static_cast<double>(channel) * plan.air_kerma_strength_u * mean_life_h);
  }
  object.save(file);
}

void write_rt_plan(const std::filesystem::path& file, const ExportIds& ids, const HdrPlan& plan,
                   const TemplateGrid& grid, std::size_t structures) {
  DicomObject object(ids, kRtPlanStorage, ids.plan, "RTPLAN");
  DicomWriter data = object.data();
  put_general(data, ids, plan.prescription_gy, "INTERSTITIAL", "HDR");
  constexpr double kAnyBasePlaneMm = 100;  // an HDR plan has none
  // Courses come back as another system's do: from dwells and structures.
  if (std::ranges::none_of(plan.catheters, &PlanCatheter::has_course))
    data.put(tag::kPlanDescription, template_text(grid, kAnyBasePlaneMm) + hdr_text(plan));
  put_source(data.item(tag::kSources), tg43_source(plan.source), plan.source_strength_u, ids);
  put_fractions(data, 1);
  DicomWriter setup = data.item(tag::kSetups);
  setup.put({0x300a, 0x0232}, "PERINEAL").put(tag::kSetupNumber, "1").put(tag::kSetupName, "catheters");
  std::size_t number = 0;
  for (std::size_t c = 0; c < plan.catheters.size(); ++c) {
    std::vector<Dwell> dwells = plan.dwells_in(grid, c);
    if (!plan.catheters[c].has_course())
      std::erase_if(dwells, [](const Dwell& dwell) { return dwell.seconds <= 0; });
    if (!dwells.empty()) put_catheter(setup, ++number, plan, dwells, structures);
  }
  // µGy at 1 m.
  setup.put({0x300a, 0x0250}, plan.source_strength_u * plan.total_s() / 3600);
  object.save(file);
}

}  // namespace brachy
