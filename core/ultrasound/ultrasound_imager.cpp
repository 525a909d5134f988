#include "core/ultrasound/ultrasound_imager.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/base/share_out.h"
#include "core/ultrasound/hashed_noise.h"

namespace brachy {
namespace {

// Of the dynamic range, above the gland's speckle: what is brighter than that is white.
constexpr double kHeadroomShare = 0.56;
constexpr std::size_t kLineOfCache = 16;  // floats
constexpr double kContactPatchMm = 4;     // of the probe's surface: with gel, or air
constexpr double kNoContactDb = 80;       // that a line loses in air

std::size_t segments_of(double depth_mm) {
  return static_cast<std::size_t>(std::ceil(depth_mm / ScanSteps::kSegmentMm)) + 1;
}

// Samples of the scan for each of scatterers: no finer than the pixels.
std::size_t per_scatter_of(const ImagePlane& plane) {
  return plane.spacing_mm() >= double{ScanSteps::kScatterMm} ? 1 : ScanSteps::kMostPerScatter;
}

// The layers of the rectal wall against the probe, as a share of its thickness (B. Kimmey et al., Gastroenterology 96,
// 1989: five layers): balloon and mucosa bright, muscularis mucosae dark, submucosa bright, muscularis propria dark,
// fat bright.
struct Layer {
  double end, db;
};
constexpr std::array<Layer, 5> kLayers = {{{0.12, 16}, {0.3, -9}, {0.5, 6}, {0.8, -10}, {1, 4}}};

}  // namespace

UltrasoundImager::UltrasoundImager(const Options& options, std::shared_ptr<const EchoMap> echoes)
    : settings_(options.settings),
      echo_map_(std::move(echoes)),
      plane_(settings_, options.probe_radius_mm),
      inverse_(plane_),
      speckle_(speckle_of(settings_)),
      segments_(segments_of(settings_.depth_mm)),
      per_segment_(ScanSteps::kScatter * per_scatter_of(plane_)),
      samples_(segments_ * per_segment_),
      spread_(settings_, plane_, speckle_, segments_, per_scatter_of(plane_)),
      instruments_(settings_, plane_, options.needle_length_mm, options.needle_radius_mm, options.max_needles,
                   options.max_seeds),
      loops_(scan_loops(options.target)),
      threads_(static_cast<std::size_t>(std::max(1, options.threads))),
      keeps_solution_(options.keeps_solution),
      padding_((spread_.axial().half / ScanSteps::kScatter + 1) * ScanSteps::kScatter),
      scatter_stride_(segments_ * ScanSteps::kScatter + 2 * padding_),
      margin_(LateralKernel::kMostHalf + 2 * LateralKernel::kTogether),
      groups_((plane_.lines() + LateralKernel::kTogether - 1) / LateralKernel::kTogether),
      // An odd number of cache lines: the beam's kernel goes down a column, which would else use few of the
      // cache's sets.
      wide_stride_(((samples_ + kLineOfCache - 1) / kLineOfCache | 1) * kLineOfCache) {
  const double range = settings_.dynamic_range_db;
  gray_per_db_ = static_cast<float>(255 / range);
  offset_db_ = static_cast<float>(settings_.gain_db + range * (1 - kHeadroomShare));
  loss_per_mm_ = static_cast<float>(0.2 * settings_.attenuation_db_per_cm_mhz * settings_.frequency_mhz);
  tgc_per_mm_ = static_cast<float>(loss_per_mm_ + 0.1 * settings_.tgc_extra_db_per_cm);

  const std::size_t lines = plane_.lines();
  static_assert(InverseField::kSpacingMm == 2 * kGridMm);
  grid_left_ = inverse_.left_mm() + kGridMm * kGridOffset;
  grid_bottom_ = inverse_.bottom_mm() + kGridMm * kGridOffset;
  // The last segment ends beyond the depth shown.
  grid_columns_ = static_cast<std::size_t>((2 * plane_.right_mm() + 8 * kGridMm) / kGridMm);
  grid_rows_ = static_cast<std::size_t>((plane_.top_mm() - plane_.bottom_mm() + 8 * kGridMm) / kGridMm);
  grid_.resize(grid_columns_ * grid_rows_);
  std::vector<bool> is_used(grid_.size());
  for (std::size_t l = 0; l < lines; ++l)
    for (std::size_t k = 0; k <= segments_; ++k) {
      // Beyond the depth that is shown as at its end.
      const double depth =
          std::min(ScanSteps::kSegmentMm * static_cast<double>(k), plane_.depth_mm() + kGridMm);
      const GridPlace& place = places_.emplace_back(locate(plane_.at(static_cast<double>(l), depth)));
      for (const std::size_t corner : {std::size_t{0}, std::size_t{1}, grid_columns_, grid_columns_ + 1})
        is_used[place.first + corner] = true;
    }
  find_patches(is_used);

  nodes_.resize(lines * (segments_ + 1));
  loss_.resize(nodes_.size());
  find_first_segments();
  scattered_re_.resize(lines * scatter_stride_ + AxialKernel::kMost);
  scattered_im_.resize(scattered_re_.size());
  re_.resize(groups_ * LateralKernel::kTogether * samples_);
  im_.resize(re_.size());
  wide_re_.resize((lines + 2 * margin_) * wide_stride_);
  wide_im_.resize(wide_re_.size());
  gray_.resize((lines + 1) * samples_ + 1);
  make_contact();
  make_layers(options.rectal_wall_mm);
  make_pixels();
}

// What each line loses where parts of its aperture have no contact, there and back.
void UltrasoundImager::make_contact() {
  contact_loss_.assign(plane_.lines(), 0);
  if (settings_.coupling >= 1) return;
  const auto has_contact = [&](double at_mm) {
    const auto patch = static_cast<std::int32_t>(std::floor(at_mm / kContactPatchMm));
    return hashed(speckle_.seed ^ hashed(static_cast<std::uint32_t>(patch) + 5)) <
           settings_.coupling * 4294967296.0;
  };
  constexpr int kPlaces = 32;  // of the aperture
  for (std::size_t line = 0; line < plane_.lines(); ++line) {
    const double middle = plane_.line_spacing_mm(0) * static_cast<double>(line);
    int covered = 0;
    for (int k = 0; k < kPlaces; ++k)
      covered += has_contact(middle + settings_.aperture_mm * ((k + 0.5) / kPlaces - 0.5));
    const double share = static_cast<double>(covered) / kPlaces;
    contact_loss_[line] = static_cast<float>(std::min(kNoContactDb, -40 * std::log10(std::max(share, 1e-3))));
  }
}

// The grid's cell that has p, within the grid.
GridPlace UltrasoundImager::locate(const PlanePoint& p) const noexcept {
  const double x = std::clamp((p.a - grid_left_) / kGridMm, 0.0, static_cast<double>(grid_columns_) - 1.001);
  const double y = std::clamp((p.b - grid_bottom_) / kGridMm, 0.0, static_cast<double>(grid_rows_) - 1.001);
  const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
  return {static_cast<std::uint32_t>(j * grid_columns_ + i), static_cast<float>(x - static_cast<double>(i)),
          static_cast<float>(y - static_cast<double>(j))};
}

void UltrasoundImager::make_layers(double wall_mm) {
  layers_.assign(segments_ * ScanSteps::kScatter, 0);
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    const double z = double{ScanSteps::kScatterMm} * static_cast<double>(k);
    if (z >= wall_mm) break;
    const auto layer = std::ranges::find_if(kLayers, [&](const Layer& l) { return z < l.end * wall_mm; });
    if (layer != kLayers.end()) layers_[k] = static_cast<float>(layer->db);
  }
  for (std::size_t k = 0; k < samples_; ++k) {
    const double z = spread_.sample_mm() * static_cast<double>(k);
    // A uniform value has a third of its square on average, and there are two.
    noise_.push_back(
        static_cast<float>(std::sqrt(1.5) * std::pow(10, 0.05 * (settings_.noise_db + tgc_per_mm_ * z))));
  }
}

