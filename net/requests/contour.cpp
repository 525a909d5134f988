// CONTOUR: an operator's volume study, and the answer with its score.
#include <utility>

#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kSliceBytes = 120, kPlaneScoreBytes = 48;
constexpr std::uint16_t kScoreSection = 1;

void slice_fields(auto& archive, auto& slice) {
  archive.u32(slice.slice);
  const std::uint32_t points = archive.u32_count(slice.points);
  archive.check(points <= ContourMessage::kMostPoints, "an outline has more than 2000 points");
  archive.u64(slice.tick);
  archive.f64(slice.probe_depth_mm);
  archive.pose(slice.X_WI);
  archive.points(slice.points, points);
}

void score_fields(auto& archive, auto& score) {
  for (auto* number : {&score.dice, &score.outlined_cm3, &score.true_cm3, &score.same_planes_cm3,
                       &score.volume_error_percent, &score.hausdorff_mm, &score.hausdorff_95_mm,
                       &score.mean_mm, &score.step_mm})
    archive.f64(*number);
  archive.u16(score.missed);
  archive.u16(score.beyond);
  archive.u16_list(score.planes, kPlaneScoreBytes, [&](auto& plane) {
    archive.u32(plane.slice);
    archive.reserved(4);
    for (auto* number :
         {&plane.offset_mm, &plane.outlined_mm2, &plane.true_mm2, &plane.dice, &plane.hausdorff_mm})
      archive.f64(*number);
  });
}

}  // namespace

template <class Archive>
void fields(Archive& archive, MaybeConst<ContourMessage> auto& message) {
  archive.u64(message.about_sequence);
  archive.u16_list(message.slices, kSliceBytes, [&](auto& slice) { slice_fields(archive, slice); });
  archive.sections(Section{kScoreSection, message.score.has_value(), [&](auto& section) {
                             if constexpr (Archive::kReads) message.score = ContourMessage::Figures{};
                             score_fields(section, *message.score);
                           }});
}
BRACHY_CODEC(ContourMessage);

Refusal handle_contour(const IncomingRequest& request) {
  // A body of up to 2 MB is read last: what is refused anyway costs the server nothing.
  if (auto refusal = request.refuse_others("CONTOUR")) return refusal;
  if (!request.pass({"CONTOUR", 1, 2}))
    return request.refuse(ErrorCode::kContourRefused, "more than one CONTOUR a second");
  ContourMessage contour;
  if (auto refusal = request.decode(contour)) return refusal;
  contour.about_sequence = request.header.sequence;
  contour.score.reset();
  return request.call(std::move(contour), ErrorCode::kContourRefused, "this server scores no volume studies");
}

}  // namespace brachy::net
