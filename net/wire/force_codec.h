#pragma once

#include "core/contact/needle_forces.h"
#include "net/wire/byte_io.h"

/// What FORCE and FRAME's section FORCE share: 13 f64.
namespace brachy::net {

void write_needle_forces(ByteWriter& writer, const NeedleForces& forces);

/// Forces go to a hand: a number that is not finite makes the reader fail.
NeedleForces read_needle_forces(ByteReader& reader);

}  // namespace brachy::net
