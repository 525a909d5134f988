#include "core/models/blended/region_distance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

// The first four coefficients of a power series.
struct Series {
  std::array<double, 4> c{};

  Series operator*(const Series& o) const {
    Series p;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; i + j < 4; ++j) p.c[i + j] += c[i] * o.c[j];
    return p;
  }
  // this / o and √this, coefficient by coefficient.
  Series operator/(const Series& o) const {
    Series q;
    for (std::size_t i = 0; i < 4; ++i) {
      q.c[i] = c[i];
      for (std::size_t j = 0; j < i; ++j) q.c[i] -= q.c[j] * o.c[i - j];
      q.c[i] /= o.c[0];
    }
    return q;
  }
  Series root() const {
    Series r{{std::sqrt(c[0])}};
    for (std::size_t i = 1; i < 4; ++i) {
      r.c[i] = c[i];
      for (std::size_t j = 1; j < i; ++j) r.c[i] -= r.c[j] * r.c[i - j];
      r.c[i] /= 2 * r.c[0];
    }
    return r;
  }
};

// |x + t v|²
Series squared(const Vec3& x, const Vec3& v) {
  return {{x.squaredNorm(), 2 * x.dot(v), v.squaredNorm(), 0}};
}

// Unit vectors spread evenly over the half sphere z > 0.
std::vector<Vec3> half_sphere(int n) {
  std::vector<Vec3> directions;
  for (int i = 0; i < n; ++i) {
    const double z = (i + 0.5) / n, r = std::sqrt(1 - z * z),
                 turn = std::numbers::pi * (1 + std::sqrt(5.0)) * i;
    directions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return directions;
}

// Of the uniform cubic B-spline at t = 0 … 1 of the middle one of three steps between four nodes, along each
// axis, and their
// derivatives by t.
template <class T>
struct Weights {
  explicit Weights(const Vec3& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      constexpr T kSixth = T(1) / 6, kHalf = T(1) / 2;
      const T s = static_cast<T>(t[static_cast<Eigen::Index>(k)]), r = 1 - s;
      value[k] = {kSixth * r * r * r, kSixth * (4 - s * s * (6 - 3 * s)), kSixth * (4 - r * r * (6 - 3 * r)),
                  kSixth * s * s * s};
      slope[k] = {-kHalf * r * r, kHalf * s * (3 * s - 4), -kHalf * r * (3 * r - 4), kHalf * s * s};
    }
  }
  std::array<std::array<T, 4>, 3> value, slope;
};

}  // namespace

EllipsoidDistance::EllipsoidDistance(const Vec3& centre, const Vec3& semi_axes)
    : centre_(centre), semi_axes_(semi_axes) {
  constexpr double kBetweenSamples = 1.25;  // more than these functions grow between two
  constexpr std::array<double, 3> kFactorial = {1, 2, 6};
  const Vec3 a = semi_axes / semi_axes.maxCoeff(), a2 = a.cwiseProduct(a);
  if (a == Vec3::Ones()) {  // |x|: its third derivative is −3c(1 − c²)/|x|², c the cosine between x and v
    linear_ = {1, 1, 2 / std::numbers::sqrt3};
    return;
  }
  static const std::vector<Vec3> places = half_sphere(48), directions = half_sphere(40);
  const auto sample = [&](const Vec3& x) {
    for (const Vec3& v : directions) {
      const Vec3 y = x.cwiseQuotient(semi_axes), dy = v.cwiseQuotient(semi_axes);
      const Series k2 = squared(y, dy);
      const Series z = squared(y.cwiseQuotient(semi_axes), dy.cwiseQuotient(semi_axes)).root();
      const Series linear = k2 / z, constant = k2.root() / z;
      for (std::size_t j = 0; j < 3; ++j) {
        const double factor = kBetweenSamples * kFactorial[j];
        linear_[j] = std::max(linear_[j], factor * std::abs(linear.c[j + 1]));
        constant_[j] = std::max(constant_[j], factor * std::abs(constant.c[j + 1]));
      }
    }
  };
  // In one octant, for the others are its mirror images; even about the body, on its surface, and in normals:
  // where axes differ much, slopes change fast in some.
  for (const Vec3& d : places)
    if (d.minCoeff() >= 0)
      for (const Vec3& x : {d, Vec3(d.cwiseProduct(a)), Vec3(d.cwiseProduct(a2))}) sample(x.normalized());
}

