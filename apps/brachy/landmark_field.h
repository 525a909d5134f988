#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/options.h"

namespace brachy {

/// The landmarks are well-formed, but no field can be had from them, or none that would be right: exit code 3.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What `brachy deform` applies: landmarks of a file, solved with a rung of the ladder in double.
class LandmarkField {
 public:
  /// Reads landmarks and scene, merges landmarks that say the same and solves. Throws UserError, Refused.
  explicit LandmarkField(const DeformOptions& options);
  ~LandmarkField();

  std::vector<Vec3> displacements(std::span<const Vec3> X) const;  ///< mm
  std::vector<double> jacobians(std::span<const Vec3> X) const;    ///< det(I + ∇u)

  std::size_t landmarks() const;
  double condition() const;  ///< of the landmark system, 1-norm, estimated
  const std::string& kernel() const;
  std::optional<Vec3> total_force() const;  ///< on the landmarks, N, where the rung knows forces

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy
