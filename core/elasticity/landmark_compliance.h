#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/elasticity/beam.h"

namespace brachy {

/// Translation and rotation vector of a rigid body; force and moment.
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// What gives way at landmarks besides the tissue's own strain: needles that bend, and what holds the body that the
/// tissue is. With K the tissue's compliance and C this one, forces f on the tissue displace it by K f, the needles by
/// −C f, or the whole body, so that landmarks that would be displaced by d if all but the tissue were rigid have
/// (K + C) f = d. C is positive semidefinite, so K + C is as definite as K.
/// Threads: a plain value. Real-time: no allocation within what was reserved.
class LandmarkCompliance {
 public:
  /// mm/N, across the normal of what slides: a thousand times the tissue's own at least, so that it takes a thousandth
  /// of the force.
  static constexpr double kSliding = 1e3;

  /// What a landmark lies against.
  struct Point {
    std::int32_t beam = -1;   ///< −1: on none
    double arc_mm = 0;        ///< from the hub
    Vec3 arm = Vec3::Zero();  ///< from the point about which the body turns, mm
    /// Unit, if what it lies against gives way across it by kSliding, as a well lubricated surface; 0: it does not
    Vec3 slides_on = Vec3::Zero();

    template <class Archive>
    void list_state(Archive& archive) {
      archive(beam, arc_mm, arm, slides_on);
    }
    bool operator==(const Point&) const = default;
  };

  void reserve(std::size_t landmarks, std::size_t beams);
  void clear() noexcept;
  /// The next landmarks' beam; returns its number.
  std::int32_t add_beam(const Beam& beam) noexcept;
  void add_landmark(const Point& point) noexcept {
    points_.push_back(point);
    sliding_ += point.slides_on != Vec3::Zero();
  }
  /// Removes landmark i.
  void remove_landmark(std::size_t i) noexcept;

  /// What holds the body gives by `compliance` in each direction of translation and rotation: mm/N, rad/(N·mm).
  void set_body(const Vec6& compliance) noexcept { body_ = compliance; }

  std::span<const Beam> beams() const { return beams_; }
  std::span<const Point> points() const { return points_; }                    ///< of landmarks
  bool is_empty() const { return beams_.empty() && !body_ && sliding_ == 0; }  ///< nothing gives
  /// K += scale C, in the lower triangle of the 3n × 3n matrix.
  void add_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept;
  /// The same without the needles, whose part is another in every tick in which they move (BeamColumns).
  void add_without_beams_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept;
  /// Whether add_without_beams_to adds the same for both.
  bool is_alike_without_beams(const LandmarkCompliance& other) const noexcept;
  /// displacements −= C forces (both n, mm, N).
  void subtract(std::span<const Vec3> forces, std::span<Vec3> displacements) const noexcept;
  /// How far the body goes under the landmarks' forces (n, N).
  Vec6 body_motion(std::span<const Vec3> forces) const noexcept;
  /// What a small motion of the body does at a point with that arm, mm.
  static Vec3 moved_by(const Vec6& motion, const Vec3& arm) {
    return motion.head<3>() + motion.tail<3>().cross(arm);
  }
  /// And at landmark i.
  Vec3 moved_with_body(std::size_t i, const Vec6& motion) const {
    return body_ ? moved_by(motion, points_[i].arm) : Vec3(Vec3::Zero());
  }

  bool operator==(const LandmarkCompliance&) const = default;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(beams_, points_, sliding_, body_);
  }

 private:
  void add_body_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept;
  void subtract_beam(std::size_t beam, std::span<const Vec3> forces,
                     std::span<Vec3> displacements) const noexcept;

  std::vector<Beam> beams_;
  std::vector<Point> points_;  // of every landmark
  std::size_t sliding_ = 0;    // of them
  std::optional<Vec6> body_;
};

}  // namespace brachy