double EllipsoidDistance::at(const Vec3& X, Vec3* gradient) const noexcept {
  const Vec3 y = (X - centre_).cwiseQuotient(semi_axes_), z = y.cwiseQuotient(semi_axes_);
  const double k = y.norm(), slope = z.norm();
  if (!(slope > 0)) {
    if (gradient) gradient->setZero();
    return -semi_axes_.minCoeff();
  }
  const double distance = k * (k - 1) / slope;
  if (gradient) {
    const Vec3 slope_gradient = z.cwiseQuotient(semi_axes_).cwiseQuotient(semi_axes_) / slope;
    *gradient = ((2 * k - 1) / k * z - distance * slope_gradient) / slope;
  }
  return distance;
}

// Without branches, so that the loop vectorises; at the centre some finite gradient.
void EllipsoidDistance::at(const Vec3& centre, const CellPoints& X, CellDistances& distances) const noexcept {
  const Eigen::Vector3f o = (centre - centre_).cast<float>(), i = semi_axes_.cwiseInverse().cast<float>();
  for (std::size_t n = 0; n < CellPoints::kCount; ++n) {
    const float yx = (X.x[n] + o.x()) * i.x(), yy = (X.y[n] + o.y()) * i.y(), yz = (X.z[n] + o.z()) * i.z();
    const float zx = yx * i.x(), zy = yy * i.y(), zz = yz * i.z();
    const float k = std::sqrt(yx * yx + yy * yy + yz * yz + 1e-20f);
    const float inverse = 1 / std::sqrt(zx * zx + zy * zy + zz * zz + 1e-24f);
    const float d = k * (k - 1) * inverse;
    const float along = (2 - 1 / k) * inverse, bent = d * inverse * inverse;
    distances.d[n] = d;
    distances.g[0][n] = zx * (along - bent * i.x() * i.x());
    distances.g[1][n] = zy * (along - bent * i.y() * i.y());
    distances.g[2][n] = zz * (along - bent * i.z() * i.z());
  }
}

DistanceBounds EllipsoidDistance::over(const Vec3& X, double radius) const noexcept {
  const double nearest = (X - centre_).norm() - radius, narrowest = semi_axes_.minCoeff();
  // The deepest of the ball about the centre is not known, the shallowest is: (1 − k) min a.
  const double k = (X - centre_).cwiseQuotient(semi_axes_).norm() + radius / narrowest;
  DistanceBounds bounds{-kHuge, k < 1 ? (k - 1) * narrowest : kHuge, {kHuge, kHuge, kHuge}};
  if (!(nearest > 0)) return bounds;
  double power = 1;  // nearest to the −j, for the j-th derivative
  for (std::size_t j = 0; j < 3; ++j) {
    power /= nearest;
    bounds.slope[j] = linear_[j] * power * nearest + constant_[j] * power;
  }
  Vec3 gradient;
  const double middle = at(X, &gradient);
  bounds.slope[0] = std::min(bounds.slope[0], gradient.norm() + bounds.slope[1] * radius);
  bounds.least = middle - bounds.slope[0] * radius;
  bounds.most = std::min(bounds.most, middle + bounds.slope[0] * radius);
  return bounds;
}

