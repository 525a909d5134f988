#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/state_archive.h"
#include "core/injectivity/certifiable_field.h"
#include "core/models/displacement_field.h"
#include "core/models/landmark_set.h"
#include "core/solve/factor_status.h"

namespace brachy {

/// How a tick was evaluated.
enum class Evaluation : std::uint8_t {
  kIdle,       ///< landmarks and displacements as in the last tick: nothing to do
  kDirect,     ///< every block summed over its landmarks
  kMixed,      ///< some blocks condensed already, the others directly
  kCondensed,  ///< every block by its condensed columns
};

/// From landmarks to a displacement field, in three steps: factorize the landmarks' system K, solve it,
/// evaluate the field at the tissue's points. The base of all deformation models: ScalarKernelField has the
/// scalar kernels, MatrixKernelField the matrix-valued ones, BlendedKernelField those that differ from tissue
/// to tissue.
///
/// The set that is factorized and the set of the evaluated field may differ: factorize and solve do not
/// change the field. The base keeps what models share: the numbers of both sets (LandmarkSet::Revision), the field's
/// landmarks and weights, and the scale from a model's weights to forces. A model implements the private do_ functions.
/// Threads: one caller. Real-time: no allocation after construction with one thread, no exceptions.
class TissueField : public DisplacementField, public CertifiableField {
 public:
  /// Makes `landmarks` (n, numbered) the factorized set and factorizes the system K of its positions. Only `elastic`
  /// and `fem` use its spreads; for these other spreads make another set. With a compliance C, K is K + C in all that
  /// follows, which only the matrix-valued models can. The same set again costs nothing: it is known by its numbers.
  /// Unless it returns kOk, no set is factorized.
  FactorStatus factorize(const LandmarkSet& landmarks) noexcept;

  /// The forces on the factorized landmarks that displace them by `displacements`: f = K⁻¹ d, N (both n).
  /// Where K is not a compliance they are scaled so that a lone landmark has the stiffness that the model was made with
  /// (core/elasticity/landmark_stiffness.h). Takes the time of 2 triangular solves.
  void solve(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept;

  /// H_ij = axes_i · (K⁻¹)_ij axes_j, N/mm (H m × m, symmetric), of the factorized landmarks first … first +
  /// m − 1, each with its unit axis (`axes` m): the forces along their axes that displacements along their
  /// axes take while they are held across them, and the other landmarks altogether. Scaled as in solve. m³/3
  /// multiply-adds on the ψ models, 3 m³ on
  /// the matrix-valued ones.
  void axial_stiffness(std::size_t first, std::span<const Vec3> axes, Eigen::Ref<Eigen::MatrixXd> H) noexcept;

  /// How stiff the factorized landmarks are in groups that move together: stiffness_g = Σ motions_i · f_i, N/mm, of the
  /// forces f that move the landmarks i of group g by `motions` (n, 1 for each mm of the group's) while all others are
  /// held. `group_of` (n): each landmark's, or kNoGroup; groups are numbered in the order of their first landmarks, at
  /// most 32.
  void rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                       std::span<double> stiffness) noexcept;
  static constexpr std::uint32_t kNoGroup = ~0u;

  /// Makes the factorized set, which `landmarks` are, that of the field, solves u(p_i) = d_i for their displacements
  /// and evaluates u at the tissue's points. With a compliance C it is u(p_i) = d_i − (C f)_i.
  void evaluate(const LandmarkSet& landmarks) noexcept;
  /// The field's landmarks at rest, and u there; n, mm. In place until the next evaluate.
  std::span<const Vec3> landmark_positions() const { return positions_; }
  std::span<const Vec3> landmark_displacements() const { return landmark_displacements_; }

  /// factorize, then evaluate. Unless it returns kOk, the last field is kept.
  FactorStatus update(const LandmarkSet& landmarks) noexcept;

  /// Multiplies the field by `scale`, everywhere.
  void rescale(double scale) noexcept;

  Evaluation evaluation() const { return evaluation_; }  ///< of the last evaluate
  bool gives_way() const { return options_.gives_way; }  ///< whether a compliance can be given
  bool knows_forces() const {
    return options_.uses_spreads;
  }  ///< whether its weights are forces: `elastic`, `fem`

  /// Condition number of the factorized landmarks' system, 1-norm, estimated each time that the set changes; 1 for no
  /// landmarks. Above FactorStatus::kMaxCondition factorize fails and the last set's condition is kept.
  double condition() const { return condition_; }

  /// Size of the force on all landmarks of the field together, N; scaled as in solve.
  double total_force_n() const;

  /// What the field of one set of landmarks still depends on besides these: how far work has gone that is spread over
  /// ticks. `restore` is for a field that `update` has been given the same set. Errors: as StateReader. Not real-time.
  void save(StateWriter& writer) const;
  void restore(StateReader& reader);

 protected:
  struct LandmarkOptions {
    std::size_t max_landmarks = 0;
    double force_scale = 1;     ///< N for a weight of 1
    bool uses_spreads = false;  ///< whether other spreads make another set
    bool gives_way = false;     ///< whether a compliance can be added to K
  };
  explicit TissueField(const LandmarkOptions& options);

  std::size_t max_landmarks() const { return options_.max_landmarks; }
  double force_scale() const { return options_.force_scale; }
  // The field's landmarks, n.
  const std::vector<Vec3>& positions() const { return positions_; }          // at rest, mm
  const std::vector<Vec3>& displacements() const { return displacements_; }  // mm
  const std::vector<Vec3>& weights() const { return weights_; }              // by the kernel's own compliance

 private:
  /// Factorizes the system of `landmarks`; `condition` is asked for where it returns kOk only. Their compliance is
  /// empty unless the model gives way.
  virtual FactorStatus do_factorize(const LandmarkSet& landmarks, double& condition) noexcept = 0;
  /// weights = K⁻¹ displacements, unscaled.
  virtual void do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept = 0;
  /// axial_stiffness, unscaled.
  virtual void do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                                  Eigen::Ref<Eigen::MatrixXd> H) noexcept = 0;
  /// rigid_stiffness, unscaled. Here with a solve for each group.
  virtual void do_rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                                  std::span<double> stiffness) noexcept;
  /// Finds the weights (n) of displacements() and evaluates the field. `is_new_set`: positions() have changed since the
  /// last call, and are the factorized ones.
  virtual Evaluation do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept = 0;
  /// What a model has besides.
  virtual void do_save(StateWriter& /*writer*/) const {}
  virtual void do_restore(StateReader& /*reader*/) {}
  /// Evaluates the field again: weights() and displacements() have been multiplied by `scale`.
  virtual void do_rescale(double scale) noexcept = 0;

  /// What K depends on: the numbers of the parts that the model uses; 0 for the others, and for no set.
  struct Key {
    std::uint64_t positions = 0, spreads = 0, compliance = 0;
    bool operator==(const Key&) const = default;
  };
  Key key_of(const LandmarkSet& landmarks) const noexcept;

  LandmarkOptions options_;
  Key factorized_, field_;
  std::size_t factorized_count_ = 0;
  std::vector<Vec3> positions_, displacements_, weights_;  // of the field
  std::vector<Vec3> landmark_displacements_, forces_;
  std::vector<Vec3> unit_, unit_forces_;  // of a group
  double condition_ = 1;
  Evaluation evaluation_ = Evaluation::kIdle;
};

}  // namespace brachy
