#include "apps/lab/ticks/tick_errors.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>
#include <Eigen/LU>

#include "apps/lab/compare/field_error.h"
#include "apps/lab/compare/match_points.h"
#include "apps/lab/compare/timing.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/models/step_flag.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/make_guarded_field.h"

namespace brachy {
namespace {

// mm, of the ψ kernels that "auto" chooses among; 12 is the default.
constexpr double kSupports[] = {6, 8, 12, 16, 24, 32, 48, 64, 96};

constexpr double kAtRest = 1e-3;    // mm a tick
constexpr double kHand = 0.25;      // mm a tick: 50 mm/s at 200 Hz
constexpr double kFarthest = 1000;  // mm, of a hand's way: 20 s

TickRow row_of(const LargeMotion& motion, const LargeMotion::Level& level, const std::string& model) {
  TickRow row;
  row.model = model;
  row.scene = motion.name;
  row.motion_mm = level.motion_mm;
  return row;
}

/// `u`: at the scene's points, of which the field's come first.
void take_errors(TickRow& row, const LargeMotion::Level& level, const std::vector<Vec3>& u) {
  const auto [rel_l2, max_mm] = field_error(u, level.field);
  row.rel_l2 = rel_l2;
  row.max_mm = max_mm;
}

/// A row a level, with the error that stopped the model.
std::vector<TickRow> failed(const LargeMotion& motion, const std::string& model, const std::string& error) {
  std::vector<TickRow> rows;
  for (const LargeMotion::Level& level : motion.levels) rows.push_back(row_of(motion, level, model));
  for (TickRow& row : rows) row.error = error;
  return rows;
}

constexpr std::uint64_t kLeastSurface = 100;  // vertices

/// The daemon's field for a scene, on a phantom of the gland's size that has the scene's points inside.
class ShownField {
 public:
  ShownField(const ShownModel& model, const LargeMotion& motion)
      : landmarks_(motion.landmarks), needle_landmarks_(motion.landmarks.size()) {
    Scene scene = motion.scene;
    scene.model.kernel = model.kernel;
    if (model.support_mm > 0) scene.model.support_radius_mm = model.support_mm;
    std::vector<Vec3> points = motion.given.points;
    if (model.is_surface) {
      points.resize(motion.levels.front().field.size());
      scene.tissue.phantom_surface_vertices = kLeastSurface;
    }
    if (!scene.regions.empty()) scene.tissue.phantom_size_mm = 2 * scene.regions.front().semi_axes_mm;
    scene.tissue.points = scene.tissue.phantom_surface_vertices;
    // A reference may have more needles than its scene, and their landmarks closer.
    const int landmarks = static_cast<int>(motion.landmarks.size());
    scene.contact.max_landmarks = std::max(scene.contact.max_landmarks, landmarks);
    const Tissue phantom = load_tissue(scene).tissue;
    model_ = load_simulation_model(scene, build_tissue({phantom.rest_vertices, phantom.triangles}, points));
    for (const Vec3& anchor : model_->anchors.positions())
      if (std::ranges::none_of(motion.landmarks, [&](const Vec3& p) {
            return (p - anchor).norm() < scene.anchors.clearance_mm;
          }))
        landmarks_.push_back(anchor);
    field_ = make_guarded_field(*model_);
    const std::span<const Vec3> vertices = model_->tissue.rest_vertices;
    order_ = match_points(vertices.subspan(model_->tissue.surface_count), points);
  }

  /// update() in every tick of a hand's straight way from the displacements `from` to `to` (m each, mm). What a tick
  /// has no time for, by count, is then as old as a user sees it. Throws std::runtime_error for a way of more than
  /// kFarthest, and as update.
  void approach(const std::vector<Vec3>& from, const std::vector<Vec3>& to,
                const std::vector<LandmarkSpread>& spreads) {
    double way = 0;
    for (std::size_t i = 0; i < to.size(); ++i) way = std::max(way, (to[i] - from[i]).norm());
    if (!(way <= kFarthest))
      throw std::runtime_error(
          fmt::format("the landmarks move by {:g} mm to the next level, at most {:g}", way, kFarthest));
    const int ticks = std::max(1, static_cast<int>(std::ceil(way / kHand)));
    std::vector<Vec3> d = to;
    for (int tick = 1; tick < ticks; ++tick) {
      const double share = static_cast<double>(tick) / ticks;
      for (std::size_t i = 0; i < d.size(); ++i) d[i] = from[i] + share * (to[i] - from[i]);
      update(d, spreads);
    }
    update(to, spreads);
  }

