#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/elastic/elastic_body.h"
#include "core/kernels/matrix_kernel.h"
#include "core/rbf/anchors.h"
#include "core/scene/scene.h"

namespace brachy {

/// What all sweeps share: the body they push into, and the kernels that take a second to make.
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

  /// The matrix rungs that can have the body: `elastic` takes one region at most.
  std::vector<std::string> rungs() const;
  /// The kernel of one of them, made when it is first asked for.
  const MatrixKernel& kernel(const std::string& rung);

 private:
  ElasticBody body_;
  double support_, spacing_;
  std::vector<Vec3> surface_;
  Anchors anchors_;
  bool is_quick_;
  std::map<std::string, std::unique_ptr<MatrixKernel>> kernels_;
};

}  // namespace brachy
