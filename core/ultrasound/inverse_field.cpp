#include "core/ultrasound/inverse_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace brachy {
namespace {

constexpr std::size_t kPatch = 8;           // nodes along each side: one block of the field's
constexpr double kAcross = 0.5;             // mm, of the difference across the plane
constexpr double kLongestStepMm = 4;        // of a node in one step: a fold's slope is not followed far
constexpr double kLeastDenominator = 1e-2;  // of an update, as a share

// Catmull and Rom's cubic through four values at t between the middle two.
std::array<double, 4> cubic_through(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {0.5 * (-t3 + 2 * t2 - t), 0.5 * (3 * t3 - 5 * t2 + 2), 0.5 * (-3 * t3 + 4 * t2 + t),
          0.5 * (t3 - t2)};
}

}  // namespace

InverseField::InverseField(const ImagePlane& plane, double spacing_mm) : spacing_(spacing_mm) {
  // Two nodes more on each side: the cubic's, and one beyond the last line's pixels.
  left_ = plane.left_mm() - 2 * spacing_;
  bottom_ = plane.bottom_mm() - 2 * spacing_;
  columns_ = static_cast<std::size_t>(std::ceil((plane.right_mm() - left_) / spacing_)) + 3;
  rows_ = static_cast<std::size_t>(std::ceil((plane.top_mm() - bottom_) / spacing_)) + 3;
  nodes_.resize(columns_ * rows_);
  const double margin = 2.9 * spacing_;  // the diagonal of what the cubic reaches
  for (std::size_t j = 0; j < rows_; ++j)
    for (std::size_t i = 0; i < columns_; ++i) {
      Node& node = nodes_[j * columns_ + i];
      node.place = {left_ + spacing_ * static_cast<double>(i), bottom_ + spacing_ * static_cast<double>(j)};
      const LinePoint p = plane.find(node.place);
      const double last = static_cast<double>(plane.lines() - 1);
      const double aside = std::max(-p.line, p.line - last) * plane.line_spacing_mm(std::max(0.0, p.depth));
      node.is_active = p.depth > -margin && p.depth < plane.depth_mm() + margin && aside < margin;
    }
  for (std::size_t j = 0; j < rows_; j += kPatch)
    for (std::size_t i = 0; i < columns_; i += kPatch)
      for (std::size_t k = j; k < std::min(rows_, j + kPatch); ++k)
        for (std::size_t l = i; l < std::min(columns_, i + kPatch); ++l)
          if (nodes_[k * columns_ + l].is_active)
            active_.push_back(static_cast<std::uint32_t>(k * columns_ + l));
  for (const std::uint32_t k : active_)
    if (k / columns_ % 2 == 0 && k % columns_ % 2 == 0) sparse_.push_back(k);
  open_.reserve(active_.size());
  X_.resize(active_.size());
  u_.resize(active_.size());
}

// Residuals of these nodes.
void InverseField::evaluate(DisplacementField& field, std::span<const std::uint32_t> nodes) noexcept {
  for (std::size_t k = 0; k < nodes.size(); ++k) X_[k] = nodes_[nodes[k]].X;
  field.displacements_at({X_.data(), nodes.size()}, {u_.data(), nodes.size()});
  evaluations_ += nodes.size();
}

bool InverseField::solve(DisplacementField& field, const BodyFrame& frame,
                         const RigidTransform& X_WI) noexcept {
  evaluations_ = 0;
  worst_ = 0;
  const Vec3 across = frame.from_world(X_WI * Vec3(0, 0, kAcross)) - frame.from_world(X_WI.p);
  open_.clear();
  for (const std::uint32_t k : active_) {
    Node& node = nodes_[k];
    const Vec3 y = frame.from_world(X_WI * Vec3(node.place.a, node.place.b, 0));
    if (is_started_) {
      node.last = node.X - node.y;
      node.X = y + node.last + node.drift;
    } else {
      node.X = y;
      node.last = node.drift = Vec3::Zero();
      node.B = Mat3::Identity();
    }
    node.y = y;
    open_.push_back(k);
  }
  const bool was_started = std::exchange(is_started_, true);
  if (field.touched().empty()) {
    for (const std::uint32_t k : active_) {
      Node& node = nodes_[k];
      node.X = node.y;
      node.drift = Vec3::Zero();
      node.B = Mat3::Identity();
      node.by_n = across / kAcross;
    }
    return true;
  }
  for (int step = 0; step < kMostSteps && !open_.empty(); ++step) {
    evaluate(field, open_);
    std::size_t left = 0;
    const bool is_last = step + 1 == kMostSteps;
    for (std::size_t k = 0; k < open_.size(); ++k) {
      Node& node = nodes_[open_[k]];
      const Vec3 residual = node.X + u_[k] - node.y;
      if (step > 0) {
        const Vec3 change = node.B * (residual - node.residual);
        const double denominator = node.step.dot(change);
        if (std::abs(denominator) > kLeastDenominator * node.step.squaredNorm())
          node.B += (node.step - change) * (node.step.transpose() * node.B) / denominator;
      }
      node.residual = residual;
      const double size = residual.norm();
      if (!(size > kToleranceMm) || is_last) {
        worst_ = std::max(worst_, size);
        continue;
      }
      node.step = -(node.B * residual);
      const double length = node.step.norm();
      if (length > kLongestStepMm) node.step *= kLongestStepMm / length;
      node.X += node.step;
      open_[left++] = open_[k];
    }
    open_.resize(left);
  }
  for (const std::uint32_t k : active_) {
    Node& node = nodes_[k];
    node.drift = was_started ? Vec3(node.X - node.y - node.last) : Vec3::Zero();
  }
  // What the plane beside it has at X + n: one step of the same method from there.
  for (std::size_t k = 0; k < sparse_.size(); ++k) X_[k] = nodes_[sparse_[k]].X + across;
  field.displacements_at({X_.data(), sparse_.size()}, {u_.data(), sparse_.size()});
  evaluations_ += sparse_.size();
  for (std::size_t k = 0; k < sparse_.size(); ++k) {
    Node& node = nodes_[sparse_[k]];
    const Vec3 residual = X_[k] + u_[k] - (node.y + across) - node.residual;
    node.by_n = (across - node.B * residual) / kAcross;
  }
  const bool is_solved = worst_ <= kToleranceMm;
  if (!is_solved) is_started_ = false;
  return is_solved;
}