  /// Evaluates the field of displacements (m, mm). Throws std::runtime_error where the model refuses them.
  void update(const std::vector<Vec3>& displacements, const std::vector<LandmarkSpread>& spreads) {
    set_.assign(landmarks_, displacements, spreads);
    if (!field_->update(set_)) throw std::runtime_error("the landmarks' matrix is singular to rounding");
  }

  /// The displacements (m, mm) that forces (m, N) on the needle's landmarks cause, by the model's own compliance.
  std::vector<Vec3> displacements_of(const std::vector<Vec3>& forces,
                                     const std::vector<LandmarkSpread>& spreads) {
    TissueField& plain = field_->plain_field();
    set_.assign(landmarks_, {}, spreads);
    if (!plain.factorize(set_)) throw std::runtime_error("the landmarks' matrix is singular to rounding");
    const auto rows = static_cast<Eigen::Index>(3 * needle_landmarks_);
    Eigen::MatrixXd stiffness(rows, rows);
    std::vector<Vec3> unit(landmarks_.size(), Vec3::Zero()), reactions(landmarks_.size());
    for (Eigen::Index column = 0; column < rows; ++column) {
      Vec3& moved = unit[static_cast<std::size_t>(column / 3)];
      moved = Vec3::Unit(column % 3);
      plain.solve(unit, reactions);
      moved.setZero();
      for (std::size_t i = 0; i < needle_landmarks_; ++i)
        stiffness.block<3, 1>(static_cast<Eigen::Index>(3 * i), column) = reactions[i];
    }
    Eigen::VectorXd given(rows);
    for (std::size_t i = 0; i < needle_landmarks_; ++i)
      given.segment<3>(static_cast<Eigen::Index>(3 * i)) = forces[i];
    const Eigen::VectorXd solved = stiffness.partialPivLu().solve(given);
    std::vector<Vec3> displacements;
    for (std::size_t i = 0; i < needle_landmarks_; ++i)
      displacements.emplace_back(solved.segment<3>(static_cast<Eigen::Index>(3 * i)));
    return displacements;
  }

  /// What a viewer is shown at the scene's points, mm, in their order.
  std::vector<Vec3> read() const {
    std::vector<Vec3> u(order_.size(), Vec3::Zero());
    const std::size_t surface = model_->tissue.surface_count;
    for (const std::uint32_t b : field_->touched()) {
      const Block& block = model_->tissue.blocks[b];
      if (block.first < surface) continue;
      const auto& moved = field_->displacement(b);
      for (std::uint32_t i = 0; i < block.count; ++i)
        u[order_[block.first - surface + i]] = Vec3(moved.ux[i], moved.uy[i], moved.uz[i]);
    }
    return u;
  }

  /// Another rest position of the last of the needle's landmarks, mm.
  void move_last(const Vec3& position) { landmarks_[needle_landmarks_ - 1] = position; }

  const GuardedField& field() const { return *field_; }
  bool has_anchors() const {
    return model_->settings.anchors.count > 0 && landmarks_.size() > needle_landmarks_;
  }

