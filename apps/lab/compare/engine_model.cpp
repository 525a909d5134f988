#include "apps/lab/compare/engine_model.h"

#include <algorithm>
#include <stdexcept>

#include "apps/lab/comparators/paper_csrbf.h"
#include "apps/lab/compare/match_points.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"

namespace brachy {
std::unique_ptr<EngineModel> EngineModel::psi(Kernel kernel, double support_radius, bool has_anchors,
                                              Sparing sparing) {
  const auto make = [=](const Tissue& tissue, const ElasticBody&, std::size_t landmarks) {
    BlockField::Options options;
    options.max_landmarks = landmarks;
    return std::make_unique<ScalarKernelField>(tissue, kernel, support_radius, options);
  };
  return std::unique_ptr<EngineModel>(new EngineModel(make, has_anchors, true, sparing));
}

std::unique_ptr<EngineModel> EngineModel::matrix(const std::string& model_name, Sparing sparing) {
  const auto make = [=](const Tissue& tissue, const ElasticBody& body, std::size_t landmarks) {
    MatrixKernelField::Options options;
    options.max_landmarks = landmarks;
    return std::make_unique<MatrixKernelField>(tissue, model_name, body, options);
  };
  return std::unique_ptr<EngineModel>(new EngineModel(make, false, false, sparing));
}

void EngineModel::set_up(const ComparedScene& scene) {
  kept_.clear();
  for (std::size_t i = 0; i < scene.landmarks.size(); i += sparing_.every) kept_.push_back(i);
  if (kept_.back() + 1 < scene.landmarks.size()) kept_.push_back(scene.landmarks.size() - 1);
  std::vector<Vec3> positions;
  for (const std::size_t i : kept_) positions.push_back(scene.landmarks[i]);
  if (has_anchors_)
    for (const Vec3& anchor : paper_anchors(scene.body, scene.landmarks)) positions.push_back(anchor);
  landmarks_.assign(positions);
  const std::size_t count =
      sparing_.points > 0 ? std::min(sparing_.points, scene.points.size()) : scene.points.size();
  const std::vector<Vec3> points(scene.points.begin(),
                                 scene.points.begin() + static_cast<std::ptrdiff_t>(count));
  tissue_ = build_tissue({}, points);
  order_ = match_points(tissue_.rest_vertices, points);
  field_ = make_field_(tissue_, scene.body, positions.size());
}

void EngineModel::tick(std::span<const Vec3> displacements) {
  for (std::size_t k = 0; k < kept_.size(); ++k) landmarks_.displacements[k] = displacements[kept_[k]];
  landmarks_.settle();
  if (!field_->update(landmarks_)) throw std::runtime_error("the landmarks' matrix is singular to rounding");
}

bool EngineModel::move(std::span<const Vec3> landmarks) {
  for (std::size_t k = 0; k < kept_.size(); ++k) landmarks_.positions[k] = landmarks[kept_[k]];
  landmarks_.number();
  return true;
}

void EngineModel::read(std::span<Vec3> u) const {
  std::ranges::fill(u, Vec3::Zero());
  for (const std::uint32_t b : field_->touched()) {
    const Block& block = tissue_.blocks[b];
    const auto& moved = field_->displacement(b);
    for (std::uint32_t i = 0; i < block.count; ++i)
      u[order_[block.first + i]] = Vec3(moved.ux[i], moved.uy[i], moved.uz[i]);
  }
}

std::vector<Vec3> EngineModel::displacements_at(std::span<const Vec3> X) const {
  std::vector<Vec3> u;
  for (const Vec3& x : X) u.push_back(field_->displacement_at(x));
  return u;
}

}  // namespace brachy
