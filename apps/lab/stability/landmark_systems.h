#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/lab/stability/stability_scene.h"
#include "core/kernels/kernels.h"

namespace brachy {

/// A condition number above this is a singular system: of sixteen digits four are left.
inline constexpr double kSingular = 1e12;
/// A landmark farther than this from its prescribed position is missed, mm.
inline constexpr double kMissed = 1e-3;

/// Landmarks at unit spacing: n along z.
std::vector<Vec3> unit_shaft(std::size_t n);
/// per_side³, cubic.
std::vector<Vec3> unit_grid(std::size_t per_side);
/// The same, each coordinate moved by up to ±0.2: seeded, the same on every machine.
std::vector<Vec3> jittered_grid(std::size_t per_side);
/// q: the least distance of two of them.
double least_spacing(const std::vector<Vec3>& points);

/// K_ij = ψ(|p_i − p_j| / a), n × n.
Eigen::MatrixXd psi_matrix(const Kernel& kernel, double support, const std::vector<Vec3>& positions);

struct Spectrum {
  double least, largest;  ///< of |eigenvalues|
  double condition() const { return largest / least; }
};
Spectrum spectrum(const Eigen::MatrixXd& symmetric);

/// The solution in `Scalar` (float, double) of a symmetric system for displacements of up to ±5 mm, drawn once: by
/// Cholesky, or by LU where the system is not definite.
struct Solved {
  bool has_factor;
  double missed;  ///< largest distance of a landmark from its prescribed position, mm
};
template <class Scalar>
Solved solve_in(const Eigen::MatrixXd& matrix, bool is_definite);

/// Landmark systems that become worse conditioned as a parameter runs from `from` to `to`.
struct SystemFamily {
  /// For one value of the parameter; nothing where the method itself refuses the landmarks.
  using Matrix = std::function<std::optional<Eigen::MatrixXd>(double value)>;

  std::string method = {}, landmarks = {}, parameter = {};
  double from = 0, to = 0;
  bool is_definite = true;
  Matrix matrix = {};
  /// n over the λmin of core/DESIGN.md, section 4, where it has one: no eigenvalue is above n, and one is
  /// near it once the support is much wider than the landmarks.
  std::function<double(double value)> condition_by_theory = {};
};
/// Spacing against support, core or needle, of every method that solves a system. The scene must outlive them.
std::vector<SystemFamily> system_families(StabilityScene& scene);

/// `n` points in an unbounded solid, each with a core radius of 2.5 mm (the example of core/DESIGN.md,
/// section 4), on a line.
SystemFamily core_line(const ElasticBody& body, std::size_t n);

/// The first value on the way from `from` to `to`, by factors of 1.3 and then by bisection to `within` of itself, at
/// which `fails`.
std::optional<double> first_failure(double from, double to, const std::function<bool(double)>& fails,
                                    double within = 0.01);

}  // namespace brachy
