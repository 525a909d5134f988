#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "core/kernels/eigenvalue_law.h"
#include "core/kernels/vector_log.h"

namespace brachy {

// The compactly supported kernels ψ(r), r = distance / support radius, positive definite in three dimensions.
// Each is one small functor:
//   kName, kLabel          for scenes and command lines; for charts
//   value(r)               ψ(r): 1 at r = 0, exactly 0 for r ≥ 1
//   inside(r)              the same for 0 ≤ r ≤ 1 only, exactly 0 at 1, without branches: a loop over it vectorises
//   derivative(r)          ψ′(r), exactly 0 for r ≥ 1
//   derivative_over_r(r)   ψ′(r)/r, what a gradient needs: ∇ψ(|x|/a) = (ψ′(r)/r) x/a²; finite at r = 0 for C² kernels
//   inside_over_r(r)       the same for 0 ≤ r ≤ 1 only, without branches
//   over_r_derivatives(r)  its first two derivatives for 0 < r < 1, from which the third derivatives of ψ(|x|) follow
//   kMaxSlope              M = max|ψ′|: one landmark's field is injective iff a > M |d|
//   kEigenvalueLaw         how its system's condition grows (eigenvalue_law.h)
// To add one: README.md of this directory.
// Sources: H. Wendland, Adv. Comput. Math. 4 (1995) 389; M. D. Buhmann, Math. Comp. 70 (2001) 307; as used in the
// paper's equations (2) and (3), with ψ(0) = 1 for Buhmann (the paper prints 0, which is not positive definite).

/// ψ3,0(r) = (1−r)², C⁰: it has a cusp at r = 0, where derivative_over_r is given as 0.
struct Wendland30 {
  static constexpr std::string_view kName = "psi30";
  static constexpr std::string_view kLabel = "ψ3,0";
  static constexpr double kMaxSlope = 2.0;  // at r → 0⁺
  static constexpr EigenvalueLaw kEigenvalueLaw = {
      .power = 1, .on_jittered_grid = 1.17, .on_cubic_grid = 0.77, .on_shaft = 1.0, .condition_of_1000 = 4e4};

  template <class T>
  static T inside(T r) {
    const T t = T(1) - r;
    return t * t;
  }
  template <class T>
  static T value(T r) {
    return r < T(1) ? inside(r) : T(0);
  }
  template <class T>
  static T derivative(T r) {
    return r < T(1) ? T(-2) * (T(1) - r) : T(0);
  }
  template <class T>
  static T derivative_over_r(T r) {
    return r > T(0) ? derivative(r) / r : T(0);
  }
  template <class T>
  static T inside_over_r(T r) {
    return T(-2) * (T(1) - r) / (r > T(1e-6) ? r : T(1e-6));
  }
  static std::array<double, 2> over_r_derivatives(double r) { return {2 / (r * r), -4 / (r * r * r)}; }
};

/// ψ3,1(r) = (1−r)⁴(4r+1), C².
struct Wendland31 {
  static constexpr std::string_view kName = "psi31";
  static constexpr std::string_view kLabel = "ψ3,1";
  static constexpr double kMaxSlope = 135.0 / 64.0;  // at r = 1/4
  static constexpr EigenvalueLaw kEigenvalueLaw = {
      .power = 3, .on_jittered_grid = 7.9, .on_cubic_grid = 2.1, .on_shaft = 5.0, .condition_of_1000 = 3e7};

  template <class T>
  static T inside(T r) {
    const T t = T(1) - r, t2 = t * t;
    return t2 * t2 * (T(4) * r + T(1));
  }
  template <class T>
  static T value(T r) {
    return r < T(1) ? inside(r) : T(0);
  }
  template <class T>
  static T derivative(T r) {
    return r * derivative_over_r(r);
  }
  template <class T>
  static T derivative_over_r(T r) {
    return r < T(1) ? inside_over_r(r) : T(0);
  }
  template <class T>
  static T inside_over_r(T r) {
    const T t = T(1) - r;
    return T(-20) * t * t * t;
  }
  static std::array<double, 2> over_r_derivatives(double r) {
    return {60 * (1 - r) * (1 - r), -120 * (1 - r)};
  }
};

/// ψ3,2(r) = (1−r)⁶((35/3)r²+6r+1), C⁴.
struct Wendland32 {
  static constexpr std::string_view kName = "psi32";
  static constexpr std::string_view kLabel = "ψ3,2";
  static constexpr double kMaxSlope = 2.49978887758819;  // at r = 0.2355714 (root of 35r² − 4r − 1)
  static constexpr EigenvalueLaw kEigenvalueLaw = {
      .power = 5, .on_jittered_grid = 161, .on_cubic_grid = 15.5, .on_shaft = 77, .condition_of_1000 = 5e9};

