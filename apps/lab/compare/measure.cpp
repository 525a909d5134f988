#include "apps/lab/compare/measure.h"

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "apps/lab/compare/field_error.h"

namespace brachy {
namespace {

constexpr double kAtRest = 1e-4;  // of the largest displacement, a tick

std::size_t heap_bytes() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

void take_errors(CompareRow& row, const ReferenceScene& scene, const std::vector<Vec3>& u) {
  const auto [rel_l2, max_mm] = field_error(u, scene.field);
  row.rel_l2 = rel_l2;
  row.max_mm = max_mm;
  for (std::size_t i = 0; i < scene.targets.size(); ++i) {
    const double error = (u[scene.field.size() + i] - scene.targets[i]).norm();
    row.target_mm += error / static_cast<double>(scene.targets.size());
    row.target_max_mm = std::max(row.target_max_mm, error);
  }
}

/// Ticks whose displacements vary by a twentieth, after the model has adjusted to them; then with the first landmark,
/// the tip, at another place by up to 0.2 mm each time.
void time_ticks(CompareRow& row, ComparedModel& model, const ReferenceScene& scene, const Effort& effort) {
  constexpr int kMostWarmUp = 200;
  std::vector<Vec3> d = scene.displacements, landmarks = scene.given.landmarks;
  int count = 0;
  const auto tick_ms = [&] {
    const double share = 1 + 0.05 * std::sin(0.7 * ++count);
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = share * scene.displacements[i];
    const double start = thread_cpu_ms();
    model.tick(d);
    return thread_cpu_ms() - start;
  };
  tick_ms();
  for (int i = 0; i < kMostWarmUp && !model.is_warm(); ++i) tick_ms();
  row.tick_ms = median_ms(effort, tick_ms);
  if (!model.move(landmarks)) return;
  row.advance_ms = median_ms(effort, [&] {
    landmarks[0] = scene.given.landmarks[0] + Vec3(0, 0, 0.2 * std::sin(0.7 * count));
    model.move(landmarks);
    return tick_ms();
  });
}

}  // namespace

CompareRow measure(const ModelEntry& entry, const ReferenceScene& scene, const Effort& effort) {
  CompareRow row;
  row.model = entry.name;
  row.family = entry.family;
  row.scene = scene.name;
  row.group = scene.group;
  row.counts = scene.counts();
  row.listed = entry.listed;
  row.kernel = entry.kernel;
  row.support_mm = entry.support_mm;
  row.has_anchors = entry.has_anchors;
  row.is_surface = entry.is_surface;
  if (const auto& p = scene.given.landmarks; p.size() > 1)
    row.landmark_spacing_mm = static_cast<double>(entry.every_landmark) * (p[1] - p[0]).norm();
  try {
    std::vector<Vec3> u(scene.given.points.size());
    const std::size_t heap = heap_bytes();
    const double start = thread_cpu_ms();
    const auto model = entry.make();
    model->set_up(scene.given);
    model->tick(scene.displacements);
    row.setup_ms = thread_cpu_ms() - start;
    double size = 0;
    for (const Vec3& d : scene.displacements) size = std::max(size, d.norm());
    row.ticks_to_rest = come_to_rest(*model, scene.displacements, kAtRest * size, u);
    take_errors(row, scene, u);
    const auto judged = static_cast<std::ptrdiff_t>(scene.field.size() + scene.targets.size());
    const std::vector<double> det =
        model->jacobians({scene.given.points.begin(), scene.given.points.begin() + judged});
    row.min_det = std::ranges::min(det);
    time_ticks(row, *model, scene, effort);
    const std::size_t now = heap_bytes();
    row.bytes = now > heap ? now - heap : 0;
  } catch (const std::exception& e) {
    row.error = e.what();
  }
  return row;
}

}  // namespace brachy
