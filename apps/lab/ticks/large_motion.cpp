#include "apps/lab/ticks/large_motion.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>

#include "apps/lab/compare/reference_scene.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlobsOfLandmark = 3;  // of a shaft's forces, which stand 1 mm apart

Vec3 vector_at(std::span<const double> row, std::size_t first) {
  return {row[first], row[first + 1], row[first + 2]};
}

/// The header of field.csv, x,y,z,dx2,dy2,dz2,dx4,…, and its levels.
std::string read_header(const fs::path& file, std::vector<LargeMotion::Level>& levels) {
  std::ifstream in(file);
  std::string header;
  std::getline(in, header);
  if (!header.empty() && header.back() == '\r') header.pop_back();
  for (std::size_t at = header.find(",dx"); at != std::string::npos; at = header.find(",dx", at + 1)) {
    double level = 0;
    const auto [end, error] = std::from_chars(header.data() + at + 3, header.data() + header.size(), level);
    if (error != std::errc())
      throw UserError(file.string() + ":1: '" + header.substr(at + 1) +
                      "' names no level; write it with apps/lab/reference/run.py");
    levels.emplace_back().motion_mm = level;
  }
  if (levels.empty())
    throw UserError(file.string() +
                    ": has no columns dx2,dy2,dz2 or the like; write it with apps/lab/reference/run.py");
  return header;
}

void read_field(const fs::path& file, LargeMotion& motion) {
  const NumberTable table = load_number_csv(file, read_header(file, motion.levels));
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto row = table.row(i);
    motion.given.points.push_back(vector_at(row, 0));
    for (std::size_t k = 0; k < motion.levels.size(); ++k)
      motion.levels[k].field.push_back(vector_at(row, 3 + 3 * k));
  }
}

/// landmarks.csv has the displacements of the last level; the others are in proportion.
void read_landmarks(const fs::path& file, LargeMotion& motion) {
  const NumberTable table = load_number_csv(file, "x,y,z,dx,dy,dz");
  std::vector<Vec3> last;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    motion.given.landmarks.push_back(vector_at(table.row(i), 0));
    last.push_back(vector_at(table.row(i), 3));
  }
  for (LargeMotion::Level& level : motion.levels)
    for (const Vec3& d : last)
      level.given_displacements.push_back(level.motion_mm / motion.levels.back().motion_mm * d);
}

/// A simulated needle has one landmark where it presses on the capsule, as the law says.
void set_indentation(const Vec3& contact, LargeMotion& motion) {
  motion.landmarks = motion.given.landmarks = {contact};
  const TissueContact& capsule = motion.scene.tissue.contact;
  for (LargeMotion::Level& level : motion.levels) {
    level.displacements = level.given_displacements = {level.motion_mm * Vec3::UnitZ()};
    level.spreads = {{.stiffness_n_per_mm = capsule.indentation_stiffness_n_per_mm(level.motion_mm),
                      .axis = Vec3::UnitZ()}};
  }
}

/// A rigid sphere is six landmarks at 0.6 of its radius R, with cores of R. One with a core of 1.5 R has its
/// resistance, and 3.4 times its quadrupole: 10.6 to 11.8 % off for a radius of 4 mm.
void set_sphere(const Vec3& centre, LargeMotion& motion) {
  const double radius = motion.given.body.needle_radius;
  for (Eigen::Index k = 0; k < 6; ++k)
    motion.landmarks.push_back(centre + (k % 2 ? 0.6 : -0.6) * radius * Vec3::Unit(k / 2));
  for (LargeMotion::Level& level : motion.levels) {
    level.displacements.assign(motion.landmarks.size(), level.motion_mm * Vec3::UnitZ());
    level.spreads.assign(motion.landmarks.size(), {.core_mm = radius});
  }
}

/// The stated forces on landmarks: of the shaft's blobs, from the tip back, a few each; and the tip's with its core.
void read_forces(const fs::path& file, LargeMotion& motion) {
  const NumberTable table = load_number_csv(file, "level,x,y,z,fx,fy,fz,core_mm");
  LargeMotion::Level& level = motion.levels.back();
  const double widest_of_shaft = 2 * motion.given.body.needle_radius;
  std::size_t blobs = 0;
  std::optional<std::size_t> tip;
  for (std::size_t i = table.rows(); i-- > 0;) {
    const auto row = table.row(i);
    if (row[7] > widest_of_shaft) {
      tip = i;
      continue;
    }
    if (const auto n = static_cast<double>(blobs++ % kBlobsOfLandmark); n > 0) {
      motion.landmarks.back() = (n * motion.landmarks.back() + vector_at(row, 1)) / (n + 1);
      level.forces.back() += vector_at(row, 4);
    } else {
      motion.landmarks.push_back(vector_at(row, 1));
      level.forces.push_back(vector_at(row, 4));
    }
  }
  level.spreads.resize(motion.landmarks.size());
  if (!tip) return;
  motion.landmarks.push_back(vector_at(table.row(*tip), 1));
  level.forces.push_back(vector_at(table.row(*tip), 4));
  level.spreads.push_back({.core_mm = table.row(*tip)[7], .behind = level.spreads.empty() ? -1 : 0});
}

}  // namespace

LargeMotion load_large_motion(const fs::path& folder) {
  LargeMotion motion;
  motion.name = folder.filename().string();
  motion.scene = load_scene(folder / "scene.toml");
  motion.given.body = load_body(motion.scene);
  read_field(folder / "field.csv", motion);
  fill_gland(motion.given.body, motion.given.points);
  motion.is_by_forces = motion.name.starts_with("insertion") || motion.name.starts_with("withdrawal");
  if (motion.is_by_forces) {
    read_forces(folder / "forces.csv", motion);
    motion.levels.back().motion_mm = 0;
    return motion;
  }
  if (fs::exists(folder / "landmarks.csv")) read_landmarks(folder / "landmarks.csv", motion);
  const Vec3 contact(0, 0, -21);
  if (motion.name.starts_with("sphere")) {
    set_sphere(contact, motion);
    return motion;
  }
  if (motion.given.landmarks.empty()) {
    set_indentation(contact, motion);
    return motion;
  }
  motion.landmarks = motion.given.landmarks;
  for (LargeMotion::Level& level : motion.levels) {
    level.displacements = level.given_displacements;
    level.spreads.resize(motion.landmarks.size());
  }
  return motion;
}

}  // namespace brachy
