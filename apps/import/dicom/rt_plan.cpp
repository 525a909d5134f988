#include "apps/import/dicom/rt_plan.h"

#include <cmath>

#include "apps/import/dicom/dicom_tags.h"
#include "core/base/error.h"

namespace brachy {
namespace {

RtControlPoint read_control_point(const DicomItem& item) {
  if (!item.has(tag::kPosition3D))
    item.refuse(tag::kPosition3D,
                "is missing: nothing says where the source lies; export the plan with 3D positions");
  RtControlPoint point{item.point(tag::kPosition3D), item.optional_number(tag::kRelativePosition).value_or(0),
                       item.optional_number(tag::kCumulativeTimeWeight).value_or(0), std::nullopt};
  if (!(point.position.cwiseAbs().maxCoeff() <= 1e5))
    item.refuse(tag::kPosition3D, "lies farther than 100 m away; export it in mm");
  // Systems count from the tip, from the first dwell or from the afterloader: it may be negative.
  if (!(std::abs(point.relative_mm) <= 1e4))
    item.refuse(tag::kRelativePosition, "must be -10000 … 10000 mm; export it again");
  if (item.has(tag::kOrientation3D)) {
    const Vec3 axis = item.point(tag::kOrientation3D);
    if (axis.norm() > 1e-6) point.axis = axis.normalized();
  }
  return point;
}

}  // namespace

std::vector<RtDwell> dwells_of(const RtChannel& channel, const std::string& name) {
  constexpr double kSamePlaceMm = 1e-3;
  const auto refuse = [&](const DicomTag& tag, const std::string& what) {
    throw UserError(name + ": " + tag.text() + ": channel " + std::to_string(channel.number) + " " + what);
  };
  const std::vector<RtControlPoint>& points = channel.points;
  std::vector<RtDwell> dwells;
  double sum = 0, before = 0;
  bool is_running = true;  // the weights run on through the channel
  for (std::size_t p = 0; p + 1 < points.size(); p += 2) {
    const RtControlPoint &begin = points[p], &end = points[p + 1];
    if ((begin.position - end.position).norm() > kSamePlaceMm)
      refuse(tag::kControlPoints,
             "has control points that are not two at each position: which of them has the time is not said; "
             "export it with the begin and end of each dwell");
    const double weight = end.time_weight - begin.time_weight;
    if (!(weight >= 0))
      refuse(tag::kCumulativeTimeWeight, "has a weight that falls at one position; export it again");
    is_running &= begin.time_weight >= before;
    before = end.time_weight;
    sum += weight;
    dwells.push_back({begin.position, begin.relative_mm, weight});
  }
  if (points.size() % 2 != 0)
    refuse(tag::kControlPoints,
           "has an odd number of control points, where each dwell has two; export it again");
  if (sum == 0) return dwells;
  // Of weights that run on, what is between positions is the source's way.
  const double whole = channel.final_weight.value_or(is_running ? points.back().time_weight : sum);
  if (!(channel.total_time_s > 0))
    refuse(tag::kChannelTotalTime, "is 0 though the source dwells there; export it with its times");
  if (!(whole > 0)) refuse(tag::kFinalTimeWeight, "is 0 though the source dwells there; export it again");
  for (RtDwell& dwell : dwells) dwell.seconds *= channel.total_time_s / whole;
  return dwells;
}

RtBrachyPlan read_rt_plan(const DicomFile& file) {
  const DicomItem data = file.data();
  RtBrachyPlan plan;
  plan.frame = data.text(tag::kFrameOfReference);
  plan.treatment_type = data.text(tag::kTreatmentType);
  plan.technique = data.text(tag::kTechnique);
  plan.description = data.text(tag::kPlanDescription);
  plan.date = data.text(tag::kPlanDate);
  if (!data.has(tag::kSetups) && data.sequence(tag::kSetups).empty())
    data.refuse(tag::kSetups, "is missing or empty: it is no brachytherapy plan; export that one");
  for (const DicomItem& item : data.sequence(tag::kDoseReferences)) {
    const std::optional<double> gy = item.optional_number(tag::kTargetPrescriptionDose);
    if (!plan.prescription_gy) plan.prescription_gy = gy;
    if (gy && *gy > 0 && item.has(tag::kReferencePoint))
      plan.point_doses.push_back({item.point(tag::kReferencePoint), *gy});
  }
  for (const DicomItem& group : data.sequence(tag::kFractionGroups))
    for (const DicomItem& item : group.sequence(tag::kReferencedSetups))
      if (!plan.prescription_gy) plan.prescription_gy = item.optional_number(tag::kSetupDose);
  for (const DicomItem& item : data.sequence(tag::kSources)) {
    RtSource source;
    source.number = static_cast<int>(item.count(tag::kSourceNumber, 0, 1'000'000));
    source.model = item.text(tag::kSourceModel);
    source.maker = item.text(tag::kSourceMaker);
    source.isotope = item.text(tag::kIsotope);
    source.air_kerma_strength_u = item.number(tag::kAirKermaRate);
    source.active_length_mm = item.optional_number(tag::kActiveLength).value_or(0);
    source.half_life_days = item.optional_number(tag::kHalfLife).value_or(0);
    source.strength_date = item.text(tag::kStrengthDate);
    if (!(source.air_kerma_strength_u > 0))
      item.refuse(tag::kAirKermaRate, "must be above 0; export it again");
    plan.sources.push_back(std::move(source));
  }
  if (plan.sources.empty())
    data.refuse(tag::kSources, "is missing or empty; export the plan with its sources");
  std::size_t points = 0;
  for (const DicomItem& setup : data.sequence(tag::kSetups)) {
    if (const auto kerma = setup.optional_number(tag::kTotalAirKerma))
      plan.total_air_kerma_ugy = plan.total_air_kerma_ugy.value_or(0) + *kerma;
    for (const DicomItem& item : setup.sequence(tag::kChannels)) {
      RtChannel channel;
      channel.setup_name = setup.text(tag::kSetupName);
      channel.applicator = item.text(tag::kApplicatorId);
      // An ID has at most 16 characters: the name may be the whole of it.
      if (const std::string called = item.text(tag::kApplicatorName); called.starts_with(channel.applicator))
        channel.applicator = called;
      channel.final_weight = item.optional_number(tag::kFinalTimeWeight);
      if (item.has(tag::kReferencedRoi))
        channel.roi = static_cast<int>(item.count(tag::kReferencedRoi, 0, 2'000'000'000));
      channel.number = static_cast<int>(item.count(tag::kChannelNumber, 0, 1'000'000));
      channel.total_time_s = item.optional_number(tag::kChannelTotalTime).value_or(0);
      channel.source = item.has(tag::kReferencedSource)
                           ? static_cast<int>(item.count(tag::kReferencedSource, 0, 1'000'000))
                           : plan.sources.front().number;
      for (const DicomItem& point : item.sequence(tag::kControlPoints))
        channel.points.push_back(read_control_point(point));
      points += channel.points.size();
      if (points > 100'000) item.refuse(tag::kControlPoints, "there are over 100,000; export fewer needles");
      if (!channel.points.empty()) plan.channels.push_back(std::move(channel));
    }
  }
  plan.private_data = data.private_data();
  if (plan.channels.empty())
    data.refuse(tag::kChannels, "no application setup has a channel with positions" +
                                    (plan.private_data.empty()
                                         ? "; export the plan again"
                                         : "; its catheters may stand in private data, " + plan.private_data +
                                               ", which is not read: export them in standard tags"));
  return plan;
}

}  // namespace brachy
