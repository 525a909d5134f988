#pragma once

#include <span>
#include <vector>

#include "core/elasticity/elastic_body.h"

namespace brachy {

/// The input of a model before the needle moves.
struct ComparedScene {
  ElasticBody body;             ///< box, held faces, moduli, needle radius
  std::vector<Vec3> landmarks;  ///< n on the needle, at rest, mm
  std::vector<Vec3> points;     ///< N whose displacements a tick computes, at rest, mm
};

/// A model as `brachy compare` drives it, ours or another's: set up once for a scene, then one tick for each new set of
/// landmark displacements. Errors: std::runtime_error where the model has no result for the scene.
/// Threads: one caller.
class ComparedModel {
 public:
  virtual ~ComparedModel() = default;

  /// Everything that can be done before the needle moves. The scene must outlive the model.
  virtual void set_up(const ComparedScene& scene) = 0;

  /// The field at the scene's points for landmarks displaced by `displacements` (n, mm). A model with inertia advances
  /// by kTickPeriod, and is called again until it rests.
  virtual void tick(std::span<const Vec3> displacements) = 0;

  /// Other rest positions of the landmarks (n, mm) from the next tick on; false where that needs another set-up.
  virtual bool move(std::span<const Vec3> /*landmarks*/) { return false; }

  /// u at the scene's points after the last tick (N, mm), in their order.
  virtual void read(std::span<Vec3> u) const = 0;

  /// The same field at any points X, mm.
  virtual std::vector<Vec3> displacements_at(std::span<const Vec3> X) const = 0;

  /// det(I + ∇u) at X; by central differences over 2·10⁻³ mm unless a model overrides it.
  virtual std::vector<double> jacobians(std::span<const Vec3> X) const;

  /// Whether the cost of a tick has settled for the landmarks' present rest positions.
  virtual bool is_warm() const { return true; }

  static constexpr double kTickPeriod = 0.005;  ///< s, 200 Hz
};

/// Ticks on with the same displacements (n, mm) until no point moves by more than `at_rest_mm` in a tick; returns all
/// ticks since these displacements, of which the caller made the first. u: the field at rest (N, mm).
/// Errors: std::runtime_error where it does not come to rest.
int come_to_rest(ComparedModel& model, std::span<const Vec3> displacements, double at_rest_mm,
                 std::span<Vec3> u);

}  // namespace brachy
