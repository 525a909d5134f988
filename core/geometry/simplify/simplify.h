#pragma once

#include <cstddef>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

struct SimplifyOptions {
  double tolerance_mm = 0.03;        ///< root mean square distance to the planes that a vertex stands for
  std::size_t least_vertices = 200;  ///< no fewer are left
};

/// A closed surface with fewer vertices: edges are contracted to the point that is nearest to the planes of all
/// triangles that the two ends stand for, weighted by area, cheapest first (M. Garland, P. Heckbert, "Surface
/// simplification using quadric error metrics", SIGGRAPH 1997), until the next would exceed the tolerance. A
/// contraction that would turn a triangle over or change the topology (T. Dey et al., "Topology preserving edge
/// contraction", 1999: the two ends have just two neighbours in common) is left out, so the result is as closed as
/// the input. What volume was lost is given back by moving all vertices outward, at most by the tolerance. The
/// input's edges have two triangles each. Deterministic; vertices keep their order. Threads: any. Not real-time:
/// about 3 s for a million vertices.
SurfaceMesh simplify(const SurfaceMesh& mesh, const SimplifyOptions& options = {});

}  // namespace brachy
