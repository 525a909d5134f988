#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/geometry/surface/surface_mesh.h"
#include "net/igtl/codec/messages.h"
#include "net/wire/byte_io.h"
#include "net/wire/messages.h"

/// Messages to bytes and back: pure functions, no socket, no clock, any thread. Decoding takes untrusted input.
namespace brachy::net::igtl {

// Whole messages, with header and CRC. With label.version 2 the body has an extended header.

/// A body of 0 bytes: a query, or "there is none" in answer to one.
Bytes encode_empty(std::string_view type, const Label& label);
/// Single precision. `status`: with header version 2 the metadata TransformStatus, "OK" or "MISSING"; empty: none.
Bytes encode_transform(const Label& label, const RigidTransform& X, std::string_view status = {});
Bytes encode_status(const Label& label, const Status& status);
Bytes encode_tracking(const Label& label, std::span<const TrackedTool> tools);
/// RTS_TDATA, RTS_POLYDATA or RTS_IMAGE, the answer to STT_ and STP_ of these: done.
Bytes encode_start_answer(std::string_view type, const Label& label, bool is_done = true);
Bytes encode_capability(const Label& label, std::span<const std::string_view> types);

/// One slice of 8-bit scalars in RAS, its matrix as the protocol has it: the axes times the spacing of pixels, which is
/// the slice's thickness too, and the place of the slice's middle. With version 2 the metadata ImageState has its
/// flags: "live", "held" or "frozen", and " uncertified". Precondition: the pixels are not compressed.
Bytes encode_image(const Label& label, const ImageMessage& image, const RigidTransform& X_FI);

/// The polygons of a POLYDATA, encoded once: they do not change.
Bytes encode_triangles(std::span<const Triangle> triangles);
/// `points`: x y z of each. `triangles`: encode_triangles() of triangle_count.
Bytes encode_polydata(const Label& label, std::span<const float> points, std::span<const std::byte> triangles,
                      std::uint32_t triangle_count);

/// Of the first kHeaderSize bytes (precondition: present). Names end at the first zero; unprintable bytes in them
/// become '?'. Nothing is checked.
Header decode_header(std::span<const std::byte> bytes);
/// nullopt: the size is wrong. Entries may be anything, also NaN.
std::optional<RigidTransform> decode_transform(std::span<const std::byte> content);
std::optional<StartTracking> decode_start_tracking(std::span<const std::byte> content);

}  // namespace brachy::net::igtl
