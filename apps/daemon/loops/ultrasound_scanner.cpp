#include "apps/daemon/loops/ultrasound_scanner.h"

#include <utility>

#include "core/scene/load_ultrasound.h"

namespace brachy {

net::ScannerArray scanner_array(const std::string& array) {
  if (array == "sagittal") return net::ScannerArray::kSagittal;
  return array == "end_fire" ? net::ScannerArray::kEndFire : net::ScannerArray::kTransverse;
}

UltrasoundScanner::UltrasoundScanner(const Scene& scene, std::shared_ptr<const EchoMap> echoes,
                                     const RigidTransform& X_WR)
    : scene_(scene),
      echoes_(std::move(echoes)),
      X_WR_(X_WR),
      packer_(static_cast<std::size_t>(scene.ultrasound.width_px * scene.ultrasound.height_px)) {}

void UltrasoundScanner::set(const ScannerSettings& settings) {
  const bool is_same = views_[0].imager && settings.version == settings_.version;
  settings_ = settings;
  if (is_same) return;
  views_[0] = make_view(settings.is_biplane ? "transverse" : settings.settings.array);
  views_[1] = settings.is_biplane ? make_view("sagittal") : View{};
}

UltrasoundScanner::View UltrasoundScanner::make_view(const std::string& array) const {
  Scene scene = scene_;
  scene.ultrasound = settings_.settings;
  scene.ultrasound.array = array;
  UltrasoundImager::Options options = imager_options(scene);
  options.threads = 1;  // its thread alone, beside the 200 Hz loop
  options.keeps_solution = true;
  return {scanner_array(array), std::make_unique<UltrasoundImager>(options, echoes_), false, 0, 0};
}

bool UltrasoundScanner::take(const ImagedTick& tick, const RunModel& model) {
  taken_tick_ = tick.tick;
  taken_frame_ = tick.frame;
  return field_.take(tick, model);
}

bool UltrasoundScanner::scan(const ImagedTick& tick, std::size_t view, ScannedImage& out) noexcept {
  View& v = views_[view];
  const std::span<const NeedleState> instruments = tick.instruments;
  result_ = ImageResult::kNotSolved;
  const Verdict verdict = field_.verdict();
  if (field_.is_taken())
    result_ = v.imager->render({field_.field(), tick.frame, verdict, tick.tick,
                                instruments.first(scene_.needle.count), tick.seeds(), probe_pose(tick)});
  if (result_ == ImageResult::kNew) {
    v.has_image = true;
    v.flags = verdict == Verdict::kInjective ? 0 : net::kImageUncertified;
    v.tick = tick.tick;
    v.publish_ns = tick.publish_ns;
  }
  if (!v.has_image) return false;
  write(v, tick, result_ == ImageResult::kNew ? 0 : net::kImageHeld, out);
  return true;
}

bool UltrasoundScanner::repeat(const ImagedTick& newest, std::size_t view, ScannedImage& out) noexcept {
  if (!views_[view].has_image) return false;
  write(views_[view], newest, net::kImageFrozen, out);
  return true;
}

std::shared_ptr<const FrozenGland> UltrasoundScanner::deformed(const std::vector<Vec3>& rest) {
  if (!field_.is_taken() || result_ != ImageResult::kNew || views_[0].tick != taken_tick_) return nullptr;
  auto gland = std::make_shared<FrozenGland>(FrozenGland{taken_tick_, rest, {}});
  std::vector<Vec3> u(rest.size());
  field_.field().displacements_at(rest, u);
  for (std::size_t i = 0; i < rest.size(); ++i) gland->vertices[i] = taken_frame_.to_world(rest[i] + u[i]);
  for (const View& view : views_)
    if (view.has_image && view.tick == taken_tick_) gland->X_WI.push_back(view.imager->image_pose());
  return gland;
}

RigidTransform UltrasoundScanner::probe_pose(const ImagedTick& tick) const noexcept {
  const bool has_pose = scene_.probe.on && tick.instruments.back().present;
  return has_pose ? tick.instruments.back().X_WN : stepper_.pose(X_WR_);
}

void UltrasoundScanner::write(View& view, const ImagedTick& newest, std::uint16_t flags,
                              ScannedImage& out) noexcept {
  const ImagePlane& plane = view.imager->plane();
  net::ImageMessage& m = out.plain;
  m.array = view.array;
  m.flags = flags | view.flags;
  m.width = static_cast<std::uint16_t>(plane.width());
  m.height = static_cast<std::uint16_t>(plane.height());
  m.sequence = ++sequences_[static_cast<std::size_t>(view.array)];
  m.tick = view.tick;
  m.newest_tick = newest.tick;
  m.publish_ns = view.publish_ns;
  m.spacing_mm = plane.spacing_mm();
  m.X_WI = view.imager->image_pose();
  m.data.clear();
  out.packed.data.clear();
  const auto pixels = view.imager->pixels();
  if (settings_.demand.packed) {
    std::vector<std::uint8_t> data = std::move(out.packed.data);
    packer_.pack(pixels, data);
    out.packed = m;
    out.packed.flags |= net::kImageZlib;
    out.packed.data = std::move(data);
  }
  if (settings_.demand.plain) m.data.assign(pixels.begin(), pixels.end());
}

}  // namespace brachy
