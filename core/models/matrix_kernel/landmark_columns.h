#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/elasticity/elastic_kernel.h"
#include "core/elasticity/needle_rings.h"
#include "core/models/matrix_kernel/remainder_table.h"
#include "core/solve/landmark_slots.h"

namespace brachy {

/// What is read from a RemainderTable for the landmarks: the field at its nodes of unit forces on each, a column,
/// and by columns the table's share of K. A column is kept while the rings that carry its landmark's force do not
/// change, whatever number the landmark has (LandmarkSlots). Landmarks with rings outside the table, and pairs of them,
/// are evaluated with the kernel itself. That allocates and takes tens of milliseconds.
/// Threads: one. Real-time: nothing allocates with landmarks inside the table.
class LandmarkColumns {
 public:
  /// Kernel and table must outlive this.
  LandmarkColumns(const ElasticKernel& kernel, const RemainderTable& table, SimdTarget target,
                  std::size_t max_landmarks);

  /// For so many landmarks, whose rings are `rings`.
  void place(std::size_t landmarks, const NeedleRings& rings) noexcept;

  /// Relative modulus where a ring carries its share of a landmark's force: on a region's surface the mean of its
  /// sides, of a core in mixed tissue the mean of what it takes up.
  double modulus(std::size_t ring, std::size_t side) const { return moduli_[ring][side]; }
  /// And the one that the near part of its field is for: where the tissue is mixed its own, else the tissue's.
  double field_modulus(std::size_t ring, std::size_t side) const { return field_moduli_[ring][side]; }

  /// The table's share of a landmark's own compliance, mm/N; 0 for one outside the table.
  Mat3 self_compliance(std::size_t landmark) const noexcept;

  /// K's lower triangle (3n × 3n, mm/N): the table's share, to which near parts are added …
  void begin_matrix(Eigen::Ref<Eigen::MatrixXd> K) noexcept;
  /// … and then all of K between landmarks that both lie outside the table.
  void finish_matrix(Eigen::Ref<Eigen::MatrixXd> K) const noexcept;

  /// field += the nodes' displacement by the landmarks' `forces` (n, N).
  void add_fields(std::span<const Vec3> forces, float* field) const noexcept;

  std::size_t bytes() const;

 private:
  /// A ring's part in a landmark: everything that a column depends on. `first_point` gives the ring's orientation
  /// and width, which count outside the table only: inside, it is the centre.
  struct Part {
    Vec3 centre, first_point;
    double share, s;  // mm²: of the core as the table sees it
    bool is_outside;
    double key() const { return centre.x() + 2 * centre.y() + 3 * centre.z() + share; }
    bool operator==(const Part&) const = default;
  };
  /// What a landmark's force does where the tissue is mixed: so much of it in one modulus, as one smooth point.
  struct Lump {
    double modulus, weight, share = 0, s = 0;  // weight: w that the near part of its field has
    double core_s = 0;                         // of its force: the landmark's core
    Vec3 at = Vec3::Zero();
  };
  struct Column {
    std::vector<std::uint32_t> nodes;  // where it is observed, and that carry its force unless it is wide …
    std::vector<float> weights;        // … and their shares
    double modulus = 1;                // relative, where its force acts; mixed tissue: not used
    std::vector<Lump> lumps;           // mixed tissue
    std::vector<float> held_fields;    // Q alone, filled where the modulus is not the tissue's
    std::vector<float> fields;         // three, of unit forces along x, y, z, at the nodes
    bool is_wide = false;              // a core in mixed tissue: its force is spread over more
    bool is_exact = false;             // outside the table: `fields` from the kernel, no nodes of its own
  };

  void take_parts(const NeedleRings& rings) noexcept;
  const Column& column(std::size_t landmark) const { return columns_[slots_.slot(landmark)]; }
  void take_moduli(std::size_t landmarks, std::span<const NeedleRings::Ring> rings) noexcept;
  void gather(Column& column, std::uint32_t landmark, std::span<const NeedleRings::Ring> rings) noexcept;
  void spread(const Vec3& X, double share, Column& column) noexcept;
  void finish_nodes(Column& column) noexcept;
  void spread_core(const NeedleRings::Ring& ring, double share, Column& column) noexcept;
  double modulus_in_core(const NeedleRings::Ring& ring) const noexcept;
  void add_nodes(const Column& column, bool held, std::vector<float>& fields) const noexcept;
  void add_to_lump(const NeedleRings::Ring& ring, double modulus, double field_modulus, double share,
                   Column& column) noexcept;
  void finish_lumps(Column& column) noexcept;
  Mat3 between_lumps(const Column& a, const Column& b) const noexcept;
  void gather_exactly(Column& column, std::uint32_t landmark, const NeedleRings& rings);
  void prepare_exact_pairs(const NeedleRings& rings);
  Mat3 value_in_mixed(const Column& a, const Column& b) const noexcept;
  Mat3 observe(const Column& a, const std::vector<float>& fields) const noexcept;
  Mat3 value(const Column& a, const Column& b) const noexcept;

  const ElasticKernel& kernel_;
  const RemainderTable& table_;
  std::vector<Vec3> node_positions_;  // mm; mixed tissue
  const NearLoops& loops_;
  LandmarkSlots<Part> slots_;
  std::vector<Column> columns_;  // by slot
  Column of_core_;               // nodes and weights of a wide core's force
  std::size_t count_ = 0;
  /// Landmarks outside the table, each with its slot.
  struct Exact {
    std::vector<std::uint32_t> landmarks, last;
    Eigen::MatrixXd matrix;  // K between them
  };
  Exact exact_;
  std::vector<std::uint8_t> is_outside_;                      // of each landmark: the table
  std::vector<std::array<double, 2>> moduli_, field_moduli_;  // of each ring's share in its landmarks
  /// Of the column in work, by node.
  struct Nodes {
    std::vector<float> weight;
    std::vector<std::uint8_t> is_taken;  // the column has it
  };
  Nodes nodes_;
  const std::size_t max_landmarks_;
  std::vector<Mat3> table_blocks_;  // the table's share of K, of pairs, by slots
};

}  // namespace brachy
