#include "core/elasticity/landmark_compliance.h"

#include <algorithm>

namespace brachy {

void LandmarkCompliance::reserve(std::size_t landmarks, std::size_t beams) {
  points_.reserve(landmarks);
  beams_.reserve(beams);
}

void LandmarkCompliance::clear() noexcept {
  points_.clear();
  beams_.clear();
  body_.reset();
  sliding_ = 0;
}

std::int32_t LandmarkCompliance::add_beam(const Beam& beam) noexcept {
  beams_.push_back(beam);
  return static_cast<std::int32_t>(beams_.size()) - 1;
}

void LandmarkCompliance::remove_landmark(std::size_t i) noexcept {
  sliding_ -= points_[i].slides_on != Vec3::Zero();
  points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(i));
}

void LandmarkCompliance::add_without_beams_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept {
  if (body_) add_body_to(K, scale);
  for (std::size_t i = 0; i < points_.size() && sliding_ > 0; ++i) {
    const Vec3& n = points_[i].slides_on;
    if (n == Vec3::Zero()) continue;
    const auto at = static_cast<Eigen::Index>(3 * i);
    K.block<3, 3>(at, at) += scale * kSliding * (Mat3::Identity() - n * n.transpose());
  }
}

bool LandmarkCompliance::is_alike_without_beams(const LandmarkCompliance& other) const noexcept {
  return body_ == other.body_ &&
         std::ranges::equal(points_, other.points_, [](const Point& a, const Point& b) {
           return a.arm == b.arm && a.slides_on == b.slides_on;
         });
}

void LandmarkCompliance::add_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept {
  add_without_beams_to(K, scale);
  for (std::size_t j = 0; j < points_.size() && !is_empty(); ++j) {
    if (points_[j].beam < 0) continue;
    const Beam& beam = beams_[static_cast<std::size_t>(points_[j].beam)];
    const Mat3 across = scale * (Mat3::Identity() - beam.axis * beam.axis.transpose());
    for (std::size_t i = j; i < points_.size(); ++i) {
      if (points_[i].beam != points_[j].beam) continue;
      K.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) +=
          beam.compliance(points_[i].arc_mm, points_[j].arc_mm) * across;
    }
  }
}

// A force f at arm a moves a point at arm b by T f + (R (a × f)) × b, T and R the body's compliances.
void LandmarkCompliance::add_body_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept {
  const auto cross = [](const Vec3& a) {
    return (Mat3() << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0).finished();
  };
  const Mat3 translation = scale * body_->head<3>().asDiagonal().toDenseMatrix();
  for (std::size_t j = 0; j < points_.size(); ++j) {
    const Mat3 turned = scale * body_->tail<3>().asDiagonal() * cross(points_[j].arm);
    for (std::size_t i = j; i < points_.size(); ++i)
      K.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) +=
          translation - cross(points_[i].arm) * turned;
  }
}

Vec6 LandmarkCompliance::body_motion(std::span<const Vec3> forces) const noexcept {
  Vec6 load = Vec6::Zero();
  if (!body_) return load;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    load.head<3>() += forces[i];
    load.tail<3>() += points_[i].arm.cross(forces[i]);
  }
  return body_->cwiseProduct(load);
}

void LandmarkCompliance::subtract(std::span<const Vec3> forces,
                                  std::span<Vec3> displacements) const noexcept {
  if (body_) {
    const Vec6 motion = body_motion(forces);
    for (std::size_t i = 0; i < points_.size(); ++i) displacements[i] -= moved_by(motion, points_[i].arm);
  }
  for (std::size_t i = 0; i < points_.size() && sliding_ > 0; ++i) {
    const Vec3& n = points_[i].slides_on;
    if (n != Vec3::Zero()) displacements[i] -= kSliding * (forces[i] - forces[i].dot(n) * n);
  }
  for (std::size_t b = 0; b < beams_.size(); ++b) subtract_beam(b, forces, displacements);
}

void LandmarkCompliance::subtract_beam(std::size_t b, std::span<const Vec3> forces,
                                       std::span<Vec3> displacements) const noexcept {
  const Beam& beam = beams_[b];
  const auto is_on = [&](std::size_t i) { return points_[i].beam == static_cast<std::int32_t>(b); };
  const auto across = [&](const Vec3& v) { return Vec3(v - v.dot(beam.axis) * beam.axis); };
  Vec3 guide = Vec3::Zero();  // what its hole takes of all forces
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!is_on(i)) continue;
    const Vec3 force = across(forces[i]);
    const double arc = points_[i].arc_mm;
    guide += beam.guide_share(arc) * force;
    displacements[i] -= beam.unguided(arc, arc) * force;
    for (std::size_t j = 0; j < i; ++j) {
      if (!is_on(j)) continue;
      const double both_ways = beam.unguided(arc, points_[j].arc_mm);
      displacements[i] -= both_ways * across(forces[j]);
      displacements[j] -= both_ways * force;
    }
  }
  if (beam.guide_mm > 0)
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (is_on(i)) displacements[i] += beam.unguided(points_[i].arc_mm, beam.guide_mm) * guide;
}

}  // namespace brachy
