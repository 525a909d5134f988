#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"
#include "core/injectivity/certificate.h"

namespace brachy {

/// Writes a time series that ParaView opens: recording.pvd and one mesh_NNNNNN.vtp a time step, each with all points
/// (deformed, mm), the surface's triangles, the interior points as vertices, the point vectors `displacement`, and as
/// field data the certificate's `verdict` and `det_bound` (0 and NaN where nothing is known).
/// The .pvd is complete after every step, so that a killed recorder leaves a readable series.
/// Errors: std::runtime_error when a file cannot be written (full disk).
class ParaviewWriter {
 public:
  ParaviewWriter(std::filesystem::path folder, std::vector<Triangle> triangles,
                 std::vector<float> rest_vertices, std::size_t surface_count);

  /// `deformed_vertices`: 3N as the rest vertices.
  void add(double time_s, const std::vector<float>& deformed_vertices,
           const std::optional<Certificate>& certificate);
  std::size_t steps() const { return steps_; }

 private:
  void write_step(const std::filesystem::path& file, const std::vector<float>& deformed_vertices,
                  const std::optional<Certificate>& certificate);

  std::filesystem::path folder_;
  std::vector<Triangle> triangles_;
  std::vector<float> rest_;
  std::size_t surface_count_;
  std::ofstream index_;
  std::size_t steps_ = 0;
};

}  // namespace brachy
