#pragma once

#include <span>

#include "core/ladder/point_groups.h"

namespace brachy {

/// Landmarks as an elastic kernel wants them (tests/reference/LADDER_STUDY.md, "The rule"):
///
/// on a shaft (two or more consecutive landmarks on a line): rings of six points on the needle's surface about the axis,
/// every second one turned by half a step, at most 1.5 R apart. A landmark is the rings nearer to it than to ... by hat
/// weights between its neighbours. Ring radius R; the end rings lie 0.3 R inward, 0.714 R wide. Core of a point
/// 0.40 √A, A = 2πR/6 · h its share of the surface, h the rings' spacing: then a lattice of points that carries a
/// surface force has the mean displacement of the smooth layer (0.385 by theory for any ν).
/// alone: a contact, one point of core (4/π) R, the resistance 16 μ R of a rigid disc at ν = ½.
/// with a core of its own (`cores` > 0): one point of that core.
///
/// `radius` R in mm; `leaves_body(p)`: whether the shaft goes on beyond its last landmark there (no round end).
PointGroups needle_groups(std::span<const Vec3> positions, std::span<const double> cores, double radius,
                          const Vec3& box_centre, const Vec3& box_size);

}  // namespace brachy
