#include "apps/import/labels/label_nifti.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/volume/gzip.h"
#include "core/geometry/volume/nrrd_data.h"
#include "core/geometry/volume/place_fault.h"
#include "core/geometry/volume/voxel_values.h"

namespace brachy {
namespace {

/// Where the fields of a header lie; https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h, …/nifti2.h.
struct NiftiLayout {
  std::size_t size, dim, dim_bytes, datatype, pixdim, real_bytes, vox_offset, scl_slope, units, units_bytes,
      qform_code, code_bytes, quatern, srow, intent_code;
};
constexpr double kIntentLabel = 1002;      // NIFTI_INTENT_LABEL
constexpr double kFarthestData = 1 << 24;  // its extensions are some kilobytes
constexpr NiftiLayout kNifti1{348, 40, 2, 70, 76, 4, 108, 112, 123, 1, 252, 2, 256, 280, 68};
constexpr NiftiLayout kNifti2{540, 16, 8, 12, 104, 8, 168, 176, 500, 4, 344, 4, 352, 400, 504};

class NiftiReader {
 public:
  /// `head`: the file's first bytes, with the header.
  NiftiReader(std::string_view head, const std::string& name, std::size_t most_voxels)
      : bytes_(head), name_(name), most_voxels_(most_voxels) {}
  /// Reads the header; the file must have so many bytes.
  std::size_t read_header();
  /// `file`: all of its bytes.
  LabelMap read_labels(std::string_view file);
  ImageVoxels read_image(std::string_view file);

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& what) const {
    throw UserError(name_ + ": " + field + ": " + what);
  }
  void find_layout();
  double whole(std::size_t at, std::size_t size) const {
    return voxel_value(bytes_, at, {size, true, false, is_big_endian_});
  }
  double real(std::size_t at) const {
    return voxel_value(bytes_, at, {layout_.real_bytes, true, true, is_big_endian_});
  }
  VoxelType type() const;
  std::string_view voxels(std::string_view file) const;
  void name_segments(std::string_view extensions);
  void read_geometry();
  double mm_per_unit() const;
  VoxelGrid sform() const;
  std::optional<VoxelGrid> qform() const;

  std::string_view bytes_;
  const std::string& name_;
  std::size_t most_voxels_;
  VoxelType voxel_;
  double slope_ = 1, intercept_ = 0;
  std::size_t data_begin_ = 0;
  NiftiLayout layout_ = kNifti1;
  bool is_big_endian_ = false;
  LabelMap map_;
};

void NiftiReader::find_layout() {
  for (const NiftiLayout& layout : {kNifti1, kNifti2})
    for (const bool big : {false, true}) {
      if (bytes_.size() < layout.size) continue;
      if (voxel_value(bytes_, 0, {4, true, false, big}) != static_cast<double>(layout.size)) continue;
      layout_ = layout;
      is_big_endian_ = big;
      return;
    }
  refuse("sizeof_hdr", "is not that of NIfTI-1 or NIfTI-2; is it a .nii file, and whole?");
}

VoxelType NiftiReader::type() const {
  const auto code = static_cast<int>(whole(layout_.datatype, 2));
  switch (code) {
    case 2:
      return {1, false, false, is_big_endian_};
    case 4:
      return {2, true, false, is_big_endian_};
    case 8:
      return {4, true, false, is_big_endian_};
    case 16:
      return {4, true, true, is_big_endian_};
    case 64:
      return {8, true, true, is_big_endian_};
    case 256:
      return {1, true, false, is_big_endian_};
    case 512:
      return {2, false, false, is_big_endian_};
    case 768:
      return {4, false, false, is_big_endian_};
    case 1024:
      return {8, true, false, is_big_endian_};
    case 1280:
      return {8, false, false, is_big_endian_};
    default:
      refuse("datatype", "is " + std::to_string(code) + ", no whole number; save it as uint8");
  }
}

// xyzt_units: in the lower three bits that of space.
double NiftiReader::mm_per_unit() const {
  const VoxelType bits{layout_.units_bytes, false, false, is_big_endian_};
  const auto unit = static_cast<unsigned>(voxel_value(bytes_, layout_.units, bits)) & 7U;
  constexpr std::array<double, 4> kMm = {1, 1000, 1, 0.001};  // not said, m, mm, µm
  if (unit >= kMm.size())
    refuse("xyzt_units", "is " + std::to_string(unit) + ", no unit of length; save it in mm");
  return kMm[unit];
}

// Method 3 of the NIFTI-1 data format.
VoxelGrid NiftiReader::sform() const {
  VoxelGrid grid = map_.grid;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) {
      const double value =
          real(layout_.srow + static_cast<std::size_t>(4 * row + column) * layout_.real_bytes);
      (column < 3 ? grid.steps(row, column) : grid.origin[row]) = value;
    }
  return grid;
}

