// IMAGE: of the ultrasound scanner.
#include "net/wire/fields.h"

namespace brachy::net {

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

}  // namespace brachy::net
