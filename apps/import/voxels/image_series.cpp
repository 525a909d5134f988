#include "apps/import/voxels/image_series.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/import/dicom/dicom_file.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/labels/import_limits.h"
#include "apps/import/voxels/dicom_plane.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr double kSlackMm = 1e-3;      // positions are decimal strings
constexpr std::size_t kMostSteps = 4;  // from one slice to the next: up to three are missing

struct Slice {
  double height;  ///< along the first image's normal, mm
  DicomPlane plane;
  const DicomFile* file;
};

/// Whether the second image can be another slice of the first one's stack.
bool is_of_stack(const Slice& first, const Slice& other) {
  const DicomPlane &p = first.plane, &q = other.plane;
  const DicomItem a = first.file->data(), b = other.file->data();
  return (q.along_row - p.along_row).norm() <= 1e-3 && (q.along_column - p.along_column).norm() <= 1e-3 &&
         std::abs(q.row_spacing / p.row_spacing - 1) <= 1e-3 &&
         std::abs(q.column_spacing / p.column_spacing - 1) <= 1e-3 &&
         a.text(tag::kRows) == b.text(tag::kRows) && a.text(tag::kColumns) == b.text(tag::kColumns) &&
         a.text(tag::kFrameOfReference) == b.text(tag::kFrameOfReference);
}

/// Why the image is no slice; empty where it is one.
std::string slice_fault(const DicomItem& data) {
  if (data.lists(tag::kImageType, "LOCALIZER")) return tag::kImageType.text() + ": is a localizer";
  const std::string kind = data.text(tag::kPhotometric);
  if (!kind.empty() && !kind.starts_with("MONOCHROME"))
    return tag::kPhotometric.text() + ": is " + one_short_line(kind) + "; export grey images, MONOCHROME2";
  if (data.has(tag::kFrames) && data.number(tag::kFrames) != 1)
    return tag::kFrames.text() + ": is " + one_short_line(data.text(tag::kFrames)) +
           "; export a series of images of one frame each";
  return {};
}

/// The images by stacks that could each be one volume, in the order of their first images. Those that are none are
/// `left`.
std::vector<std::vector<Slice>> stacks_of(const std::vector<const DicomFile*>& files,
                                          std::vector<std::string>& left) {
  std::vector<std::vector<Slice>> stacks;
  struct Faulty {
    std::string first;  ///< file
    std::size_t count = 0;
  };
  std::map<std::string, Faulty> faults;
  const auto leave = [&](const DicomFile& file, const std::string& fault) {
    Faulty& faulty = faults[fault];
    if (faulty.count++ == 0) faulty.first = file.data().name();
  };
  for (const DicomFile* file : files) try {
      const DicomItem data = file->data();
      if (const std::string fault = slice_fault(data); !fault.empty()) {
        leave(*file, fault);
        continue;
      }
      const Slice slice{0, dicom_plane(data), file};
      const auto of =
          std::ranges::find_if(stacks, [&](const auto& s) { return is_of_stack(s.front(), slice); });
      if (of == stacks.end())
        stacks.push_back({slice});
      else
        of->push_back(slice);
    } catch (const UserError& e) {
      leave(*file, std::string(e.what()).substr(file->data().name().size() + 2));
    }
  for (const auto& [fault, of] : faults)
    left.push_back(of.first + ": " + fault +
                   (of.count > 1 ? " (and so are " + std::to_string(of.count - 1) + " more images)" : ""));
  return stacks;
}

/// By their height, each place once: a file may lie twice in a folder.
void sort_by_height(std::vector<Slice>& slices) {
  const Vec3 normal = slices.front().plane.normal;
  for (Slice& slice : slices) slice.height = normal.dot(slice.plane.corner);
  std::ranges::stable_sort(slices, {}, &Slice::height);
  std::size_t kept = 0;
  for (std::size_t s = 1; s < slices.size(); ++s) {
    const DicomItem data = slices[s].file->data();
    if (slices[s].height - slices[kept].height > kSlackMm)
      slices[++kept] = slices[s];
    else if (const std::string uid = data.text(tag::kSopInstance);
             uid.empty() || uid != slices[kept].file->data().text(tag::kSopInstance))
      data.refuse(tag::kImagePosition,
                  "is in one place with another image of the series; import one image for each slice");
  }
  slices.resize(kept + 1, slices.front());
}

/// Where the slices lie: each by its number, of which some are missing.
struct SliceLine {
  Vec3 step;
  std::vector<std::size_t> numbers;
};

