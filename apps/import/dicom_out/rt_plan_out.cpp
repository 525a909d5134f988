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

void put_source(DicomWriter source, const Plan& plan, const Tg43Source& tg43, const ExportIds& ids) {
  const bool is_iodine = plan.source == SourceModel::kAmersham6711;
  source.put(tag::kSourceNumber, "1").put({0x300a, 0x0214}, "LINE");
  source.put({0x300a, 0x0216}, is_iodine ? "Amersham" : "Theragenics")
      .put(tag::kSourceModel, std::string(tg43.name));
  source.put({0x300a, 0x0218}, kSeedDiameterMm).put({0x300a, 0x021a}, 10 * tg43.active_length_cm);
  source.put(tag::kIsotope, is_iodine ? "I-125" : "Pd-103").put({0x300a, 0x0228}, tg43.half_life_days);
  source.put({0x300a, 0x0229}, "AIR_KERMA_RATE")
      .put({0x300a, 0x022b}, plan.air_kerma_strength_u)
      .put(tag::kAirKermaRate, plan.air_kerma_strength_u);
  source.put({0x300a, 0x022c}, ids.date).put({0x300a, 0x022e}, "000000");
}

/// A seed stays where it is: both control points of its channel are its centre.
void put_seed(DicomWriter setup, std::size_t channel, const PlannedSeed& seed, const std::string& hole,
              double total_s) {
  DicomWriter out = setup.item(tag::kChannels);
  out.put_count(tag::kChannelNumber, channel).put({0x300a, 0x0284}, "").put(tag::kChannelTotalTime, total_s);
  out.put({0x300a, 0x0288}, "FIXED");
  out.put({0x300a, 0x0290}, "1").put(tag::kApplicatorId, hole).put({0x300a, 0x0292}, "RIGID");
  out.put({0x300a, 0x0294}, hole).put({0x300a, 0x0296}, NeedleSettings().length_mm).put({0x300a, 0x02a2}, "");
  out.put(tag::kReferencedRoi, "");  // of the applicator, which is drawn nowhere
  out.put(tag::kReferencedSource, "1").put({0x300a, 0x0110}, "2").put({0x300a, 0x02c8}, "1");
  for (int n = 0; n < 2; ++n) {
    DicomWriter point = out.item(tag::kControlPoints);
    point.put({0x300a, 0x0112}, std::to_string(n)).put(tag::kCumulativeTimeWeight, std::to_string(n));
    point.put(tag::kRelativePosition, seed.offset_mm).put(tag::kPosition3D, decimal_string(seed.position));
    // Direction cosines of the source's axis, FL.
    const Vec3 axis = ras_of_lps(seed.axis);
    point.put(tag::kOrientation3D,
              decimal_string(axis.x()) + "\\" + decimal_string(axis.y()) + "\\" + decimal_string(axis.z()));
  }
}

}  // namespace

void write_rt_plan(const std::filesystem::path& file, const ExportIds& ids, const Plan& plan,
                   const TemplateGrid& grid) {
  DicomObject object(ids, kRtPlanStorage, ids.plan, "RTPLAN");
  DicomWriter data = object.data();
  const Tg43Source& tg43 = tg43_source(plan.source);
  data.put({0x300a, 0x0002}, "brachyd").put({0x300a, 0x0006}, "").put({0x300a, 0x0007}, "");
  data.put(tag::kPlanDescription, template_text(grid, plan.base_plane_mm)).put({0x300a, 0x000c}, "PATIENT");
  data.item({0x300c, 0x0060}).put({0x0008, 0x1150}, kRtStructureSet).put({0x0008, 0x1155}, ids.structure_set);
  DicomWriter prescription = data.item(tag::kDoseReferences);
  prescription.put({0x300a, 0x0012}, "1").put({0x300a, 0x0014}, "VOLUME").put({0x300a, 0x0020}, "TARGET");
  prescription.put(tag::kReferencedRoi, "1").put(tag::kTargetPrescriptionDose, plan.prescription_gy);
  data.put(tag::kTechnique, "PERMANENT").put(tag::kTreatmentType, "LDR");
  data.item({0x300a, 0x0206}).put({0x300a, 0x00b2}, "");
  put_source(data.item(tag::kSources), plan, tg43, ids);
  // A source that decays gives the dose of its mean life at the first rate.
  const double mean_life_h = tg43.half_life_h() / std::numbers::ln2;
  const std::vector<PlannedSeed> seeds = plan.seeds(grid);
  DicomWriter fractions = data.item({0x300a, 0x0070});
  fractions.put({0x300a, 0x0071}, "1").put({0x300a, 0x0078}, "1").put({0x300a, 0x0080}, "0");
  fractions.put_count({0x300a, 0x00a0}, plan.needles.size());
  for (std::size_t n = 0; n < plan.needles.size(); ++n) {
    fractions.item({0x300c, 0x000a}).put_count({0x300c, 0x000c}, n + 1);
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

}  // namespace brachy