  template <class T>
  static T inside(T r) {
    const T t = T(1) - r, t2 = t * t;
    return t2 * t2 * t2 * ((T(35) / T(3) * r + T(6)) * r + T(1));
  }
  template <class T>
  static T value(T r) {
    return r < T(1) ? inside(r) : T(0);
  }
  template <class T>
  static T derivative(T r) {
    return r * derivative_over_r(r);
  }
  template <class T>
  static T derivative_over_r(T r) {
    return r < T(1) ? inside_over_r(r) : T(0);
  }
  template <class T>
  static T inside_over_r(T r) {
    const T t = T(1) - r, t2 = t * t;
    return T(-56) / T(3) * (T(1) + T(5) * r) * t2 * t2 * t;
  }
  static std::array<double, 2> over_r_derivatives(double r) {
    const double t = 1 - r, t2 = t * t;
    return {560 * r * t2 * t2, 560 * t2 * t * (1 - 5 * r)};
  }
};

/// Buhmann's function with parameters (½, ½, 1, 2): 12r⁴ln r − 21r⁴ + 32r³ − 12r² + 1, C². 0·ln 0 is 0.
struct Buhmann {
  static constexpr std::string_view kName = "buhmann";
  static constexpr std::string_view kLabel = "Buhmann";
  static constexpr double kMaxSlope = 2.17599740815977;  // at r = 0.2284746
  static constexpr EigenvalueLaw kEigenvalueLaw = {
      .power = 3, .on_jittered_grid = 12.5, .on_cubic_grid = 3.3, .on_shaft = 8.0, .condition_of_1000 = 2e7};

  template <class T>
  static T inside(T r) {
    const T r2 = r * r;
    const T plain = T(1) + r2 * (T(-12) + r * (T(32) + r * (T(12) * vector_log(r) - T(21))));
    if constexpr (!std::is_same_v<T, float>) return plain;
    // In single precision the terms cancel as r grows, to −1e-6 near r = 1. With t = 1 − r, ψ = t⁴ Q(t), where
    // Q(t) = 4 − 288 Σ_{k≥5} (k−5)!/k! tᵏ⁻⁴ (Taylor at r = 1); here its least-squares fit on t ≤ 0.7, ψ within 5e-9.
    const T t = T(1) - r, t2 = t * t;
    T q = T(-0.119898218);
    q = q * t + T(0.21365213);
    q = q * t - T(0.261955791);
    q = q * t - T(0.0027523155);
    q = q * t - T(0.431680051);
    q = q * t - T(2.39530638);
    q = q * t + T(3.99972014);
    return r < T(0.3) ? plain : t2 * t2 * q;
  }
  template <class T>
  static T value(T r) {
    return r < T(1) ? inside(r) : T(0);
  }
  template <class T>
  static T derivative(T r) {
    return r * derivative_over_r(r);
  }
  template <class T>
  static T derivative_over_r(T r) {
    if (!(r < T(1))) return T(0);
    if (r <= T(0)) return T(-24);
    return r * (r * (T(48) * std::log(r) - T(72)) + T(96)) - T(24);
  }
  template <class T>
  static T inside_over_r(T r) {
    return r * (r * (T(48) * vector_log(r) - T(72)) + T(96)) - T(24);
  }
  static std::array<double, 2> over_r_derivatives(double r) {
    return {96 * (r * std::log(r) - r + 1), 96 * std::log(r)};
  }
};

/// The list of all kernels. Parsers, menus, tools, charts and tests read it; its order is that of their output.
using Kernel = std::variant<Wendland31, Wendland30, Wendland32, Buhmann>;

/// Calls `visit(functor)` for each kernel in turn.
template <class Visitor, std::size_t I = 0>
void for_each_kernel(Visitor&& visit) {
  visit(std::variant_alternative_t<I, Kernel>{});
  if constexpr (I + 1 < std::variant_size_v<Kernel>)
    for_each_kernel<Visitor, I + 1>(std::forward<Visitor>(visit));
}

/// The kernel called `name`, or nothing.
inline std::optional<Kernel> find_kernel(std::string_view name) {
  std::optional<Kernel> found;
  for_each_kernel([&](auto kernel) {
    if (kernel.kName == name) found = kernel;
  });
  return found;
}

/// "psi31, psi30, psi32, buhmann": for messages.
inline std::string kernel_names() {
  std::string names;
  for_each_kernel([&](auto kernel) { names += (names.empty() ? "" : ", ") + std::string(kernel.kName); });
  return names;
}

inline std::string_view name_of(const Kernel& kernel) {
  return std::visit([](auto k) { return k.kName; }, kernel);
}

inline double max_slope(const Kernel& kernel) {
  return std::visit([](auto k) { return k.kMaxSlope; }, kernel);
}

}  // namespace brachy