SampledDistance::SampledDistance(const SurfaceBvh& surface, double blend_mm) {
  const double extent = (surface.max() - surface.min()).maxCoeff() + blend_mm;
  spacing_ = std::max(0.25 * blend_mm, extent / kMostCells);
  margin_ = 0.5 * blend_mm + 2 * spacing_;
  min_ = surface.min() - Vec3::Constant(margin_ + 2 * spacing_);
  const Vec3 size = surface.max() - surface.min() + Vec3::Constant(2 * margin_ + 4 * spacing_);
  for (std::size_t k = 0; k < 3; ++k)
    count_[k] = static_cast<std::size_t>(std::ceil(size[static_cast<Eigen::Index>(k)] / spacing_)) + 1;
  nodes_.reserve(count_[0] * count_[1] * count_[2]);
  for (std::size_t z = 0; z < count_[2]; ++z)
    for (std::size_t y = 0; y < count_[1]; ++y)
      for (std::size_t x = 0; x < count_[0]; ++x) {
        const Vec3 at(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
        const double d = surface.closest_point(min_ + spacing_ * at).signed_distance;
        nodes_.push_back(static_cast<float>(std::min(d, margin_)));
      }
  slopes_.resize(nodes_.size());
  for (std::size_t z = 0; z + 3 < count_[2]; ++z)
    for (std::size_t y = 0; y + 3 < count_[1]; ++y)
      for (std::size_t x = 0; x + 3 < count_[0]; ++x) {
        const Slopes slopes = slopes_[node(x, y, z)] = slopes_of(x, y, z);
        for (std::size_t j = 0; j < 3; ++j) largest_[j] = std::max(largest_[j], slopes[j]);
      }
}

// A derivative of a B-spline is the spline, of as many degrees less, over differences of its nodes: within
// their range. Each derivative along a unit vector is at most the Frobenius norm of all partial ones.
SampledDistance::Slopes SampledDistance::slopes_of(std::size_t x, std::size_t y, std::size_t z) const {
  // Far from the surface only the rate of change of the distance is needed: at most 1 along each axis.
  float least = nodes_[node(x, y, z)], most = least;
  for (std::size_t k = 0; k < 64; ++k) {
    const float d = nodes_[node(x + k % 4, y + k / 4 % 4, z + k / 16)];
    least = std::min(least, d);
    most = std::max(most, d);
  }
  if (static_cast<double>(std::max(least, -most)) > margin_ - 2 * spacing_)
    return {least == most ? 0.0f : static_cast<float>(std::numbers::sqrt3), 0, 0};

  std::array<double, 3> sums{};
  for (std::size_t dx = 0; dx <= 3; ++dx)
    for (std::size_t dy = 0; dx + dy <= 3; ++dy)
      for (std::size_t dz = 0; dx + dy + dz <= 3; ++dz) {
        const std::size_t order = dx + dy + dz;
        if (order == 0) continue;
        // Differences of the 4³ nodes, in place.
        std::array<double, 64> v;
        for (std::size_t k = 0; k < 64; ++k)
          v[k] = static_cast<double>(nodes_[node(x + k % 4, y + k / 4 % 4, z + k / 16)]);
        const std::array<std::size_t, 3> times = {dx, dy, dz}, step = {1, 4, 16};
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (std::size_t t = 0; t < times[axis]; ++t)
            for (std::size_t k = 0; k < 64; ++k)
              if (k / step[axis] % 4 + t < 3) v[k] = v[k + step[axis]] - v[k];
        double largest = 0;
        for (std::size_t k = 0; k < 64; ++k)
          if (k % 4 + dx < 4 && k / 4 % 4 + dy < 4 && k / 16 + dz < 4)
            largest = std::max(largest, std::abs(v[k]));
        constexpr std::array<double, 4> kFactorial = {1, 1, 2, 6};
        const double partials = kFactorial[order] / (kFactorial[dx] * kFactorial[dy] * kFactorial[dz]);
        sums[order - 1] += partials * largest * largest;
      }
  Slopes slopes;
  for (std::size_t j = 0; j < 3; ++j)
    slopes[j] = static_cast<float>(1.0001 * std::sqrt(sums[j]) / std::pow(spacing_, j + 1));
  return slopes;
}

// The cell that X lies in and where, 0 … 1 along each axis; false outside of the grid.
bool SampledDistance::locate(const Vec3& X, std::array<std::size_t, 3>& cell, Vec3& t) const noexcept {
  const Vec3 at = (X - min_) / spacing_ - Vec3::Ones();
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = at[static_cast<Eigen::Index>(k)];
    if (!(x >= 0 && x < static_cast<double>(count_[k] - 3))) return false;
    cell[k] = static_cast<std::size_t>(x);
    t[static_cast<Eigen::Index>(k)] = x - static_cast<double>(cell[k]);
  }
  return true;
}

