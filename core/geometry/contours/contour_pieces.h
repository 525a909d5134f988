#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/geometry/contours/contour_stack.h"

namespace brachy {

/// What a piece is in one plane.
struct PiecePlane {
  double height_mm = 0;           ///< along the stack's normal
  Vec2 offset = Vec2::Zero();     ///< of the piece's own coordinates
  std::vector<Polygon> polygons;  ///< outlines and holes, minus the offset
  double area_mm2 = 0;            ///< without the holes
  double perimeter_mm = 0;        ///< of all polygons
};

/// What hangs together from plane to plane, in neighbouring planes of a stack. Its coordinates follow it: where a tube
/// runs obliquely its outlines lie on each other, so that what is between two planes is where both say that it is.
struct ContourPiece {
  std::vector<PiecePlane> planes;  ///< by increasing height
  bool is_cavity = false;          ///< it is missing in another piece, which surrounds it
};

/// The pieces of a stack, by their first planes. An outline with its holes goes on in the next plane where it lies over
/// another; where it lies over none, in the nearest one of alike size, if that lies within their diameter or the way to
/// it is the way that the piece takes before or after. No piece goes over a gap that separates two.
/// Holes that begin and end within a structure are a cavity, a piece of its own; others belong to their outline.
/// Errors: UserError "name: …" where too many outlines lie beside each other. Threads: any. Not real-time.
std::vector<ContourPiece> contour_pieces(const ContourStack& stack, const std::string& name);

}  // namespace brachy
