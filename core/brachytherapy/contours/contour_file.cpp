#include "core/brachytherapy/contours/contour_file.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/base/number_text.h"

namespace brachy {
namespace {

constexpr std::string_view kHeader = "slice,x_mm,y_mm,z_mm";
constexpr double kOutOfPlaneMm = 0.5;  // of a corner
constexpr double kLeastStepMm = 0.5, kOffStep = 0.1;
constexpr double kLeastAreaMm2 = 1, kFarthestMm = 1e4;

/// Corners of one slice, in space.
struct Ring {
  long long slice;
  std::size_t line;  // of its first corner; 0: of no file
  std::vector<Vec3> corners;

  // Newell's: twice the area along the normal, right for any closed polygon.
  Vec3 area_vector() const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < corners.size(); ++k)
      sum += (corners[k] - corners[0]).cross(corners[(k + 1) % corners.size()] - corners[0]);
    return 0.5 * sum;
  }
};

std::string slice_text(const Ring& ring) {
  return "slice " + std::to_string(ring.slice);
}

[[noreturn]] void refuse(const Ring& ring, const std::string& name, const std::string& what) {
  if (ring.line == 0) throw UserError(what);
  refuse_line(name, ring.line, what);
}

// Drawn closed or not, it is closed.
void close(Ring& ring, const std::string& name) {
  if (ring.corners.size() > 1 && ring.corners.back() == ring.corners.front()) ring.corners.pop_back();
  if (ring.corners.size() < 3 || ring.area_vector().norm() < kLeastAreaMm2)
    refuse(ring, name, slice_text(ring) + " encloses no area; give three corners or more around it");
}

std::vector<Ring> rings_of(const NumberTable& table, const std::string& name) {
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto row = table.row(i);
    const std::size_t line = table.lines[i];
    if (row[0] != std::floor(row[0]) || std::abs(row[0]) > 1e6)
      refuse_line(name, line, "slice is no whole number; number the slices");
    const auto slice = static_cast<long long>(row[0]);
    const Vec3 corner(row[1], row[2], row[3]);
    if (corner.cwiseAbs().maxCoeff() > kFarthestMm)
      refuse_line(name, line, "lies more than 10 m away; give mm in the patient's frame");
    if (rings.empty() || rings.back().slice != slice) {
      if (std::ranges::find(rings, slice, &Ring::slice) != rings.end())
        refuse_line(name, line,
                    "slice " + std::to_string(slice) + " begins again; give each slice's corners together");
      if (rings.size() == kMaxSlices)
        refuse_line(name, line, "more than " + std::to_string(kMaxSlices) + " slices; give fewer");
      rings.push_back({slice, line, {}});
    }
    auto& corners = rings.back().corners;
    if (corners.size() == kMaxCorners)
      refuse_line(name, line,
                  "more than " + std::to_string(kMaxCorners) + " corners of slice " + std::to_string(slice) +
                      "; give fewer");
    if (corners.empty() || corners.back() != corner) corners.push_back(corner);
  }
  for (Ring& ring : rings) close(ring, name);
  return rings;
}

/// z: the normal of the largest slice, pointing to the patient's superior, anterior or right, whichever it is
/// nearest to.
RigidTransform frame_of(const std::vector<Ring>& rings) {
  const Ring& largest =
      *std::ranges::max_element(rings, {}, [](const Ring& r) { return r.area_vector().norm(); });
  Vec3 z = largest.area_vector().normalized();
  Eigen::Index axis = 0;
  z.cwiseAbs().maxCoeff(&axis);
  if (z[axis] < 0) z = -z;
  const Vec3 x = (axis == 0 ? Vec3::UnitY() : Vec3::UnitX()) - z * (axis == 0 ? z.y() : z.x());
  RigidTransform X_WS;
  X_WS.R.col(0) = x.normalized();
  X_WS.R.col(1) = z.cross(x).normalized();
  X_WS.R.col(2) = z;
  const double offset = z.dot(largest.corners[0]);
  X_WS.p = offset * z;
  return X_WS;
}

}  // namespace

