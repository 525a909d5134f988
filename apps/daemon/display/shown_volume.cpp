#include "apps/daemon/display/shown_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/volume/nrrd_file.h"

namespace brachy {
namespace {

constexpr double kWords = 65535;

std::string nrrd_vector(const Vec3& v) {
  return "(" + exact_text(v.x()) + "," + exact_text(v.y()) + "," + exact_text(v.z()) + ")";
}

/// Those between which 98 % of the values lie.
std::array<float, 2> window_of(const Volume& volume) {
  std::vector<float> values(volume.values().begin(), volume.values().end());
  const auto at = [&](double share) {
    const auto place =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  return {at(0.01), at(0.99)};
}

}  // namespace

std::optional<Volume> shown_part(const Volume& volume, const Vec3& least, const Vec3& most,
                                 std::size_t most_voxels) {
  const VoxelGrid& grid = volume.grid();
  // The box's corners in indices: of an oblique volume, what holds all of them.
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at((corner & 1) != 0 ? most.x() : least.x(), (corner & 2) != 0 ? most.y() : least.y(),
                  (corner & 4) != 0 ? most.z() : least.z());
    const Vec3 index = volume.index_of(at);
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  std::array<std::size_t, 3> from{};
  VoxelGrid part = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double first = std::max(0.0, std::ceil(low[axis]));
    const double last = std::min(static_cast<double>(grid.size[a]) - 1, std::floor(high[axis]));
    if (!(first <= last)) return std::nullopt;
    from[a] = static_cast<std::size_t>(first);
    part.size[a] = static_cast<std::size_t>(last - first) + 1;
    part.origin += first * grid.steps.col(axis);
  }
  std::vector<float> values;
  values.reserve(part.count());
  for (std::size_t k = 0; k < part.size[2]; ++k)
    for (std::size_t j = 0; j < part.size[1]; ++j)
      for (std::size_t i = 0; i < part.size[0]; ++i)
        values.push_back(volume.value(from[0] + i, from[1] + j, from[2] + k));
  const Volume whole(part, std::move(values));
  if (part.count() <= most_voxels) return whole;
  double step_mm = part.steps.colwise().norm().minCoeff();
  for (;;) {
    step_mm *= 1.1;
    // Sizes first: a mean of all voxels for each step that is tried would take long.
    std::size_t count = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const double own = part.steps.col(static_cast<Eigen::Index>(a)).norm();
      const auto group = static_cast<std::size_t>(std::max(1.0, std::floor(step_mm / own)));
      count *= std::max<std::size_t>(1, part.size[a] / group);
    }
    if (count > most_voxels) continue;
    Volume coarse = whole.coarsened(step_mm);
    if (coarse.grid().count() <= most_voxels) return coarse;
  }
}

std::string shown_text(const Volume& volume) {
  const auto [least, most] = std::ranges::minmax(volume.values());
  const auto window = window_of(volume);
  const double step = most > least ? (double{most} - double{least}) / kWords : 1;
  const VoxelGrid& grid = volume.grid();
  std::string text = "NRRD0004\ntype: unsigned short\ndimension: 3\nspace: right-anterior-superior\nsizes:";
  for (const std::size_t size : grid.size) text += " " + std::to_string(size);
  text += "\nspace directions:";
  for (Eigen::Index axis = 0; axis < 3; ++axis) text += " " + nrrd_vector(grid.steps.col(axis));
  text += "\nendian: little\nencoding: raw\nspace origin: " + nrrd_vector(grid.origin);
  text += "\nvalue_least:=" + exact_text(double{least}) + "\nvalue_step:=" + exact_text(step);
  text += "\nwindow_least:=" + exact_text(double{window[0]}) +
          "\nwindow_most:=" + exact_text(double{window[1]}) + "\n\n";
  text.reserve(text.size() + 2 * volume.values().size());
  for (const float value : volume.values()) {
    const auto word = static_cast<std::uint16_t>(std::lround((double{value} - double{least}) / step));
    text += static_cast<char>(word & 0xff);
    text += static_cast<char>(word >> 8);
  }
  return text;
}

net::DynamicPage volume_page(const Scene& scene, double margin_mm) {
  using enum net::DynamicPage::Access;
  if (scene.display.volume.empty())
    return {kViewer, [] { return net::DynamicPage::Content{204, "application/octet-stream", {}}; }};
  const auto file = scene.resolve(scene.display.volume);
  const NrrdVolume read = read_nrrd_file(file);
  const Vec3 half = 0.5 * scene.box.size_mm + Vec3::Constant(margin_mm);
  const auto part = shown_part(read.volume, scene.box.centre_mm - half, scene.box.centre_mm + half);
  if (!part)
    throw UserError(file.string() +
                    ": has no voxel about the scene's box; is it the image of this patient, in "
                    "its frame? Correct display.volume, or leave it out");
  return {kViewer, [body = std::make_shared<const std::string>(shown_text(*part))] {
            return net::DynamicPage::Content{200, "application/octet-stream", {}, body};
          }};
}

}  // namespace brachy
