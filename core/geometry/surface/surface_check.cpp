#include "core/geometry/surface/surface_check.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/base/error.h"
#include "core/geometry/surface/surface_pieces.h"
#include "core/geometry/surface/surface_topology.h"

namespace brachy {
namespace {

constexpr double kMm3PerCc = 1000;

void check_input(const SurfaceMesh& mesh, const SurfaceOptions& options, const std::string& name) {
  if (!(options.weld_tolerance_mm >= 0 && std::isfinite(options.weld_tolerance_mm))) {
    throw UserError(name + ": the weld tolerance must be 0 mm or more");
  }
  if (!(options.min_island_share >= 0 && options.min_island_share <= 0.5)) {
    throw UserError(name + ": the minimum share of an island must lie in 0 … 0.5");
  }
  for (const Vec3& v : mesh.vertices) {
    if (!v.allFinite()) throw UserError(name + ": a vertex is not finite; repair the mesh");
  }
  for (const Triangle& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) < mesh.vertices.size()) continue;
    throw UserError(name + ": a triangle refers to a vertex that does not exist; repair the mesh");
  }
}

/// From the lowest index on, same winding.
Triangle from_lowest(const Triangle& t) {
  const auto k = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
  return {t[k], t[(k + 1) % 3], t[(k + 2) % 3]};
}

/// Welds, drops degenerate and repeated triangles, sorts.
SurfaceMesh weld(const SurfaceMesh& mesh, double tolerance, SurfaceReport& report) {
  Welding welding = weld_vertices(mesh.vertices, tolerance);
  report.welded_vertices = mesh.vertices.size() - welding.vertices.size();
  SurfaceMesh welded{std::move(welding.vertices), {}};
  welded.triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Triangle w = {welding.representative[t[0]], welding.representative[t[1]],
                        welding.representative[t[2]]};
    if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) continue;
    welded.triangles.push_back(from_lowest(w));
  }
  report.degenerate_triangles = mesh.triangles.size() - welded.triangles.size();
  const auto corners = [](const Triangle& t) {
    return std::tuple(t[0], std::min(t[1], t[2]), std::max(t[1], t[2]));
  };
  auto& triangles = welded.triangles;
  std::sort(triangles.begin(), triangles.end(), [&](const Triangle& a, const Triangle& b) {
    return std::tuple(corners(a), a) < std::tuple(corners(b), b);
  });
  const auto end = std::unique(triangles.begin(), triangles.end(), [&](const Triangle& a, const Triangle& b) {
    return corners(a) == corners(b);
  });
  report.duplicate_triangles = static_cast<std::size_t>(triangles.end() - end);
  triangles.erase(end, triangles.end());
  return welded;
}

void turn_over(Triangle& t) {
  std::swap(t[1], t[2]);
}

/// Keeps the triangles of kept components and the vertices these use, order unchanged.
void compact(SurfaceMesh& mesh, const std::vector<std::uint32_t>& component, const std::vector<bool>& kept) {
  std::size_t triangles = 0;
  std::vector<std::uint32_t> index(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < component.size(); ++t) {
    if (!kept[component[t]]) continue;
    mesh.triangles[triangles++] = mesh.triangles[t];
    for (const std::uint32_t v : mesh.triangles[t]) index[v] = 1;
  }
  mesh.triangles.resize(triangles);
  std::uint32_t vertices = 0;
  for (std::size_t v = 0; v < index.size(); ++v) {
    if (index[v] == 0) continue;
    mesh.vertices[vertices] = mesh.vertices[v];
    index[v] = vertices++;
  }
  mesh.vertices.resize(vertices);
  for (Triangle& t : mesh.triangles) t = from_lowest({index[t[0]], index[t[1]], index[t[2]]});
  std::sort(mesh.triangles.begin(), mesh.triangles.end());
}

}  // namespace

PreparedSurface prepare_surface(const SurfaceMesh& input, const SurfaceOptions& options,
                                const std::string& name) {
  check_input(input, options, name);
  SurfaceReport report;
  SurfaceMesh mesh = weld(input, options.weld_tolerance_mm, report);
  const SurfaceTopology topology = analyse_topology(mesh.triangles);
  std::vector<bool> turned = topology.flipped;
  const auto turn = [&](std::size_t t) {
    turn_over(mesh.triangles[t]);
    turned[t] = !turned[t];
  };

  for (std::size_t t = 0; t < turned.size(); ++t) {
    if (topology.flipped[t]) turn_over(mesh.triangles[t]);
  }
  const std::vector<Piece> patches = measure_pieces(mesh, topology.patch, topology.patch_count);
  for (std::size_t t = 0; t < turned.size(); ++t) {
    if (patches[topology.patch[t]].volume < 0) turn(t);
  }

  const std::vector<Piece> components = measure_pieces(mesh, topology.component, topology.component_count);
  const std::vector<bool> kept = choose_kept(components, topology, options.min_island_share);
  const std::vector<bool> cavity = find_cavities(mesh, topology, kept, name);
  for (std::size_t t = 0; t < turned.size(); ++t) {
    const std::uint32_t c = topology.component[t];
    if (cavity[c]) turn(t);
    report.flipped_triangles += turned[t] && kept[c];
  }
  for (std::size_t c = 0; c < kept.size(); ++c) {
    if (!kept[c]) {
      ++report.dropped_islands;
      report.dropped_island_volume_cc += std::abs(components[c].volume) / kMm3PerCc;
      continue;
    }
    ++report.components;
    report.cavities += cavity[c];
    report.open_edges += topology.edges[c].open;
    report.nonmanifold_edges += topology.edges[c].nonmanifold;
    report.twisted_edges += topology.edges[c].twisted;
    report.volume_cc += (cavity[c] ? -1 : 1) * components[c].volume / kMm3PerCc;
  }
  compact(mesh, topology.component, kept);

  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  report.bad_edges = report.open_edges + report.nonmanifold_edges + report.twisted_edges;
  report.watertight = report.triangles > 0 && report.bad_edges == 0;
  if (!mesh.vertices.empty()) report.min_mm = report.max_mm = mesh.vertices[0];
  for (const Vec3& v : mesh.vertices) {
    report.min_mm = report.min_mm.cwiseMin(v);
    report.max_mm = report.max_mm.cwiseMax(v);
  }
  return {std::move(mesh), report};
}

void require_closed(const SurfaceReport& report, const std::string& name) {
  if (report.triangles == 0) {
    throw UserError(name + ": no triangle is left after welding; check the units and the weld tolerance");
  }
  if (report.bad_edges > 0) {
    throw UserError(
        name + ": the surface is not closed: " + std::to_string(report.bad_edges) + " bad edges (" +
        std::to_string(report.open_edges) + " open, " + std::to_string(report.nonmanifold_edges) +
        " non-manifold, " + std::to_string(report.twisted_edges) +
        " not orientable); repair it, e.g. in MeshLab with 'Repair Non Manifold Edges' and 'Close Holes', "
        "or smooth and export the segmentation again in 3D Slicer");
  }
  if (!(report.volume_cc > 0)) {
    throw UserError(name + ": the surface encloses no volume; export a closed surface of the organ");
  }
}

}  // namespace brachy