void UltrasoundImager::make_pixels() {
  pixels_.assign(plane_.width() * plane_.height(), 0);
  const double last_line = static_cast<double>(plane_.lines() - 1);
  for (std::size_t row = 0; row < plane_.height(); ++row)
    for (std::size_t column = 0; column < plane_.width(); ++column) {
      const LinePoint p = plane_.find(plane_.pixel(static_cast<double>(column), static_cast<double>(row)));
      PixelSource& source = sources_.emplace_back();
      if (!plane_.is_in_scan(p)) continue;
      const double sample = p.depth / spread_.sample_mm();
      const auto l = static_cast<std::size_t>(std::min(p.line, std::max(0.0, last_line - 1e-6)));
      const auto s = std::min(static_cast<std::size_t>(sample), samples_ - 2);
      source = {static_cast<std::uint32_t>(l * samples_ + s),
                static_cast<float>(sample - static_cast<double>(s)),
                static_cast<float>(p.line - static_cast<double>(l))};
    }
}

ImageResult UltrasoundImager::render(const ImagedState& state) noexcept {
  if (state.verdict == Verdict::kFolded) return ImageResult::kFolded;
  const RigidTransform X_WI = state.X_WP * plane_.in_probe();
  if (!keeps_solution_) inverse_.reset();
  if (!inverse_.solve(state.field, state.frame, X_WI)) return ImageResult::kNotSolved;
  X_WG_ = X_WI * plane_.image_in_plane();
  tick_ = state.tick;
  map_plane();
  instruments_.find(X_WI, state.needles, state.seeds, spread_);
  std::ranges::fill(loss_, 0.0F);
  for (std::size_t line = 0; line < plane_.lines(); ++line)
    loss_[line * (segments_ + 1)] = contact_loss_[line];
  instruments_.add_losses(spread_, segments_, loss_);
  share_out(plane_.lines(), threads_, [&](std::size_t line, std::size_t) {
    place_nodes(line);
    scatter_line(line);
  });
  share_out(plane_.lines(), threads_, [&](std::size_t line, std::size_t) { spread_along(line); });
  add_instruments();
  share_out(segments_, threads_, [&](std::size_t segment, std::size_t) { spread_across(segment); });
  const std::uint32_t key = hashed(speckle_.seed ^ hashed(static_cast<std::uint32_t>(tick_) + 3));
  share_out(plane_.lines(), threads_, [&](std::size_t line, std::size_t) {
    const std::size_t at = line * samples_;
    loops_.detect(&re_[at], &im_[at], noise_.data(), hashed(key + static_cast<std::uint32_t>(line)), samples_,
                  offset_db_, gray_per_db_, &gray_[line * samples_]);
  });
  share_out(plane_.height(), threads_, [&](std::size_t row, std::size_t) {
    const std::size_t at = row * plane_.width();
    loops_.convert(gray_.data(), samples_, &sources_[at], plane_.width(), &pixels_[at]);
  });
  return ImageResult::kNew;
}