// Method 2: a unit quaternion (a, b, c, d), of which a is left out; nothing where it is longer than 1.
std::optional<VoxelGrid> NiftiReader::qform() const {
  const std::size_t size = layout_.real_bytes;
  const auto at = [&](std::size_t field, std::size_t n) { return real(field + n * size); };
  const double b = at(layout_.quatern, 0), c = at(layout_.quatern, 1), d = at(layout_.quatern, 2);
  const double rest = b * b + c * c + d * d;
  if (!(rest <= 1.0001)) return std::nullopt;
  const Vec3 spacing(at(layout_.pixdim, 1), at(layout_.pixdim, 2),
                     at(layout_.pixdim, 3) * (at(layout_.pixdim, 0) < 0 ? -1 : 1));
  VoxelGrid grid = map_.grid;
  grid.steps =
      Eigen::Quaterniond(std::sqrt(std::max(0.0, 1 - rest)), b, c, d).normalized().toRotationMatrix() *
      spacing.asDiagonal();
  grid.origin = Vec3(at(layout_.quatern, 3), at(layout_.quatern, 4), at(layout_.quatern, 5));
  return grid;
}

/// How far apart two grids of one size put a voxel: a corner's, as both are affine.
double most_apart(const VoxelGrid& a, const VoxelGrid& b) {
  double most = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 ijk;
    for (unsigned k = 0; k < 3; ++k)
      ijk[k] = (corner >> k & 1U) != 0 ? static_cast<double>(a.size[k] - 1) : 0;
    most = std::max(most, (a.position(ijk) - b.position(ijk)).norm());
  }
  return most;
}

void NiftiReader::read_geometry() {
  const bool has_sform = whole(layout_.qform_code + layout_.code_bytes, layout_.code_bytes) > 0;
  const bool has_qform = whole(layout_.qform_code, layout_.code_bytes) > 0;
  if (!has_sform && !has_qform)
    refuse("qform_code",
           "it and sform_code are 0, so nothing says where the map lies; save it with its orientation");
  const std::optional<VoxelGrid> by_quaternion = has_qform ? qform() : std::nullopt;
  if (!has_sform && !by_quaternion)
    refuse("quatern_b", "the quaternion is longer than 1; write the file again");
  const double unit = mm_per_unit();
  map_.grid = has_sform ? sform() : *by_quaternion;
  const double apart = has_sform && by_quaternion ? unit * most_apart(map_.grid, *by_quaternion) : 0;
  map_.grid.steps *= unit;
  map_.grid.origin *= unit;
  if (const std::string fault = place_fault(map_.grid, kLabelIndependence); !fault.empty())
    refuse("sform or qform", fault);
  if (apart > 0.5 * map_.grid.steps.colwise().norm().minCoeff())
    map_.notes.push_back("qform_code: the qform puts the map up to " + text_of(apart) +
                         " mm from where the sform does, which is taken");
}

std::size_t NiftiReader::read_header() {
  find_layout();
  const double dimensions = whole(layout_.dim, layout_.dim_bytes);
  if (!(dimensions >= 3 && dimensions <= 7)) refuse("dim", "must have three axes; save a label map");
  for (std::size_t a = 0; a < static_cast<std::size_t>(dimensions); ++a) {
    const double size = whole(layout_.dim + (a + 1) * layout_.dim_bytes, layout_.dim_bytes);
    if (!(size >= 1 && size <= 1e6) || (a >= 3 && size != 1))
      refuse("dim", "must be three sizes from 1 on, and 1 along other axes; save one 3-D label map");
    if (a < 3) map_.grid.size[a] = static_cast<std::size_t>(size);
  }
  if (map_.grid.count() > most_voxels_)
    refuse("dim", "are over " + std::to_string(most_voxels_) + " voxels; crop the map");
  read_geometry();
  voxel_ = type();
  const double slope = real(layout_.scl_slope), intercept = real(layout_.scl_slope + layout_.real_bytes);
  if (std::isfinite(slope) && slope != 0) {
    slope_ = slope;
    intercept_ = std::isfinite(intercept) ? intercept : 0;
  }
  const double offset =
      layout_.size == kNifti2.size ? whole(layout_.vox_offset, 8) : real(layout_.vox_offset);
  if (!(offset >= static_cast<double>(layout_.size) && offset <= kFarthestData))
    refuse("vox_offset", "lies within the header or far behind it; is it a .nii file?");
  data_begin_ = static_cast<std::size_t>(offset);
  return data_begin_ + map_.grid.count() * voxel_.bytes;
}