// At the fraction t of a cell whose first node is `first`; the gradient is per cell. Rows of four nodes, then along x.
template <class T>
T SampledDistance::spline(std::size_t first, const Vec3& t, T* gradient) const noexcept {
  const Weights<T> w(t);
  T value[4] = {}, along_y[4] = {}, along_z[4] = {};
  const float* plane = &nodes_[first];
  for (std::size_t z = 0; z < 4; ++z, plane += count_[0] * count_[1]) {
    const float* v = plane;
    for (std::size_t y = 0; y < 4; ++y, v += count_[0]) {
      const T a = w.value[1][y] * w.value[2][z], b = w.slope[1][y] * w.value[2][z],
              c = w.value[1][y] * w.slope[2][z];
      for (std::size_t x = 0; x < 4; ++x) {
        const auto node_value = static_cast<T>(v[x]);
        value[x] += a * node_value;
        along_y[x] += b * node_value;
        along_z[x] += c * node_value;
      }
    }
  }
  T sum = 0;
  gradient[0] = gradient[1] = gradient[2] = 0;
  for (std::size_t x = 0; x < 4; ++x) {
    sum += w.value[0][x] * value[x];
    gradient[0] += w.slope[0][x] * value[x];
    gradient[1] += w.value[0][x] * along_y[x];
    gradient[2] += w.value[0][x] * along_z[x];
  }
  return sum;
}

double SampledDistance::at(const Vec3& X, Vec3* gradient) const noexcept {
  std::array<std::size_t, 3> cell;
  Vec3 t, slope;
  if (!locate(X, cell, t)) {
    if (gradient) gradient->setZero();
    return margin_;
  }
  const double distance = spline(node(cell[0], cell[1], cell[2]), t, slope.data());
  if (gradient) *gradient = slope / spacing_;
  return distance;
}

void SampledDistance::at(const Vec3& centre, const CellPoints& X, CellDistances& distances) const noexcept {
  const auto scale = static_cast<float>(1 / spacing_);
  for (std::size_t n = 0; n < CellPoints::kCount; ++n) {
    std::array<std::size_t, 3> cell;
    Vec3 t;
    float slope[3] = {};
    distances.d[n] = static_cast<float>(margin_);
    if (locate(centre + Eigen::Vector3f(X.x[n], X.y[n], X.z[n]).cast<double>(), cell, t))
      distances.d[n] = spline(node(cell[0], cell[1], cell[2]), t, slope);
    for (std::size_t k = 0; k < 3; ++k) distances.g[k][n] = scale * slope[k];
  }
}

DistanceBounds SampledDistance::over(const Vec3& X, double radius) const noexcept {
  constexpr double kFewCells = 1.5;  // of radius: larger balls use the largest of all
  std::array<std::size_t, 3> first, last;
  Slopes slopes{};
  const auto clamped = [&](double x, std::size_t k) {
    return static_cast<std::size_t>(std::clamp(x, 0.0, static_cast<double>(count_[k] - 4)));
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double x = (X[axis] - min_[axis]) / spacing_ - 1;
    first[k] = clamped(x - radius / spacing_, k);
    last[k] = clamped(x + radius / spacing_, k);
  }
  if (radius > kFewCells * spacing_) {
    slopes = largest_;
  } else {
    for (std::size_t z = first[2]; z <= last[2]; ++z)
      for (std::size_t y = first[1]; y <= last[1]; ++y)
        for (std::size_t x = first[0]; x <= last[0]; ++x)
          for (std::size_t j = 0; j < 3; ++j) slopes[j] = std::max(slopes[j], slopes_[node(x, y, z)][j]);
  }
  DistanceBounds bounds;
  for (std::size_t j = 0; j < 3; ++j) bounds.slope[j] = static_cast<double>(slopes[j]);
  const double middle = at(X), off = bounds.slope[0] * radius;
  bounds.least = middle - off;
  bounds.most = middle + off;
  return bounds;
}

}  // namespace brachy
