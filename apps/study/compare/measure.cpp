#include "apps/study/compare/measure.h"

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>

namespace brachy {
namespace {

double thread_cpu_ms() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

std::size_t heap_bytes() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// Ticks with the same displacements until no point moves by more than a ten-thousandth of them; leaves the field in u.
int come_to_rest(ComparedModel& model, std::span<const Vec3> displacements, std::vector<Vec3>& u) {
  constexpr int kMostTicks = 400;
  double size = 0;
  for (const Vec3& d : displacements) size = std::max(size, d.norm());
  std::vector<Vec3> before(u.size());
  model.read(before);
  for (int ticks = 1; ticks < kMostTicks; ++ticks) {
    model.tick(displacements);
    model.read(u);
    double moved = 0;
    for (std::size_t i = 0; i < u.size(); ++i) moved = std::max(moved, (u[i] - before[i]).norm());
    if (moved <= 1e-4 * size) return ticks;
    before.swap(u);
  }
  throw std::runtime_error("does not come to rest");
}

void take_errors(CompareRow& row, const ReferenceScene& scene, const std::vector<Vec3>& u) {
  double wrong = 0, all = 0;
  for (std::size_t i = 0; i < scene.field.size(); ++i) {
    const double error = (u[i] - scene.field[i]).norm();
    wrong += error * error;
    all += scene.field[i].squaredNorm();
    row.max_mm = std::max(row.max_mm, error);
  }
  row.rel_l2 = std::sqrt(wrong / all);
  for (std::size_t i = 0; i < scene.targets.size(); ++i) {
    const double error = (u[scene.field.size() + i] - scene.targets[i]).norm();
    row.target_mm += error / static_cast<double>(scene.targets.size());
    row.target_max_mm = std::max(row.target_max_mm, error);
  }
}

/// Median time of calls of `tick`, which returns its ms.
template <class Tick>
double median_ms(const Effort& effort, Tick tick) {
  std::vector<double> times;
  for (double spent = 0;
       static_cast<int>(times.size()) < effort.least_ticks ||
       (spent < effort.tick_budget_ms && static_cast<int>(times.size()) < effort.most_ticks);
       spent += times.back())
    times.push_back(tick());
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
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
    row.ticks_to_rest = come_to_rest(*model, scene.displacements, u);
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