std::string_view NiftiReader::voxels(std::string_view file) const {
  const std::size_t end = data_begin_ + map_.grid.count() * voxel_.bytes;
  if (file.size() < end)
    refuse("dim", "with vox_offset are of " + std::to_string(end) + " bytes, but the file has " +
                      std::to_string(file.size()) + "; it is cut off, copy it again");
  return file.substr(data_begin_, end - data_begin_);
}

/// The label table of Connectome Workbench, which TotalSegmentator writes too, in an extension of the header:
/// <Label Key="1" …><![CDATA[prostate]]></Label>.
void NiftiReader::name_segments(std::string_view extensions) {
  constexpr std::string_view kLabel = "<Label Key=\"", kName = "<![CDATA[";
  for (std::size_t at = extensions.find(kLabel); at != extensions.npos; at = extensions.find(kLabel, at)) {
    at += kLabel.size();
    const std::string_view label = extensions.substr(at, extensions.substr(at).find("</Label>"));
    unsigned value = 0;
    const auto [end, error] = std::from_chars(label.data(), label.data() + label.size(), value);
    const std::size_t name = label.find(kName);
    if (error != std::errc() || name == label.npos) continue;
    const std::string_view text = label.substr(name + kName.size());
    const auto segment = std::ranges::find(map_.segments, value, &LabelMap::Segment::value);
    if (segment != map_.segments.end()) segment->name = text.substr(0, text.find("]]>"));
    map_.is_declared = true;
  }
}

LabelMap NiftiReader::read_labels(std::string_view file) {
  const std::string_view data = voxels(file);
  if (slope_ != 1 || intercept_ != 0)
    throw NoLabels(name_ + ": scl_slope: labels are not scaled; save it as whole numbers");
  auto& labels = map_.layers.emplace_back();
  labels.reserve(map_.grid.count());
  append_labels(labels, data, voxel_, name_);
  add_segments_by_value(map_);
  map_.is_declared = whole(layout_.intent_code, layout_.size == kNifti2.size ? 4 : 2) == kIntentLabel;
  name_segments(file.substr(layout_.size, data_begin_ - layout_.size));
  return std::move(map_);
}

ImageVoxels NiftiReader::read_image(std::string_view file) {
  const std::string_view data = voxels(file);
  ImageVoxels volume{map_.grid, {}};
  volume.values.reserve(map_.grid.count());
  for (std::size_t at = 0; at + voxel_.bytes <= data.size(); at += voxel_.bytes) {
    const auto value = static_cast<float>(slope_ * voxel_value(data, at, voxel_) + intercept_);
    // Outside of what was measured some programs write NaN.
    volume.values.push_back(std::isfinite(value) ? value : 0.0F);
  }
  return volume;
}

/// Calls read(reader, content) with the header read and all of the file's content.
template <class Read>
auto read_nifti(std::string_view bytes, const std::string& name, std::size_t most_voxels, const Read& read) {
  if (!bytes.starts_with("\x1f\x8b")) {
    NiftiReader reader(bytes, name, most_voxels);
    reader.read_header();
    return read(reader, bytes);
  }
  GzipReader gzip(bytes);
  const auto read_to = [&](std::string& content, std::size_t size) {
    const std::size_t have = content.size();
    content.resize(size);
    const auto got = gzip.read(std::span(content).subspan(have));
    if (!got) throw UserError(name + ": its compressed data are damaged or cut short; copy the file again");
    content.resize(have + *got);
  };
  std::string content;
  read_to(content, kNifti2.size);
  NiftiReader reader(content, name, most_voxels);
  const std::size_t size = reader.read_header();
  if (!can_inflate_to(bytes.size(), size))
    throw UserError(name + ": dim: are of " + std::to_string(size) + " bytes, but the file has " +
                    std::to_string(bytes.size()) + " compressed ones; it is cut off, copy it again");
  std::string file = content;
  if (size > file.size()) read_to(file, size);
  return read(reader, std::string_view(file));
}

}  // namespace

LabelMap parse_label_nifti(std::string_view bytes, const std::string& name, std::size_t most_voxels) {
  return read_nifti(bytes, name, most_voxels,
                    [](NiftiReader& reader, std::string_view file) { return reader.read_labels(file); });
}

ImageVoxels parse_image_nifti(std::string_view bytes, const std::string& name, std::size_t most_voxels) {
  return read_nifti(bytes, name, most_voxels,
                    [](NiftiReader& reader, std::string_view file) { return reader.read_image(file); });
}

}  // namespace brachy