InverseField::Sample InverseField::at(const PlanePoint& p) const noexcept {
  const double x = std::clamp((p.a - left_) / spacing_, 1.0, static_cast<double>(columns_) - 2.001);
  const double y = std::clamp((p.b - bottom_) / spacing_, 1.0, static_cast<double>(rows_) - 2.001);
  const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
  const double s = x - static_cast<double>(i), t = y - static_cast<double>(j);
  const std::array<double, 4> wx = cubic_through(s), wy = cubic_through(t);
  Sample sample{Vec3::Zero(), Vec3::Zero()};
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t l = 0; l < 4; ++l) {
      const Node& node = nodes_[(j + k - 1) * columns_ + i + l - 1];
      sample.X += wy[k] * wx[l] * node.X;
    }
  const std::size_t i2 = i / 2 * 2, j2 = j / 2 * 2;
  const double s2 = 0.5 * (x - static_cast<double>(i2)), t2 = 0.5 * (y - static_cast<double>(j2));
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t l = 0; l < 2; ++l)
      sample.X_by_n +=
          (k ? t2 : 1 - t2) * (l ? s2 : 1 - s2) * nodes_[(j2 + 2 * k) * columns_ + i2 + 2 * l].by_n;
  return sample;
}

// Rows first, then columns: the cubic of at(), of which nodes are themselves; and across the plane the line of at().
void InverseField::find(std::size_t column, std::size_t row, Patch& patch) const noexcept {
  constexpr std::size_t kSide = Patch::kSide, kNodes = kSide / 2 + 3, kSparse = kSide / 4 + 2;
  const std::array<double, 4> w = cubic_through(0.5);
  const float inner = static_cast<float>(w[1]), outer = static_cast<float>(w[0]);
  const std::size_t first_column = column / 2 - 1, first_row = row / 2 - 1;
  const auto node = [&](std::size_t i, std::size_t j) -> const Node& {
    return nodes_[std::min(j, rows_ - 1) * columns_ + std::min(i, columns_ - 1)];
  };
  float X[3][kNodes][kNodes], along[3][kNodes][kSide];
  for (std::size_t j = 0; j < kNodes; ++j)
    for (std::size_t i = 0; i < kNodes; ++i) {
      const Vec3& of = node(first_column + i, first_row + j).X;
      for (std::size_t d = 0; d < 3; ++d) X[d][j][i] = static_cast<float>(of[static_cast<Eigen::Index>(d)]);
    }
  for (std::size_t d = 0; d < 3; ++d) {
    for (std::size_t j = 0; j < kNodes; ++j)
      for (std::size_t q = 0; q < kSide / 2; ++q) {
        const float* x = X[d][j] + q;
        along[d][j][2 * q] = x[1];
        along[d][j][2 * q + 1] = inner * (x[1] + x[2]) + outer * (x[0] + x[3]);
      }
    for (std::size_t q = 0; q < kSide / 2; ++q)
      for (std::size_t i = 0; i < kSide; ++i) {
        const auto at = [&](std::size_t k) { return along[d][q + k][i]; };
        patch.X[d][2 * q][i] = at(1);
        patch.X[d][2 * q + 1][i] = inner * (at(1) + at(2)) + outer * (at(0) + at(3));
      }
  }
  // In quarters of what is between the sparse nodes.
  const std::size_t sparse_column = column / 4 * 4, sparse_row = row / 4 * 4;
  float N[3][kSparse][kSparse], half[3][kSparse][kSide];
  for (std::size_t j = 0; j < kSparse; ++j)
    for (std::size_t i = 0; i < kSparse; ++i) {
      const Vec3& of = node(sparse_column / 2 + 2 * i, sparse_row / 2 + 2 * j).by_n;
      for (std::size_t d = 0; d < 3; ++d) N[d][j][i] = static_cast<float>(of[static_cast<Eigen::Index>(d)]);
    }
  const auto between = [](float a, float b, std::size_t quarter) {
    return a + 0.25F * static_cast<float>(quarter) * (b - a);
  };
  for (std::size_t d = 0; d < 3; ++d) {
    for (std::size_t j = 0; j < kSparse; ++j)
      for (std::size_t i = 0; i < kSide; ++i) {
        const std::size_t at = column - sparse_column + i;
        half[d][j][i] = between(N[d][j][at / 4], N[d][j][at / 4 + 1], at % 4);
      }
    for (std::size_t j = 0; j < kSide; ++j)
      for (std::size_t i = 0; i < kSide; ++i) {
        const std::size_t at = row - sparse_row + j;
        patch.by_n[d][j][i] = between(half[d][at / 4][i], half[d][at / 4 + 1][i], at % 4);
      }
  }
}

}  // namespace brachy
