#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/daemon/loops/frozen_gland.h"
#include "apps/daemon/loops/tick_field.h"
#include "core/scene/scene.h"
#include "core/ultrasound/ultrasound_imager.h"
#include "haptics/devices/stepper.h"
#include "net/session/server_options.h"
#include "net/wire/image_pixels.h"
#include "net/wire/messages.h"

namespace brachy {

/// What is set at the console, for the ultrasound thread.
struct ScannerSettings {
  UltrasoundSettings settings;  ///< array: of one view
  bool is_biplane = false;      ///< transverse and sagittal instead of settings.array
  bool is_frozen = false;
  StepperPlace place;         ///< of a probe that no pose moves
  std::uint64_t version = 0;  ///< of `settings` and is_biplane
  net::ImageDemand demand;
};

/// An image on its way to the io thread.
struct ScannedImage {
  net::ImageMessage plain, packed;  ///< the same; data empty where it is not asked for
};

/// The daemon's ultrasound scanner: images of the ticks that it is given, in a field of its own.
/// Threads: one. Allocates where settings or the run change; scan() does not otherwise, once it has filled `out`.
class UltrasoundScanner {
 public:
  static constexpr std::size_t kMostViews = 2;

  /// `X_WR`: the probe at rest (resting_probe).
  UltrasoundScanner(const Scene& scene, std::shared_ptr<const EchoMap> echoes, const RigidTransform& X_WR);

  /// Takes the settings where their version is new. Throws UserError as ImagePlane.
  void set(const ScannerSettings& settings);
  void set_demand(const net::ImageDemand& demand) { settings_.demand = demand; }
  std::size_t views() const { return settings_.is_biplane ? 2 : 1; }

  /// The probe's stepper moves for dt_s, where no pose moves the probe.
  void move(double dt_s) noexcept { stepper_.move(settings_.place, dt_s); }

  /// Computes the tick's field. `model`: of the newest run. False where that of the tick's run is not there: no image.
  bool take(const ImagedTick& tick, const RunModel& model);
  /// The view's image of the tick taken last; where there is none the last one, marked as held. False: it has no image
  /// at all yet. Sets the message but for `frozen`.
  bool scan(const ImagedTick& tick, std::size_t view, ScannedImage& out) noexcept;
  /// Of the last scan of any view.
  ImageResult result() const { return result_; }
  /// The view's last image again, marked as frozen. False: there is none.
  bool repeat(const ImagedTick& newest, std::size_t view, ScannedImage& out) noexcept;
  /// A surface (at rest, the body's frame) as the last scan's field has deformed it. Nothing where the last image is
  /// not of that field: it stood, or there is none. Allocates.
  std::shared_ptr<const FrozenGland> deformed(const std::vector<Vec3>& rest);

 private:
  struct View {
    net::ScannerArray array{};
    std::unique_ptr<UltrasoundImager> imager;  ///< its pixels are the last image
    bool has_image = false;
    std::uint64_t tick = 0;
    std::int64_t publish_ns = 0;
    std::uint16_t flags = 0;  ///< of that image
  };
  View make_view(const std::string& array) const;
  RigidTransform probe_pose(const ImagedTick& tick) const noexcept;
  void write(View& view, const ImagedTick& newest, std::uint16_t flags, ScannedImage& out) noexcept;

  Scene scene_;
  std::shared_ptr<const EchoMap> echoes_;
  const RigidTransform X_WR_;
  ScannerSettings settings_;
  std::array<View, kMostViews> views_;
  std::array<std::uint64_t, 5> sequences_{};  // by ScannerArray
  Stepper stepper_;
  net::PixelPacker packer_;
  ImageResult result_ = ImageResult::kNew;

  TickField field_;
  std::uint64_t taken_tick_ = 0;  // the field's tick, and where the body was
  BodyFrame taken_frame_;
};

/// "transverse", "sagittal" or "end_fire".
net::ScannerArray scanner_array(const std::string& array);

}  // namespace brachy
