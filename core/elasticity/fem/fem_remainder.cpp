#include "core/elasticity/fem/fem_remainder.h"

#include <cmath>
#include <memory>

#include "core/elasticity/kelvin.h"

namespace brachy {
namespace {

constexpr int kSamples = 2;  // along each axis in the octant of a Gauss point

// Shear moduli of a body's cells over that outside all regions. A cell is cut by a region's surface if its corners and
// its centre differ; then a Gauss point has the harmonic mean over the octant around it, which makes up for the cells'
// being too stiff (ratio 8: the field is 2.7 % off, with the arithmetic mean 4.5 %).
class CellModuli {
 public:
  explicit CellModuli(const ElasticBody& body)
      : body_(body), materials_(body.materials()), shares_(materials_.size()) {}

  std::array<double, 8> operator()(const HexMesh& mesh, const HexMesh::Place& cell) {
    const Vec3 min = mesh.position(cell), size = mesh.cell_size(cell);
    const double centre = compliance(min + 0.5 * size);
    bool is_cut = false;
    for (int a = 0; a < 8 && !is_cut; ++a)
      is_cut = corner_compliance(mesh, mesh.cell_node(cell, a)) != centre;
    std::array<double, 8> moduli;
    moduli.fill(1 / centre);
    for (std::size_t g = 0; g < 8 && is_cut; ++g) moduli[g] = octant_modulus(min, size, static_cast<int>(g));
    return moduli;
  }

 private:
  double compliance(const Vec3& X) {
    body_.material_shares(X, shares_);
    double sum = 0;
    for (std::size_t m = 0; m < shares_.size(); ++m) sum += shares_[m] / materials_[m];
    return sum;
  }

  double corner_compliance(const HexMesh& mesh, int node) {
    corners_.resize(static_cast<std::size_t>(mesh.nodes()));
    double& known = corners_[static_cast<std::size_t>(node)];
    if (known == 0) known = compliance(mesh.position(mesh.place(node)));
    return known;
  }

  double octant_modulus(const Vec3& min, const Vec3& size, int octant) {
    double sum = 0;
    for (int i = 0; i < kSamples * kSamples * kSamples; ++i) {
      const int sample[3] = {i % kSamples, i / kSamples % kSamples, i / (kSamples * kSamples)};
      Vec3 t;
      for (int k = 0; k < 3; ++k) t[k] = 0.5 * ((octant >> k & 1) + (sample[k] + 0.5) / kSamples);
      sum += compliance(min + t.cwiseProduct(size));
    }
    return kSamples * kSamples * kSamples / sum;
  }

  const ElasticBody& body_;
  std::vector<double> materials_, shares_, corners_;
};

std::array<double, 8> modulus_one(const HexMesh&, const HexMesh::Place&) {
  std::array<double, 8> ones;
  ones.fill(1);
  return ones;
}

bool on_face(const HexMesh& mesh, const HexMesh::Place& place, std::size_t face) {
  const std::size_t axis = face / 2;
  return place[axis] == (face % 2 ? mesh.planes(axis) - 1 : 0);
}

MeshSystem::IsFixed on_faces(const std::array<bool, 6>& held) {
  return [held](const HexMesh& mesh, const HexMesh::Place& place) {
    for (std::size_t face = 0; face < 6; ++face)
      if (held[face] && on_face(mesh, place, face)) return true;
    return false;
  };
}

}  // namespace

FemRemainder::FemRemainder(const ElasticBody& body, const FemOptions& options)
    : min_(body.box_centre - 0.5 * body.box_size),
      max_(body.box_centre + 0.5 * body.box_size),
      poisson_(body.poisson),
      tissue_(
          HexMesh(mesh_planes(body, options.sizes, options.tissue)), body.poisson,
          [moduli = std::make_shared<CellModuli>(body)](const HexMesh& mesh, const HexMesh::Place& cell) {
            return (*moduli)(mesh, cell);
          },
          on_faces(body.held), options.target),
      unbounded_(HexMesh(with_outer_cells(mesh_planes(body, options.sizes, options.tissue))), body.poisson,
                 modulus_one, on_faces({true, true, true, true, true, true}), options.target) {}

PointGroups FemRemainder::loads(const PointGroups& groups) const {
  PointGroups spread;
  const auto add = [&](const Vec3& p, double s, double weight) {
    spread.add(p.cwiseMax(min_).cwiseMin(max_), s, weight);
  };
  for (std::size_t g = 0; g < groups.size(); ++g) {
    spread.begin_group();
    for (std::uint32_t i = groups.first[g]; i < groups.first[g + 1]; ++i) {
      const double s = groups.smooth_s[i], weight = groups.weights[i], r = std::sqrt(1.5 * s);
      if (s == 0) add(groups.points[i], 0, weight);
      for (int k = 0; k < 6 && s > 0; ++k)
        add(groups.points[i] + (k % 2 ? r : -r) * Vec3::Unit(k / 2), s, weight / 6);
    }
  }
  spread.finish();
  return spread;
}

MeshSystem::FixedMotion FemRemainder::kelvin_motion() const {
  return [poisson = poisson_](const Vec3& X, const PointGroups& b, std::size_t g) {
    Mat3 sum = Mat3::Zero();
    for (std::uint32_t p = b.first[g]; p < b.first[g + 1]; ++p)
      sum += b.weights[p] * kelvin(X - b.points[p], b.s[p], poisson);
    return sum;
  };
}

Remainder::Parts FemRemainder::between(const PointGroups& a, const PointGroups& b) const {
  const PointGroups at_a = loads(a), at_b = loads(b);
  return {unbounded_.between(at_a, at_b, kelvin_motion()), tissue_.between(at_a, at_b, {})};
}

Remainder::Parts FemRemainder::fields(std::span<const Vec3> X, const PointGroups& b,
                                      const Eigen::MatrixXd& forces) const {
  const PointGroups at_places = loads(PointGroups::single(X, 0)), at_b = loads(b);
  return {unbounded_.fields(at_places, at_b, forces, kelvin_motion()),
          tissue_.fields(at_places, at_b, forces, {})};
}

}  // namespace brachy
