// Consequences of a lattice: a landmark moves the node nearest to it, and is missed by the distance between them;
// ChainMail also depends on the order in which landmarks are given, because a node is moved once, by the first.
#include <algorithm>

#include "apps/lab/comparators/chainmail.h"
#include "apps/lab/comparators/mass_spring.h"
#include "apps/lab/stability/landmark_systems.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {
namespace {

constexpr double kLattice = 4, kMostLatticePush = 40;  // mm

/// How far a landmark `off` mm beside a node is from where a push of 1 mm puts it, at rest.
double missed(ComparedModel& model, const StabilityScene& scene, const Vec3& node, double off) {
  const ComparedScene compared{scene.body(), {node + off * Vec3::UnitX()}, {}};
  model.set_up(compared);
  const Vec3 push = Vec3::UnitZ();
  for (int tick = 0; tick < 20; ++tick) model.tick(std::vector{push});
  return (model.displacements_at(compared.landmarks).front() - push).norm();
}

void sweep_off_node(const StabilityScene& scene, StabilityReport& report) {
  const Lattice lattice(scene.body().box_centre, scene.body().box_size, kLattice);
  const Vec3 node = lattice.position(lattice.nearest(scene.middle()));
  const auto sweep = [&](const char* name, const auto& make) {
    report.rows.push_back({.method = name,
                           .sweep = "distance of a landmark from the nearest node",
                           .parameter = "mm",
                           .at_failure = first_failure(
                               1e-3, 0.5 * kLattice,
                               [&](double off) {
                                 auto model = make();
                                 return missed(model, scene, node, off) > kMissed;
                               },
                               0.05),
                           .swept_to = 0.5 * kLattice,
                           .kind = "inaccurate"});
  };
  sweep("mass_spring", [] { return MassSpring(kLattice); });
  sweep("chainmail", [] { return ChainMail(kLattice); });
}

/// Two contacts that pull the links between them apart.
void sweep_order(const StabilityScene& scene, StabilityReport& report) {
  const ElasticBody& body = scene.body();
  const Lattice lattice(body.box_centre, body.box_size, kLattice);
  ChainMailLattice mail(lattice, {});
  for (std::size_t node = 0; node < lattice.size(); ++node)
    if (lattice.is_held(node, body)) mail.hold(node);
  const auto depends = [&](double push) {
    std::vector<ChainMailLattice::Move> moves = {
        {lattice.nearest(scene.middle() + Vec3(2 * kLattice, 0, 0)), push * Vec3(1, 0, 1).normalized()},
        {lattice.nearest(scene.middle() - Vec3(2 * kLattice, 0, 0)), push * Vec3(-1, 0, 1).normalized()}};
    mail.deform(moves);
    const auto before = mail.displacements();
    std::ranges::reverse(moves);
    mail.deform(moves);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t node = 0; node < lattice.size(); ++node)
        if (std::abs(before[axis][node] - mail.displacements()[axis][node]) > kMissed) return true;
    return false;
  };
  report.rows.push_back({.method = "chainmail",
                         .sweep = "push, two contacts given in either order",
                         .parameter = "mm",
                         .at_failure = first_failure(0.01, kMostLatticePush, depends),
                         .swept_to = kMostLatticePush,
                         .kind = "order"});
}

}  // namespace

void sweep_lattice(StabilityScene& scene, StabilityReport& report) {
  sweep_off_node(scene, report);
  sweep_order(scene, report);
}

}  // namespace brachy
