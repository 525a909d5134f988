#include "apps/import/case/volume_nrrd.h"

#include <bit>

#include "core/base/number_text.h"

namespace brachy {
namespace {

std::string nrrd_vector(const Vec3& v) {
  return "(" + exact_text(v.x()) + "," + exact_text(v.y()) + "," + exact_text(v.z()) + ")";
}

std::string geometry_text(const VoxelGrid& grid, std::size_t layers) {
  const bool has_layers = layers > 1;
  std::string sizes = has_layers ? std::to_string(layers).append(" ") : std::string();
  std::string directions = has_layers ? "none " : "";
  for (int a = 0; a < 3; ++a) {
    sizes += std::to_string(grid.size[static_cast<std::size_t>(a)]) + (a < 2 ? " " : "");
    directions += nrrd_vector(grid.steps.col(a)) + (a < 2 ? " " : "");
  }
  std::string text = "dimension: ";
  text.append(has_layers ? "4" : "3").append("\nspace: right-anterior-superior\nsizes: ").append(sizes);
  text.append("\nspace directions: ").append(directions).append("\nkinds: ");
  text.append(has_layers ? "list domain domain domain" : "domain domain domain");
  return text.append("\nendian: little\nencoding: raw\nspace origin: ")
      .append(nrrd_vector(grid.origin))
      .append("\n");
}

}  // namespace

std::string to_nrrd(const VoxelVolume& volume, const std::string& content, const std::string& units) {
  std::string text = "NRRD0004\ncontent: " + content + "\ntype: float\n" + geometry_text(volume.grid, 1);
  if (!units.empty()) text += "sample units: " + units + "\n";
  text += "\n";
  text.reserve(text.size() + 4 * volume.values.size());
  for (const float value : volume.values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int byte = 0; byte < 4; ++byte) text += static_cast<char>(bits >> (8 * byte) & 0xff);
  }
  return text;
}

std::string to_seg_nrrd(const LabelMap& map) {
  const auto [nx, ny, nz] = map.grid.size;
  std::string text = "NRRD0004\ntype: unsigned char\n" + geometry_text(map.grid, map.layers.size());
  for (std::size_t n = 0; n < map.segments.size(); ++n) {
    const LabelMap::Segment& segment = map.segments[n];
    const std::string key = "Segment" + std::to_string(n) + "_";
    text += key + "ID:=Segment_" + std::to_string(n + 1) + "\n" + key + "Name:=" + segment.name + "\n" + key +
            "LabelValue:=" + std::to_string(segment.value) + "\n" + key +
            "Layer:=" + std::to_string(segment.layer) + "\n" + key + "Extent:=0 " + std::to_string(nx - 1) +
            " 0 " + std::to_string(ny - 1) + " 0 " + std::to_string(nz - 1) + "\n";
    if (segment.colour)
      text += key + "Color:=" + text_of((*segment.colour)[0]) + " " + text_of((*segment.colour)[1]) + " " +
              text_of((*segment.colour)[2]) + "\n";
  }
  text +=
      "Segmentation_ContainedRepresentationNames:=Binary "
      "labelmap|\nSegmentation_MasterRepresentation:=Binary labelmap\n"
      "Segmentation_ReferenceImageExtentOffset:=0 0 0\n\n";
  for (std::size_t voxel = 0; voxel < map.grid.count(); ++voxel)
    for (const auto& layer : map.layers) text += static_cast<char>(layer[voxel]);
  return text;
}

}  // namespace brachy
