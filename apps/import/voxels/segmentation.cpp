#include "apps/import/voxels/segmentation.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/labels/import_limits.h"
#include "apps/import/voxels/dicom_plane.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/geometry/volume/place_fault.h"

namespace brachy {
namespace {

constexpr double kOffLineMm = 0.01;  // positions are decimal strings

/// The item of a functional group: the frame's own, else the one that all frames share.
DicomItem group_of(const DicomItem& data, const DicomItem& frame, const DicomItem& shared,
                   const DicomTag& tag) {
  for (const DicomItem& groups : {frame, shared})
    if (const auto items = groups.sequence(tag); !items.empty()) return items.front();
  data.refuse(tag, "is missing in a frame; export the segmentation again");
}

struct SegmentFrame {
  DicomPlane plane;
  double height = 0;  ///< along the normal, from the first frame
  std::size_t slice = 0;
  std::uint16_t segment = 0;  ///< 0: each pixel is its segment's number
};

std::vector<SegmentFrame> frames_of(const DicomItem& data, std::size_t count, bool has_numbers) {
  const std::vector<DicomItem> own = data.sequence(tag::kFrameGroups),
                               shared = data.sequence(tag::kSharedGroups);
  if (own.size() != count)
    data.refuse(tag::kFrameGroups, "has " + std::to_string(own.size()) + " items for " +
                                       std::to_string(count) + " frames; export it again");
  std::vector<SegmentFrame> frames;
  for (const DicomItem& frame : own) {
    const DicomItem& of_all = shared.empty() ? frame : shared.front();
    const auto group = [&](const DicomTag& tag) { return group_of(data, frame, of_all, tag); };
    SegmentFrame one{
        dicom_plane(group(tag::kPlanePositions), group(tag::kPlaneOrientations), group(tag::kPixelMeasures))};
    if (!has_numbers)
      one.segment = static_cast<std::uint16_t>(
          group(tag::kSegmentIdentification).count(tag::kReferencedSegment, 1, 65535));
    frames.push_back(one);
  }
  return frames;
}

/// The slices' grid; the frames get their slice.
VoxelGrid place_frames(const DicomItem& data, std::vector<SegmentFrame>& frames, std::size_t columns,
                       std::size_t rows) {
  const DicomPlane& first = frames.front().plane;
  std::vector<double> heights;
  for (SegmentFrame& frame : frames) {
    const DicomPlane& plane = frame.plane;
    const Vec3 off = plane.corner - first.corner;
    frame.height = first.normal.dot(off);
    if ((plane.along_row - first.along_row).norm() > 1e-3 ||
        (plane.along_column - first.along_column).norm() > 1e-3 ||
        std::abs(plane.row_spacing / first.row_spacing - 1) > 1e-3 ||
        std::abs(plane.column_spacing / first.column_spacing - 1) > 1e-3 ||
        (off - frame.height * first.normal).norm() > kOffLineMm)
      data.refuse(tag::kPlanePositions, "frames are no stack of one orientation; export one volume");
    heights.push_back(frame.height);
  }
  std::ranges::sort(heights);
  double gap = 0;  // the least one: frames without a voxel are missing
  for (std::size_t n = 1; n < heights.size(); ++n)
    if (const double own = heights[n] - heights[n - 1]; own > kOffLineMm && (gap == 0 || own < gap))
      gap = own;
  if (const auto shared = data.sequence(tag::kSharedGroups); !shared.empty())
    if (const auto measures = shared.front().sequence(tag::kPixelMeasures); !measures.empty())
      for (const DicomTag& tag : {tag::kSliceThickness, tag::kSpacingBetweenSlices}) {
        const double stated = measures.front().optional_number(tag).value_or(0);
        // The spacing comes before the least gap, and so does the thickness where there is none.
        if (stated > 0 &&
            (gap == 0 || (tag.element == tag::kSpacingBetweenSlices.element && stated < gap + kOffLineMm)))
          gap = stated;
      }
  if (gap == 0) gap = 1;
  const double count = std::round((heights.back() - heights.front()) / gap) + 1;
  if (!(count * static_cast<double>(columns * rows) <= static_cast<double>(kMostVoxels)))
    data.refuse(tag::kRows, "the slices have over 2^29 voxels; crop them");
  VoxelGrid grid{{columns, rows, static_cast<std::size_t>(count)},
                 first.corner + heights.front() * first.normal,
                 Mat3::Identity()};
  // Many short steps of a rounded distance are off: the whole counts.
  const double step = count > 1 ? (heights.back() - heights.front()) / (count - 1) : gap;
  grid.steps.col(0) = first.column_spacing * first.along_row;
  grid.steps.col(1) = first.row_spacing * first.along_column;
  grid.steps.col(2) = step * first.normal;
  if (const std::string fault = place_fault(grid, kLabelIndependence); !fault.empty())
    data.refuse(tag::kPixelMeasures, fault);
  for (SegmentFrame& frame : frames) {
    const double at = (frame.height - heights.front()) / step;
    if (std::abs(at - std::round(at)) > 0.05)
      data.refuse(tag::kPlanePositions, "slices are not evenly spaced: one lies " + text_of(frame.height) +
                                            " mm from the first; export one volume");
    frame.slice = static_cast<std::size_t>(std::lround(at));
  }
  return grid;
}

/// PCS-values of CIE L*a*b* (PS3.3, C.10.7.1.1; D50) in sRGB (IEC 61966-2-1, adapted by Bradford).
std::array<double, 3> rgb_of_lab(const std::vector<double>& stored) {
  const double L = stored[0] * 100 / 65535, a = stored[1] * 255 / 65535 - 128,
               b = stored[2] * 255 / 65535 - 128;
  const auto unpacked = [](double t) {
    return t > 6.0 / 29 ? t * t * t : 3 * (6.0 / 29) * (6.0 / 29) * (t - 4.0 / 29);
  };
  const double y = (L + 16) / 116;
  const Vec3 tristimulus(0.9642 * unpacked(y + a / 500), unpacked(y), 0.8249 * unpacked(y - b / 200));
  const Mat3 linear{{3.1339, -1.6169, -0.4906}, {-0.9785, 1.9160, 0.0333}, {0.0720, -0.2290, 1.4057}};
  const Vec3 rgb = linear * tristimulus;
  std::array<double, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = std::clamp(rgb[static_cast<Eigen::Index>(c)], 0.0, 1.0);
    colour[c] = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  }
  return colour;
}

LabelMap::Segment segment_of(const DicomItem& item, std::size_t least_number) {
  LabelMap::Segment segment;
  segment.value = static_cast<std::uint16_t>(item.count(tag::kSegmentNumber, least_number, 65535));
  segment.name = item.text(tag::kSegmentLabel);
  if (const std::vector<double> lab = item.numbers(tag::kSegmentColour); lab.size() == 3)
    segment.colour = rgb_of_lab(lab);
  return segment;
}

/// Writes a segment's frames into the first layer in which all of its voxels are free.
class SegmentLayers {
 public:
  SegmentLayers(const DicomItem& data, const DicomFile::PackedPixels& pixels, std::uint8_t least,
                LabelMap& map)
      : data_(data), pixels_(pixels), least_(least), map_(map) {}