std::vector<PlaneEdge> Contour::edges() const {
  std::vector<PlaneEdge> all;
  for (std::size_t k = 0; k < corners.size(); ++k)
    all.push_back({corners[k], corners[(k + 1) % corners.size()]});
  return all;
}

namespace {

constexpr NumberCsvLimits kLimits{.max_bytes = std::size_t{64} << 20, .max_rows = kMaxCorners * kMaxSlices};

ContourSet contours_of(std::vector<Ring> rings, const std::string& name) {
  ContourSet set;
  set.X_WS = frame_of(rings);
  const RigidTransform X_SW = set.X_WS.inverse();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    double mean = 0;
    for (Vec3& corner : rings[r].corners) {
      corner = X_SW * corner;
      mean += corner.z() / static_cast<double>(rings[r].corners.size());
    }
    for (const Vec3& corner : rings[r].corners)
      if (std::abs(corner.z() - mean) > kOutOfPlaneMm)
        refuse(rings[r], name,
               slice_text(rings[r]) + " has corners up to " + text_of(std::abs(corner.z() - mean)) +
                   " mm off its plane, or planes are not parallel; outline each in one plane");
    order.emplace_back(mean, r);
  }
  std::ranges::sort(order);
  set.X_WS.p += order.front().first * set.X_WS.R.col(2);
  for (std::size_t k = 1; k < order.size(); ++k) {
    const double step = order[k].first - order[k - 1].first;
    if (step < kLeastStepMm)
      refuse(rings[order[k].second], name,
             slice_text(rings[order[k].second]) + " lies in the plane of slice " +
                 std::to_string(rings[order[k - 1].second].slice) + "; give one outline for each plane");
    set.step_mm = set.step_mm > 0 ? std::min(set.step_mm, step) : step;
  }
  for (const auto& [mean, r] : order) {
    const double offset = mean - order.front().first;
    const double steps = set.step_mm > 0 ? offset / set.step_mm : 0;
    if (std::abs(steps - std::round(steps)) > kOffStep)
      refuse(rings[r], name,
             slice_text(rings[r]) + " lies " + text_of(steps) + " steps of " + text_of(set.step_mm) +
                 " mm from the first; outline planes that are even steps apart");
    Contour& contour = set.contours.emplace_back();
    contour.slice = rings[r].slice;
    contour.offset_mm = offset;
    for (const Vec3& corner : rings[r].corners) contour.corners.push_back(corner.head<2>());
  }
  return set;
}

}  // namespace

ContourSet parse_contours(std::string_view text, const std::string& name) {
  return contours_of(rings_of(parse_number_csv(text, name, kHeader, kLimits), name), name);
}

ContourSet make_contours(const std::vector<OutlinedSlice>& slices) {
  if (slices.empty()) throw UserError("there is no outline; outline a slice");
  if (slices.size() > kMaxSlices)
    throw UserError("more than " + std::to_string(kMaxSlices) + " slices; give fewer");
  std::vector<Ring> rings;
  for (const OutlinedSlice& slice : slices) {
    Ring& ring = rings.emplace_back(Ring{slice.slice, 0, {}});
    if (slice.corners.size() > kMaxCorners)
      throw UserError("more than " + std::to_string(kMaxCorners) + " corners of " + slice_text(ring) +
                      "; give fewer");
    for (const Vec3& corner : slice.corners)
      if (ring.corners.empty() || ring.corners.back() != corner) ring.corners.push_back(corner);
    close(ring, {});
  }
  return contours_of(std::move(rings), {});
}

ContourSet load_contours(const std::filesystem::path& file) {
  return contours_of(rings_of(load_number_csv(file, kHeader, kLimits), file.string()), file.string());
}

}  // namespace brachy
