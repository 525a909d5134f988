#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/geometry/surface/plane_section.h"

namespace brachy {

/// A closed outline in one plane, as somebody drew it.
struct Contour {
  long long slice = 0;        ///< its number in the file
  double offset_mm = 0;       ///< of its plane along the slices' normal, z of S
  std::vector<Vec2> corners;  ///< in S, at least three; the last is joined to the first
  std::vector<PlaneEdge> edges() const;
};

/// A volume study: parallel slices, one outline each, ascending by offset.
struct ContourSet {
  RigidTransform
      X_WS;  ///< S: z across the slices (the patient's superior, as far as it can be), its origin in the first
  double step_mm = 0;  ///< between slices; 0 of one
  std::vector<Contour> contours;
};

/// Reads a CSV `slice,x_mm,y_mm,z_mm`, W (patient RAS): each slice's corners one after another, in order around it.
/// Slices lie in parallel planes, a whole number of steps apart, the step being the least distance of two; corners to
/// 0.5 mm in their plane. At most kMaxCorners of a slice and kMaxSlices.
/// Errors: UserError "name:line: what; fix".
ContourSet parse_contours(std::string_view text, const std::string& name);
ContourSet load_contours(const std::filesystem::path& file);

/// One slice of a study that comes from no file: its corners in W, in order around it.
struct OutlinedSlice {
  long long slice = 0;
  std::vector<Vec3> corners;
};
/// The same checks, of finite corners. Errors: UserError "what; fix".
ContourSet make_contours(const std::vector<OutlinedSlice>& slices);

constexpr std::size_t kMaxCorners = 2000, kMaxSlices = 200;

}  // namespace brachy
