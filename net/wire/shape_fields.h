#pragma once

#include "net/wire/fields.h"

/// The payload of a FRAME's section NEEDLE_SHAPES.
namespace brachy::net {

/// Whether a FRAME carries the needle's shape.
inline bool has_shape(const NeedleRecord& needle) {
  return needle.state.present && needle.state.shape.is_bent;
}

/// Its entries belong to the needles that bend, not to a list of their own. Points of another number than
/// NeedleShape::kPoints, which a later version may send, are read as as many on the same course.
void shapes_section(FieldWriter& archive, const FrameMessage& message);
void shapes_section(FieldReader& archive, FrameMessage& message);

}  // namespace brachy::net
