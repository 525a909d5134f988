// The ultrasound scanner: IMAGE, SCANNER and CONTOUR.
#include "net/wire/fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kSliceBytes = 120, kPointBytes = 16, kPlaneScoreBytes = 48;
constexpr std::uint16_t kScoreSection = 1;

void slice_fields(auto& archive, auto& slice) {
  archive.u32(slice.slice);
  const std::uint32_t points = archive.u32_count(slice.points);
  archive.check(points <= ContourMessage::kMostPoints, "an outline has more than 2000 points");
  archive.u64(slice.tick);
  archive.f64(slice.probe_depth_mm);
  archive.pose(slice.X_WI);
  archive.items(slice.points, points, kPointBytes, [&](auto& point) {
    archive.f64(point[0]);
    archive.f64(point[1]);
  });
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

void fields(auto& archive, MaybeConst<ImageMessage> auto& message) {
  archive.u16(message.array);
  archive.u16(message.flags);
  archive.u16(message.width);
  archive.u16(message.height);
  archive.u64(message.sequence);
  archive.u64(message.tick);
  archive.u64(message.newest_tick);
  archive.time(message.publish_ns);
  archive.f64(message.spacing_mm);
  archive.pose(message.X_WI);
  archive.check(message.width <= ImageMessage::kMaxSide && message.height <= ImageMessage::kMaxSide,
                "an image is larger than 4096 x 4096 pixels");
  const std::uint32_t size = archive.u32_count(message.data);
  archive.check((message.flags & kImageZlib) != 0 || size == std::uint32_t{message.width} * message.height,
                "an image has not as many pixels as its size says");
  archive.bytes(message.data, size);
  archive.sections();
}
BRACHY_CODEC(ImageMessage);

void fields(auto& archive, MaybeConst<ScannerMessage> auto& message) {
  archive.u16(message.array);
  archive.u16(message.freeze);
  archive.u32(message.flags);
  archive.u64(message.tick);
  for (auto* number :
       {&message.depth_mm, &message.gain_db, &message.dynamic_range_db, &message.tgc_extra_db_per_cm,
        &message.focus_mm, &message.probe_depth_mm, &message.probe_rotation_deg})
    archive.f64(*number);
  archive.sections();
}
BRACHY_CODEC(ScannerMessage);

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

}  // namespace brachy::net