/// All slices lie on a line, at equal distances or, where some are missing, whole multiples of it.
SliceLine line_of(const std::vector<Slice>& slices) {
  const Slice& first = slices.front();
  if (slices.size() == 1) return {slice_thickness(first.file->data()) * first.plane.normal, {0}};
  std::vector<double> gaps;
  for (std::size_t s = 1; s < slices.size(); ++s) gaps.push_back(slices[s].height - slices[s - 1].height);
  std::vector<double> sorted = gaps;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2));
  const double usual = sorted[gaps.size() / 2], slack = 0.1 * usual + kSlackMm;
  SliceLine line{Vec3::Zero(), {0}};
  for (std::size_t s = 1; s < slices.size(); ++s) {
    const auto steps = static_cast<std::size_t>(std::lround(gaps[s - 1] / usual));
    if (steps < 1 || steps > kMostSteps || std::abs(gaps[s - 1] - static_cast<double>(steps) * usual) > slack)
      slices[s].file->data().refuse(tag::kImagePosition,
                                    "lies " + text_of(gaps[s - 1]) +
                                        " mm from the slice before it, and others are " + text_of(usual) +
                                        " mm apart; export the series again, evenly spaced");
    line.numbers.push_back(line.numbers.back() + steps);
  }
  line.step = (slices.back().plane.corner - first.plane.corner) / static_cast<double>(line.numbers.back());
  for (std::size_t s = 1; s < slices.size(); ++s) {
    const double off =
        (slices[s].plane.corner - first.plane.corner - static_cast<double>(line.numbers[s]) * line.step)
            .norm();
    if (off > slack)
      slices[s].file->data().refuse(
          tag::kImagePosition,
          "lies " + text_of(off) + " mm beside the line of the other slices; import one stack of slices");
  }
  return line;
}

/// Slices up to the one at number `to`, linear from the last one that is there.
void fill_up(VoxelVolume& volume, std::size_t from, std::size_t to, const std::vector<float>& next) {
  const std::size_t begin = volume.values.size() - next.size();
  for (std::size_t k = from + 1; k < to; ++k) {
    const auto share = static_cast<float>(k - from) / static_cast<float>(to - from);
    for (std::size_t n = 0; n < next.size(); ++n)
      volume.values.push_back((1 - share) * volume.values[begin + n] + share * next[n]);
  }
}

}  // namespace

VoxelVolume read_image_series(const std::vector<const DicomFile*>& files, std::vector<std::string>& left) {
  std::vector<std::vector<Slice>> stacks = stacks_of(files, left);
  if (stacks.empty()) {
    const std::string fault = left.back();
    left.pop_back();
    throw UserError(fault);
  }
  const auto largest = std::ranges::max_element(stacks, {}, [](const auto& s) { return s.size(); });
  if (largest->size() < files.size() && stacks.size() > 1)
    left.push_back(std::to_string(files.size() - largest->size()) +
                   " images of another orientation, size, spacing or frame of reference than the other " +
                   std::to_string(largest->size()) + " of their series");
  std::vector<Slice>& slices = *largest;
  sort_by_height(slices);
  const SliceLine line = line_of(slices);
  if (const std::size_t missing = line.numbers.back() + 1 - slices.size(); missing > 0)
    left.push_back(std::to_string(missing) + " slices are missing in the series: they were interpolated");
  VoxelVolume volume;
  for (std::size_t s = 0; s < slices.size(); ++s) {
    const DicomItem data = slices[s].file->data();
    const double slope = data.optional_number(tag::kRescaleSlope).value_or(1);
    const double intercept = data.optional_number(tag::kRescaleIntercept).value_or(0);
    check_scale(data, tag::kRescaleSlope, slope, intercept);
    const DicomFile::Pixels pixels = slices[s].file->pixels();
    if (s == 0) {
      volume.grid = grid_of(data, slices[s].plane, pixels, line.step,
                            slices.size() > 1 ? tag::kImagePosition : tag::kSliceThickness);
      volume.grid.size[2] = line.numbers.back() + 1;
      if (volume.grid.count() > kMostVoxels)
        data.refuse(tag::kRows, "the series has over 2^29 voxels; crop it");
      volume.frame = data.text(tag::kFrameOfReference);
      volume.values.reserve(volume.grid.count());
    }
    if (pixels.columns != volume.grid.size[0] || pixels.rows != volume.grid.size[1])
      data.refuse(tag::kRows, "differs from the series' other images; import one stack of slices");
    std::vector<float> values;
    values.reserve(pixels.values.size());
    for (const std::int64_t value : pixels.values)
      values.push_back(static_cast<float>(slope * static_cast<double>(value) + intercept));
    if (s > 0) fill_up(volume, line.numbers[s - 1], line.numbers[s], values);
    volume.values.insert(volume.values.end(), values.begin(), values.end());
  }
  return volume;
}

}  // namespace brachy