  std::size_t add(std::uint16_t segment,
                  const std::vector<std::pair<std::size_t, std::size_t>>& frame_slices) {
    std::size_t layer = 0;
    while (layer < map_.layers.size() && !is_free(layer, frame_slices)) ++layer;
    if (layer == map_.layers.size()) {
      if ((layer + 1) * map_.grid.count() > kMostVoxels)
        data_.refuse(tag::kSegments, "overlapping segments have over 2^29 voxels; export fewer");
      map_.layers.emplace_back(map_.grid.count(), std::uint16_t{0});
    }
    for (const auto& [frame, slice] : frame_slices)
      for (std::size_t n = 0; n < plane(); ++n)
        if (is_inside(frame, n)) map_.layers[layer][slice * plane() + n] = segment;
    return layer;
  }

 private:
  std::size_t plane() const { return pixels_.rows * pixels_.columns; }
  bool is_inside(std::size_t frame, std::size_t n) const { return pixels_.at(frame * plane() + n) >= least_; }
  bool is_free(std::size_t layer,
               const std::vector<std::pair<std::size_t, std::size_t>>& frame_slices) const {
    for (const auto& [frame, slice] : frame_slices)
      for (std::size_t n = 0; n < plane(); ++n)
        if (map_.layers[layer][slice * plane() + n] != 0 && is_inside(frame, n)) return false;
    return true;
  }

  const DicomItem& data_;
  const DicomFile::PackedPixels& pixels_;
  std::uint8_t least_;
  LabelMap& map_;
};

}  // namespace

LabelMap read_segmentation(const DicomFile& file) {
  const DicomItem data = file.data();
  const std::string type = data.text(tag::kSegmentationType);
  const bool has_numbers = type == "LABELMAP";
  if (!has_numbers && type != "BINARY" && type != "FRACTIONAL")
    data.refuse(tag::kSegmentationType, "is \"" + one_short_line(type) + "\"; export it as BINARY");
  const DicomFile::PackedPixels pixels = file.packed_pixels();
  std::vector<SegmentFrame> frames = frames_of(data, pixels.frames, has_numbers);
  LabelMap map;
  map.is_declared = true;
  map.grid = place_frames(data, frames, pixels.columns, pixels.rows);
  // 0 is the background, which a label map may list (PS3.3, C.8.20.4.4).
  for (const DicomItem& item : data.sequence(tag::kSegments))
    if (LabelMap::Segment segment = segment_of(item, has_numbers ? 0 : 1); segment.value != 0)
      map.segments.push_back(std::move(segment));
  if (has_numbers) {
    std::vector<std::uint16_t>& values = map.layers.emplace_back(map.grid.count(), std::uint16_t{0});
    const std::size_t plane = pixels.rows * pixels.columns;
    for (std::size_t f = 0; f < frames.size(); ++f)
      for (std::size_t n = 0; n < plane; ++n) values[frames[f].slice * plane + n] = pixels.at(f * plane + n);
    return map;
  }
  const double most = data.optional_number(tag::kMostFractional).value_or(255);
  const auto least =
      static_cast<std::uint8_t>(type == "BINARY" ? 1 : std::clamp(std::ceil(0.5 * most), 1.0, 255.0));
  SegmentLayers layers(data, pixels, least, map);
  std::map<std::uint16_t, std::vector<std::pair<std::size_t, std::size_t>>> frames_by_segment;
  for (std::size_t f = 0; f < frames.size(); ++f)
    frames_by_segment[frames[f].segment].emplace_back(f, frames[f].slice);
  for (LabelMap::Segment& segment : map.segments)
    if (const auto own = frames_by_segment.find(segment.value); own != frames_by_segment.end())
      segment.layer = layers.add(segment.value, own->second);
  if (map.layers.empty()) map.layers.emplace_back(map.grid.count(), std::uint16_t{0});
  return map;
}

}  // namespace brachy