void UltrasoundImager::find_patches(const std::vector<bool>& is_used) {
  constexpr std::size_t kSide = InverseField::Patch::kSide;
  for (std::size_t row = 0; row < grid_rows_; row += kSide)
    for (std::size_t column = 0; column < grid_columns_; column += kSide) {
      Patch patch{column, row};
      for (std::size_t k = 0; k < kSide * kSide; ++k) {
        const std::size_t i = column + k % kSide, j = row + k / kSide;
        if (i < grid_columns_ && j < grid_rows_ && is_used[j * grid_columns_ + i])
          patch.used |= std::uint64_t{1} << k;
      }
      if (patch.used != 0) patches_.push_back(patch);
    }
}

// What is at the nodes of the plane's grid.
void UltrasoundImager::map_plane() noexcept {
  share_out(patches_.size(), threads_, [&](std::size_t p, std::size_t) { map_patch(patches_[p]); });
}

void UltrasoundImager::map_patch(const Patch& patch) noexcept {
  constexpr std::size_t kSide = InverseField::Patch::kSide;
  static_assert(kSide * kSide == EchoPlaces::kMost);
  InverseField::Patch field;
  inverse_.find(patch.column + kGridOffset, patch.row + kGridOffset, field);
  EchoPlaces places;
  std::array<std::uint8_t, EchoPlaces::kMost> from;  // of a place, in the patch
  for (std::uint64_t used = patch.used; used != 0; used &= used - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(used));
    from[places.count] = static_cast<std::uint8_t>(k);
    places.x[places.count] = field.X[0][k / kSide][k % kSide];
    places.y[places.count] = field.X[1][k / kSide][k % kSide];
    places.z[places.count++] = field.X[2][k / kSide][k % kSide];
  }
  EchoTissues tissues;
  echo_map_->at(places, loops_, tissues);
  for (std::size_t i = 0; i < places.count; ++i) {
    const std::size_t row = from[i] / kSide, column = from[i] % kSide;
    float* node = grid_[(patch.row + row) * grid_columns_ + patch.column + column].c;
    for (std::size_t d = 0; d < 3; ++d) {
      node[ScanNode::kX + d] = field.X[d][row][column];
      node[ScanNode::kByN + d] = field.by_n[d][row][column];
    }
    for (std::size_t b = 0; b < EchoMap::kBoundaries; ++b)
      node[ScanNode::kDistance + b] = tissues.distance_mm[b][i];
    node[ScanNode::kOutside] = tissues.outside_db[i];
    node[ScanNode::kTexture] = tissues.texture_db[i];
    node[ScanNode::kLoss] = tissues.loss_share[i];
  }
}

