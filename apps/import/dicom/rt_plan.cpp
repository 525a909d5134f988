#include "apps/import/dicom/rt_plan.h"

#include "apps/import/dicom/dicom_tags.h"

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
  if (!(point.relative_mm >= 0 && point.relative_mm <= 1e4))
    item.refuse(tag::kRelativePosition, "must be 0 … 10000 mm; export it again");
  if (item.has(tag::kOrientation3D)) {
    const Vec3 axis = item.point(tag::kOrientation3D);
    if (axis.norm() > 1e-6) point.axis = axis.normalized();
  }
  return point;
}

}  // namespace

RtBrachyPlan read_rt_plan(const DicomFile& file) {
  const DicomItem data = file.data();
  RtBrachyPlan plan;
  plan.frame = data.text(tag::kFrameOfReference);
  plan.treatment_type = data.text(tag::kTreatmentType);
  plan.technique = data.text(tag::kTechnique);
  plan.description = data.text(tag::kPlanDescription);
  if (!data.has(tag::kSetups) && data.sequence(tag::kSetups).empty())
    data.refuse(tag::kSetups, "is missing or empty: it is no brachytherapy plan; export that one");
  for (const DicomItem& item : data.sequence(tag::kDoseReferences))
    if (!plan.prescription_gy) plan.prescription_gy = item.optional_number(tag::kTargetPrescriptionDose);
  for (const DicomItem& item : data.sequence(tag::kSources)) {
    RtSource source{static_cast<int>(item.count(tag::kSourceNumber, 0, 1'000'000)),
                    item.text(tag::kSourceModel), item.text(tag::kIsotope), item.number(tag::kAirKermaRate)};
    if (!(source.air_kerma_strength_u > 0))
      item.refuse(tag::kAirKermaRate, "must be above 0; export it again");
    plan.sources.push_back(std::move(source));
  }
  if (plan.sources.empty())
    data.refuse(tag::kSources, "is missing or empty; export the plan with its sources");
  std::size_t points = 0;
  for (const DicomItem& setup : data.sequence(tag::kSetups)) {
    for (const DicomItem& item : setup.sequence(tag::kChannels)) {
      RtChannel channel;
      channel.setup_name = setup.text(tag::kSetupName);
      channel.applicator = item.text(tag::kApplicatorId);
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
  if (plan.channels.empty())
    data.refuse(tag::kChannels, "no application setup has a channel with positions; export the plan again");
  return plan;
}

}  // namespace brachy
