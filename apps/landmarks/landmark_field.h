#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/landmarks/landmark_file.h"

namespace brachy {

/// The landmarks are well-formed, but define no field, or no correct one: exit code 3.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What `brachy deform` applies: landmarks of a file, solved with a deformation model in double.
class LandmarkField {
 public:
  /// Reads landmarks and scene, merges duplicate landmarks and solves. Throws UserError, Refused.
  explicit LandmarkField(const LandmarkFieldOptions& options);
  ~LandmarkField();

  std::vector<Vec3> displacements(std::span<const Vec3> X) const;  ///< mm
  std::vector<double> jacobians(std::span<const Vec3> X) const;    ///< det(I + ∇u)

  std::size_t landmarks() const;
  double condition() const;  ///< of the landmark system, 1-norm, estimated
  const std::string& kernel() const;
  std::optional<Vec3> total_force() const;  ///< on the landmarks, N, where the model knows forces

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brachy
