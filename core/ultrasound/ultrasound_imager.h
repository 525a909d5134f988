#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/simd/simd_target.h"
#include "core/injectivity/certificate.h"
#include "core/simulation/mesh_state.h"
#include "core/ultrasound/echo_map.h"
#include "core/ultrasound/image_plane.h"
#include "core/ultrasound/instrument_echoes.h"
#include "core/ultrasound/inverse_field.h"
#include "core/ultrasound/point_spread.h"
#include "core/ultrasound/scan_loops.h"

namespace brachy {

/// What became of a request for an image.
enum class ImageResult : std::uint8_t {
  kNew,        ///< of this state
  kFolded,     ///< the field folds: the last image stands
  kNotSolved,  ///< some node's material point was not found: the last image stands
};

/// What one image shows.
struct ImagedState {
  DisplacementField& field;  ///< in the frame of the body
  const BodyFrame& frame;    ///< where the body is
  Verdict verdict;           ///< of the field; unknown: an image that could be solved may still be wrong
  std::uint64_t tick;        ///< the receiver's noise differs from tick to tick
  std::span<const NeedleState> needles;  ///< without the probe
  std::span<const Seed> seeds;
  RigidTransform X_WP;  ///< the probe's pose
};

/// The image of a transrectal probe, from the displacement field that everything else uses: material points of the
/// plane → tissue there → scattered pressure on scan lines → pulse and beam → envelope → gray values → pixels. The
/// model, its sources and its limits: core/ultrasound/README.md.
///
/// The same state and settings give the same pixels whatever the number of threads, to the bit on one instruction set,
/// where `keeps_solution` is off; with it on, an image starts from the last one's solution, is faster, and its
/// material points differ by up to InverseField::kToleranceMm.
/// Threads: one caller (OpenMP inside, if asked). Real-time: render does not allocate with one thread.
class UltrasoundImager {
 public:
  struct Options {
    UltrasoundSettings settings;
    double probe_radius_mm = 10;
    double rectal_wall_mm = 4;  ///< between probe and gland; it follows the probe. 0: no wall
    double needle_length_mm = 200, needle_radius_mm = 0.635;
    std::size_t max_needles = 16, max_seeds = 200;
    SimdTarget target = best_simd_target();
    int threads = 1;
    bool keeps_solution = false;
  };

  /// Errors: UserError as ImagePlane.
  UltrasoundImager(const Options& options, std::shared_ptr<const EchoMap> echoes);
  UltrasoundImager(const UltrasoundImager&) = delete;
  UltrasoundImager& operator=(const UltrasoundImager&) = delete;

  ImageResult render(const ImagedState& state) noexcept;

  /// Of the last image, rows from the top: height × width gray values.
  std::span<const std::uint8_t> pixels() const { return pixels_; }
  /// Its place: from pixel coordinates in mm (ImagePlane::image_in_plane) to the world.
  const RigidTransform& image_pose() const { return X_WG_; }
  const ImagePlane& plane() const { return plane_; }
  const PointSpread& point_spread() const { return spread_; }
  const InverseField& inverse() const { return inverse_; }

  // The scan of the last image before scan conversion: lines × samples_per_line, sample_mm apart.
  std::size_t samples_per_line() const { return samples_; }
  double sample_mm() const { return spread_.sample_mm(); }
  std::span<const float> gray_scan() const { return gray_; }
  /// The envelope's level, dB, of a gray value within the dynamic range.
  double level_db(double gray) const { return gray / gray_per_db_ - offset_db_; }

 private:
  struct Patch {                      // of the plane's grid
    std::size_t column = 0, row = 0;  // of its first node
    std::uint64_t used = 0;           // by the scan: a bit for each of its nodes
  };
  void find_patches(const std::vector<bool>& is_used);
  GridPlace locate(const PlanePoint& p) const noexcept;
  void map_plane() noexcept;
  void map_patch(const Patch& patch) noexcept;
  void place_nodes(std::size_t line) noexcept;
  void scatter_line(std::size_t line) noexcept;
  void add_instruments() noexcept;
  void spread_along(std::size_t line) noexcept;
  void spread_across(std::size_t segment) noexcept;
  void find_first_segments();
  void make_contact();
  void make_layers(double wall_mm);
  void make_pixels();

  UltrasoundSettings settings_;
  std::shared_ptr<const EchoMap> echo_map_;
  ImagePlane plane_;
  InverseField inverse_;
  Speckle speckle_;
  std::size_t segments_;
  std::size_t per_segment_, samples_;  // samples of the scan
  PointSpread spread_;
  InstrumentEchoes instruments_;
  const ScanLoops& loops_;
  std::size_t threads_;
  bool keeps_solution_;
  float offset_db_, gray_per_db_, tgc_per_mm_, loss_per_mm_;

  // The plane's grid: what is known at its nodes, and which of them the scan uses. It is twice as fine as that of the
  // inverse field, and begins kGridOffset of its steps within that.
  static constexpr double kGridMm = 1;
  static constexpr std::size_t kGridOffset = 2;
  double grid_left_ = 0, grid_bottom_ = 0;
  std::size_t grid_columns_ = 0, grid_rows_ = 0;
  std::vector<ScanNode> grid_;
  std::vector<Patch> patches_;
  std::vector<GridPlace> places_;  // of each scan node

  std::size_t padding_;                     // zeros before and after each line's scatterers, for the pulse
  std::size_t scatter_stride_;              // of scattered_re_, scattered_im_
  std::size_t margin_;                      // lines of zeros before the first, for the beam
  std::size_t groups_;                      // of LateralKernel::kTogether lines
  std::size_t wide_stride_;                 // of wide_re_, wide_im_
  std::vector<std::size_t> first_segment_;  // of each line, from where on it is made (LateralKernel::step)
  std::vector<ScanNode> nodes_;             // lines × (segments + 1)
  std::vector<float> loss_;                 // as many, dB
  std::vector<float> contact_loss_;         // of lines, dB: where the probe's surface has air before it
  std::vector<float> scattered_re_, scattered_im_;  // lines, each padded
  std::vector<float> re_, im_;                      // lines, after pulse and beam
  std::vector<float> wide_re_, wide_im_;            // after the pulse, with lines of zeros on both sides
  std::vector<float> gray_;
  std::vector<float> layers_, noise_;  // dB of the rectal wall, of scatterers; the receiver's, of samples
  std::vector<PixelSource> sources_;
  std::vector<std::uint8_t> pixels_;
  RigidTransform X_WG_;
  std::uint64_t tick_ = 0;
};

}  // namespace brachy
