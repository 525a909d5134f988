#pragma once

#include <filesystem>

#include "apps/charts/gray_png.h"
#include "core/base/rigid_transform.h"

namespace brachy {

/// Writes an 8-bit gray PNG (ISO/IEC 15948), compressed by zlib. Errors: UserError where it cannot be written.
void write_png(const std::filesystem::path& file, const GrayImage& image);

/// Writes an NRRD of one slice (NRRD0005, space right-anterior-superior, raw). `X_WG`: from columns × spacing_mm,
/// rows × spacing_mm to the world, mm; the slice is `thickness_mm` thick. Errors: UserError as write_png.
void write_nrrd(const std::filesystem::path& file, const GrayImage& image, const RigidTransform& X_WG,
                double spacing_mm, double thickness_mm);

}  // namespace brachy
