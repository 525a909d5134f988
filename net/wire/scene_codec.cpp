// SCENE: what surrounds the tissue.
#include "net/wire/fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kPlannedNeedleBytes = 26, kPlannedSeedBytes = 56, kStructureBytes = 10,
                      kKernelBytes = 2, kGoalBytes = 16, kColourBytes = 6;  // at least
constexpr std::uint16_t kProbeSection = 1, kGoalsSection = 2, kColoursSection = 3, kHolesSection = 4;

void structure_fields(auto& archive, auto& structure) {
  archive.text(structure.name, kMaxNameBytes);
  std::uint32_t vertices = static_cast<std::uint32_t>(structure.vertices.size() / 3);
  archive.u32(vertices);
  const std::uint32_t triangles = archive.u32_count(structure.triangles);
  archive.floats(structure.vertices, 3 * std::uint64_t{vertices});
  archive.items(structure.triangles, triangles, kTriangleBytes, [&](auto& triangle) {
    for (auto& vertex : triangle) {
      archive.u32(vertex);
      archive.check(vertex < vertices, "a structure's triangle names a vertex that is not there");
    }
  });
}

}  // namespace

template <class Archive>
void fields(Archive& archive, MaybeConst<SceneMessage> auto& message) {
  const TemplateGrid& grid = message.template_grid;
  archive.f64(message.needle_length_mm);
  archive.f64(message.needle_diameter_mm);
  archive.f64(message.seed_length_mm);
  archive.f64(message.seed_diameter_mm);
  archive.f64(message.prescription_gy);
  archive.vec3(message.template_grid.origin_mm);
  archive.f64(message.template_grid.spacing_mm);
  archive.u16(message.template_grid.columns);
  archive.u16(message.template_grid.rows);
  archive.reserved(4);
  const std::uint32_t needles = archive.u32_count(message.planned_needles);
  const std::uint32_t seeds = archive.u32_count(message.planned_seeds);
  archive.items(message.planned_needles, needles, kPlannedNeedleBytes, [&](auto& needle) {
    archive.vec3(needle.tip);
    archive.text(needle.hole, kMaxNameBytes);
  });
  archive.items(message.planned_seeds, seeds, kPlannedSeedBytes, [&](auto& seed) {
    archive.vec3(seed.position);
    archive.vec3(seed.axis);
    archive.u32(seed.needle);
    archive.check(seed.needle < needles, "a planned seed names a needle that is not there");
    archive.reserved(4);
  });
  archive.u16_list(message.structures, kStructureBytes,
                   [&](auto& structure) { structure_fields(archive, structure); });
  archive.u16_list(message.kernels, kKernelBytes, [&](auto& kernel) { archive.text(kernel, kMaxNameBytes); });
  archive.sections(Section{kProbeSection, message.probe.has_value(),
                           [&](auto& section) {
                             if constexpr (Archive::kReads) message.probe.emplace();
                             auto& probe = *message.probe;
                             section.u16(probe.needle);
                             section.reserved(6);
                             section.f64(probe.diameter_mm);
                             section.f64(probe.length_mm);
                             section.f64(probe.rectal_wall_mm);
                             section.check(probe.diameter_mm > 0 && probe.length_mm > 0,
                                           "the probe has no size");
                           }},
                   Section{kGoalsSection, !message.goals.empty(),
                           [&](auto& section) {
                             section.u16_list(message.goals, kGoalBytes, [&](auto& goal) {
                               section.text(goal.structure, kMaxNameBytes);
                               section.text(goal.figure, kMaxNameBytes);
                               section.f64(goal.limit);
                               section.u16_bits(goal.is_above, goal.is_of_plan);
                               section.text(goal.source, kMaxTextBytes);
                             });
                           }},
                   Section{kColoursSection, !message.colours.empty(),
                           [&](auto& section) {
                             section.u16_list(message.colours, kColourBytes, [&](auto& colour) {
                               section.text(colour.name, kMaxNameBytes);
                               section.u8(colour.red);
                               section.u8(colour.green);
                               section.u8(colour.blue);
                               section.reserved(1);
                             });
                           }},
                   Section{kHolesSection, !grid.is_named_as(grid.named_as_on_wire()), [&](auto& section) {
                             bool from_right = grid.letters_from == "right", half_steps = grid.half_steps;
                             section.u16_bits(from_right, half_steps);
                             section.reserved(6);
                             if constexpr (Archive::kReads)
                               message.template_grid = grid.named(from_right ? "right" : "left", half_steps);
                           }});
}
BRACHY_CODEC(SceneMessage);

}  // namespace brachy::net
