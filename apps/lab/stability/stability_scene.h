#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/kernels/matrix_kernel.h"
#include "core/scene/scene.h"
#include "core/solve/anchors.h"

namespace brachy {

/// Shared by all sweeps: the body they push into, and the kernels, which take a second to create.
/// Threads: one.
class StabilityScene {
 public:
  /// Errors: UserError where a mesh of the scene cannot be used.
  StabilityScene(const Scene& scene, bool is_quick);

  const ElasticBody& body() const { return body_; }
  Vec3 middle() const { return body_.box_centre; }
  double support() const { return support_; }                    ///< a of the ψ kernels, mm
  double landmark_spacing() const { return spacing_; }           ///< on a shaft, mm
  const std::vector<Vec3>& surface() const { return surface_; }  ///< vertices of the tissue's surface, mm
  std::span<const Vec3> anchors() const { return anchors_.positions(); }
  bool is_quick() const { return is_quick_; }

  /// The matrix models that support the body: `elastic` allows one region at most.
  std::vector<std::string> models() const;
  /// The kernel of one of them, created at the first call.
  const MatrixKernel& kernel(const std::string& model_name);

 private:
  ElasticBody body_;
  double support_, spacing_;
  std::vector<Vec3> surface_;
  Anchors anchors_;
  bool is_quick_;
  std::map<std::string, std::unique_ptr<MatrixKernel>> kernels_;
};

}  // namespace brachy
