#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/rigid_transform.h"
#include "core/solve/inverse_loops.h"

namespace brachy {

/// X = L⁻¹A of a factor as panels, and of it AᵀK⁻¹A = XᵀX, kept from call to call: rows of X are computed again from
/// the first on of which L or A is another, and so are sums over them. Results have the same bits as from scratch.
/// Columns of A are vectors on landmarks of three rows each; each begins at a landmark no earlier than the one before.
/// Threads: one. Real-time: no allocation after construction.
class PanelInverse {
 public:
  /// For at most `max_rows` rows and `max_columns` columns; `has_gram`: whether gram will be called.
  PanelInverse(std::size_t max_rows, std::size_t max_columns, bool has_gram, SimdTarget target);

  /// L's rows from `row` on are others than in the last solve.
  void forget_from(std::size_t row) noexcept { known_rows_ = std::min(known_rows_, row); }

  /// The vectors that make up A, `landmarks` landmarks and `columns` columns …
  void begin(std::size_t landmarks, std::size_t columns) noexcept;
  /// … of which `v` is one: column `column` on `landmark`. Each landmark has at most one, and columns ascend with it
  /// but where they go on for earlier ones.
  void set(std::size_t landmark, std::size_t column, const Vec3& v) noexcept;
  /// X = L⁻¹A.
  void solve(const PanelMatrix& L) noexcept;

  // X by rows, `stride` numbers to the next; zeros beyond its columns, and in each before its start.
  const double* data() const { return X_.data(); }
  std::size_t stride() const { return stride_; }
  const std::uint32_t* starts() const { return starts_.data(); }

  /// The lower triangle of H = XᵀX, columns × columns.
  void gram(Eigen::Ref<Eigen::MatrixXd> H) noexcept;
  /// Its diagonal.
  void squares(std::span<double> sums) const noexcept;

 private:
  static constexpr std::uint32_t kNone = ~0u;
  struct Entry {
    std::uint32_t column = kNone;
    Vec3 v = Vec3::Zero();
    bool operator==(const Entry&) const = default;
  };

  const InverseLoops& loops_;
  std::size_t stride_, rows_ = 0, columns_ = 0;
  std::vector<Entry> entries_, last_entries_;  // of each landmark
  std::vector<std::uint32_t> starts_;          // of columns
  std::vector<double> X_;                      // rows × stride_
  std::size_t known_rows_ = 0;                 // of X, by the last L and entries
  std::size_t fresh_from_ = 0;                 // rows that the last solve computed
  std::size_t summed_rows_ = 0;                // of X, in sums_ …
  Eigen::Index summed_columns_ = 0;            // … of so many
  Eigen::MatrixXd sums_;                       // lower triangle
};

}  // namespace brachy