// A line's nodes from the grid; and along them what tissue and instruments take, and what the console gives back.
void UltrasoundImager::place_nodes(std::size_t line) noexcept {
  const std::size_t first = line * (segments_ + 1);
  float gain = 0;
  loops_.place(grid_.data(), grid_columns_, &places_[first], segments_ + 1, &nodes_[first]);
  for (std::size_t k = 0; k <= segments_; ++k) {
    float* out = nodes_[first + k].c;
    gain -= loss_[first + k];
    out[ScanNode::kGain] = gain;
    gain += ScanSteps::kSegmentMm * (tgc_per_mm_ - out[ScanNode::kLoss] * loss_per_mm_);
  }
}

// Near the probe a fan's lines lie closer than the scatterers do.
void UltrasoundImager::find_first_segments() {
  for (std::size_t line = 0; line < plane_.lines(); ++line) {
    std::size_t first = segments_;
    while (first > 0 && line % spread_.lateral(first - 1).step == 0) --first;
    first_segment_.push_back(first);
  }
}

// Also the segments before the first that the pulse reaches from it.
void UltrasoundImager::scatter_line(std::size_t line) noexcept {
  const std::size_t reach = padding_ / ScanSteps::kScatter, wanted = first_segment_[line];
  const std::size_t first = wanted - std::min(wanted, reach), start = first * ScanSteps::kScatter;
  const std::size_t at = line * scatter_stride_ + padding_ + start;
  loops_.scatter(&nodes_[line * (segments_ + 1) + first], segments_ - first, speckle_,
                 spread_.interface_scale() + first * EchoMap::kBoundaries, &layers_[start],
                 &scattered_re_[at], &scattered_im_[at]);
}

void UltrasoundImager::spread_along(std::size_t line) noexcept {
  const std::size_t first = first_segment_[line];
  if (first == segments_) return;
  const std::size_t from = line * scatter_stride_ + padding_ + first * ScanSteps::kScatter -
                           spread_.axial().half,
                    to = (line + margin_) * wide_stride_ + first * per_segment_;
  loops_.along(&scattered_re_[from], spread_.axial(), segments_ - first, &wide_re_[to]);
  loops_.along(&scattered_im_[from], spread_.axial(), segments_ - first, &wide_im_[to]);
}

// With the pulse's shape, shared between the two nearest lines that are made.
void UltrasoundImager::add_instruments() noexcept {
  const auto half = static_cast<std::ptrdiff_t>(spread_.pulse_half());
  for (const InstrumentEchoes::Echo& echo : instruments_.echoes()) {
    const float sample = echo.depth / static_cast<float>(spread_.sample_mm());
    const auto s = static_cast<std::ptrdiff_t>(sample);
    const float t = sample - static_cast<float>(s);
    const auto own = static_cast<std::size_t>(s) / per_segment_;
    if (own >= segments_) continue;
    const auto line = static_cast<std::size_t>(echo.line);
    const float gain = nodes_[line * (segments_ + 1) + own].c[ScanNode::kGain];
    const float pressure = echo.pressure * std::pow(10.0F, 0.05F * gain);
    for (std::ptrdiff_t k = -half; k <= half + 1; ++k) {
      const std::ptrdiff_t at = s + k;
      if (at < 0 || at >= static_cast<std::ptrdiff_t>(samples_)) continue;
      const std::size_t segment = static_cast<std::size_t>(at) / per_segment_,
                        step = spread_.lateral(segment).step, near = line / step * step;
      const float u = (echo.line - static_cast<float>(near)) / static_cast<float>(step);
      const float value =
          pressure * spread_.pulse(static_cast<float>(k) - t) / spread_.point_response(segment);
      float* to = &wide_re_[(near + margin_) * wide_stride_ + static_cast<std::size_t>(at)];
      to[0] += value * (1 - u);
      if (near + step < plane_.lines()) to[step * wide_stride_] += value * u;
    }
  }
}

void UltrasoundImager::spread_across(std::size_t segment) noexcept {
  const LateralKernel& kernel = spread_.lateral(segment);
  const std::size_t to = segment * per_segment_, from = margin_ * wide_stride_ + to;
  const auto in_stride = static_cast<std::ptrdiff_t>(wide_stride_),
             out_stride = static_cast<std::ptrdiff_t>(samples_);
  loops_.across(&wide_re_[from], in_stride, kernel, groups_, per_segment_, &re_[to], out_stride);
  loops_.across(&wide_im_[from], in_stride, kernel, groups_, per_segment_, &im_[to], out_stride);
}

}  // namespace brachy
