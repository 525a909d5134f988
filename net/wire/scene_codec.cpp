// SCENE, what stands around the tissue, and CONTROL, what an operator asks of the simulation.
#include "net/wire/codec.h"
#include "net/wire/sections.h"

namespace brachy::net {
namespace {

constexpr std::uint16_t kLoopFlag = 1;
constexpr std::size_t kPlannedSeedBytes = 56, kTriangleBytes = 12;

void write_structure(ByteWriter& writer, const SceneStructure& structure) {
  writer.text(structure.name, kMaxNameBytes);
  writer.u32(static_cast<std::uint32_t>(structure.vertices.size() / 3));
  writer.u32(static_cast<std::uint32_t>(structure.triangles.size()));
  writer.floats(structure.vertices);
  for (const Triangle& triangle : structure.triangles)
    for (const std::uint32_t vertex : triangle) writer.u32(vertex);
}

void read_structure(ByteReader& reader, SceneStructure& structure) {
  structure.name = reader.text(kMaxNameBytes);
  const std::uint32_t vertices = reader.u32(), triangles = reader.u32();
  if (reader.fits(vertices, 3 * sizeof(float))) reader.floats(3 * std::size_t{vertices}, structure.vertices);
  structure.triangles.clear();
  if (reader.fits(triangles, kTriangleBytes)) structure.triangles.resize(triangles);
  for (Triangle& triangle : structure.triangles)
    for (std::uint32_t& vertex : triangle) {
      vertex = reader.u32();
      if (vertex >= vertices) reader.fail("a structure's triangle names a vertex that is not there");
    }
}

}  // namespace

void encode_body(const ControlMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(static_cast<std::uint16_t>(message.action));
  writer.u16(message.loop ? kLoopFlag : 0);
  writer.u32(0);
  writer.f64(message.support_radius_mm);
  writer.text(message.kernel, kMaxNameBytes);
  write_no_sections(writer);
}

DecodeResult decode_body(std::span<const std::byte> body, ControlMessage& message) {
  ByteReader reader(body);
  message.action = static_cast<ControlAction>(reader.u16());
  message.loop = (reader.u16() & kLoopFlag) != 0;
  reader.u32();
  message.support_radius_mm = reader.f64();
  message.kernel = reader.text(kMaxNameBytes);
  skip_sections(reader);
  return DecodeResult::of(reader);
}

void encode_body(const SceneMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.f64(message.needle_length_mm);
  writer.f64(message.needle_diameter_mm);
  writer.f64(message.seed_length_mm);
  writer.f64(message.seed_diameter_mm);
  writer.f64(message.prescription_gy);
  writer.vec3(message.template_grid.origin_mm);
  writer.f64(message.template_grid.spacing_mm);
  writer.u16(static_cast<std::uint16_t>(message.template_grid.columns));
  writer.u16(static_cast<std::uint16_t>(message.template_grid.rows));
  writer.u32(0);
  writer.u32(static_cast<std::uint32_t>(message.planned_needles.size()));
  writer.u32(static_cast<std::uint32_t>(message.planned_seeds.size()));
  for (const ScenePlannedNeedle& needle : message.planned_needles) {
    writer.vec3(needle.tip);
    writer.text(needle.hole, kMaxNameBytes);
  }
  for (const ScenePlannedSeed& seed : message.planned_seeds) {
    writer.vec3(seed.position);
    writer.vec3(seed.axis);
    writer.u32(seed.needle);
    writer.u32(0);
  }
  writer.u16(static_cast<std::uint16_t>(message.structures.size()));
  writer.u16(0);
  for (const SceneStructure& structure : message.structures) write_structure(writer, structure);
  writer.u16(static_cast<std::uint16_t>(message.kernels.size()));
  writer.u16(0);
  for (const std::string& kernel : message.kernels) writer.text(kernel, kMaxNameBytes);
  write_no_sections(writer);
}

DecodeResult decode_body(std::span<const std::byte> body, SceneMessage& message) {
  ByteReader reader(body);
  message.needle_length_mm = reader.f64();
  message.needle_diameter_mm = reader.f64();
  message.seed_length_mm = reader.f64();
  message.seed_diameter_mm = reader.f64();
  message.prescription_gy = reader.f64();
  message.template_grid.origin_mm = reader.vec3();
  message.template_grid.spacing_mm = reader.f64();
  message.template_grid.columns = reader.u16();
  message.template_grid.rows = reader.u16();
  reader.u32();
  const std::uint32_t needles = reader.u32(), seeds = reader.u32();
  message.planned_needles.clear();
  if (reader.fits(needles, 26)) message.planned_needles.resize(needles);
  for (ScenePlannedNeedle& needle : message.planned_needles) {
    needle.tip = reader.vec3();
    needle.hole = reader.text(kMaxNameBytes);
  }
  message.planned_seeds.clear();
  if (reader.fits(seeds, kPlannedSeedBytes)) message.planned_seeds.resize(seeds);
  for (ScenePlannedSeed& seed : message.planned_seeds) {
    seed.position = reader.vec3();
    seed.axis = reader.vec3();
    seed.needle = reader.u32();
    if (seed.needle >= needles) reader.fail("a planned seed names a needle that is not there");
    reader.u32();
  }
  const std::uint16_t structures = reader.u16();
  reader.u16();
  message.structures.clear();
  if (reader.fits(structures, 10)) message.structures.resize(structures);
  for (SceneStructure& structure : message.structures) read_structure(reader, structure);
  const std::uint16_t kernels = reader.u16();
  reader.u16();
  message.kernels.clear();
  if (reader.fits(kernels, 2)) message.kernels.resize(kernels);
  for (std::string& kernel : message.kernels) kernel = reader.text(kMaxNameBytes);
  skip_sections(reader);
  return DecodeResult::of(reader);
}

}  // namespace brachy::net