 private:
  std::vector<Vec3> landmarks_;  // the needle's, then anchors, which stay
  LandmarkSet set_;              // of them
  std::size_t needle_landmarks_;
  std::shared_ptr<const SimulationModel> model_;
  std::unique_ptr<GuardedField> field_;
  std::vector<std::uint32_t> order_;  // of the tissue's inner points in the scene's
};

/// Median time of calls of `evaluate` with displacements that differ a little each time.
template <class Evaluate>
double evaluation_ms(std::span<const Vec3> displacements, int repeats, Evaluate evaluate) {
  std::vector<Vec3> d(displacements.size());
  int count = 0;
  const Effort effort{.tick_budget_ms = 0, .least_ticks = repeats, .most_ticks = repeats};
  return median_ms(effort, [&] {
    const double share = 1 + 0.01 * std::sin(0.7 * ++count);
    std::ranges::transform(displacements, d.begin(), [&](const Vec3& v) -> Vec3 { return share * v; });
    const double start = thread_cpu_ms();
    evaluate(d);
    return thread_cpu_ms() - start;
  });
}

}  // namespace

std::vector<ShownModel> default_models() {
  std::vector<ShownModel> models;
  for (const std::string& name : all_model_names()) models.push_back({.name = name, .kernel = name});
  return models;
}

std::vector<ShownModel> models_to_choose_from() {
  constexpr int kRepeats = 9;
  std::vector<ShownModel> models;
  for (const bool surface : {false, true})
    for (const std::string& name : all_model_names()) {
      const std::string suffix = surface ? "_surface" : "";
      if (is_matrix_model(name)) {
        models.push_back({name + suffix, name, 0, surface, kRepeats});
        continue;
      }
      for (const double support : kSupports)
        models.push_back(
            {fmt::format("{}_a{:g}{}", name, support, suffix), name, support, surface, kRepeats});
    }
  return models;
}

std::vector<TickRow> measure_ticks(const ShownModel& model, const LargeMotion& motion) {
  std::vector<TickRow> rows;
  try {
    ShownField shown(model, motion);
    std::vector<Vec3> last(motion.landmarks.size(), Vec3::Zero());
    for (const LargeMotion::Level& level : motion.levels) {
      const std::vector<Vec3> displacements =
          motion.is_by_forces ? shown.displacements_of(level.forces, level.spreads) : level.displacements;
      shown.approach(last, displacements, level.spreads);
      last = displacements;
      TickRow& row = rows.emplace_back(row_of(motion, level, model.name));
      row.kernel = model.kernel;
      row.support_mm = model.support_mm;
      row.is_surface = model.is_surface;
      row.has_anchors = shown.has_anchors();
      if (motion.landmarks.size() > 1)
        row.landmark_spacing_mm = (motion.landmarks[1] - motion.landmarks[0]).norm();
      take_errors(row, level, shown.read());
      const Certificate& certificate = shown.field().certificate();
      for (std::size_t i = 0; i < displacements.size(); ++i)
        row.missed_mm = std::max(
            row.missed_mm, (shown.field().displacement_at(motion.landmarks[i]) - displacements[i]).norm());
      row.verdict = to_string(certificate.verdict);
      row.vertex_det = certificate.vertex_det;
      row.held_mm = certificate.held_mm;
      row.substeps = certificate.substeps;
      row.is_late = (shown.field().flags() & kStepLate) != 0;
      if (model.repeats == 0) continue;
      row.evaluation_ms =
          evaluation_ms(displacements, model.repeats, [&, k = 0](const std::vector<Vec3>& d) mutable {
            // All of these landmarks are in the tissue, as a daemon's are; and each tick has another set.
            if (motion.is_by_forces)
              shown.move_last(motion.landmarks.back() - Vec3(0, 0, 0.2 * (1 + std::sin(0.7 * ++k))));
            shown.update(d, level.spreads);
          });
      shown.move_last(motion.landmarks.back());
    }
  } catch (const std::exception& e) {
    return failed(motion, model.name, e.what());
  }
  return rows;
}

std::vector<TickRow> measure_comparator(const ModelEntry& comparator, const LargeMotion& motion,
                                        int repeats) {
  std::vector<TickRow> rows;
  try {
    const auto model = comparator.make();
    model->set_up(motion.given);
    std::vector<Vec3> u(motion.given.points.size());
    for (const LargeMotion::Level& level : motion.levels) {
      model->tick(level.given_displacements);
      come_to_rest(*model, level.given_displacements, kAtRest, u);
      rows.push_back(row_of(motion, level, comparator.name));
      rows.back().is_in_daemon = false;
      take_errors(rows.back(), level, u);
      rows.back().evaluation_ms = evaluation_ms(level.given_displacements, repeats,
                                                [&](const std::vector<Vec3>& d) { model->tick(d); });
    }
  } catch (const std::exception& e) {
    rows = failed(motion, comparator.name, e.what());
    for (TickRow& row : rows) row.is_in_daemon = false;
  }
  return rows;
}

}  // namespace brachy
