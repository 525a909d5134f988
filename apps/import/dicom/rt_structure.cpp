#include "apps/import/dicom/rt_structure.h"

#include <algorithm>
#include <map>

#include "apps/import/dicom/dicom_tags.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr std::size_t kMostPoints = 20'000'000;

std::vector<Vec3> read_contour(const DicomItem& contour) {
  const std::vector<double> values = contour.numbers(tag::kContourData);
  if (values.empty()) contour.refuse(tag::kContourData, "is missing or empty; export it again");
  if (values.size() % 3 != 0)
    contour.refuse(tag::kContourData, "has " + std::to_string(values.size()) +
                                          " numbers, which are not three a point; export it again");
  if (contour.has(tag::kContourPointCount) &&
      contour.number(tag::kContourPointCount) != static_cast<double>(values.size() / 3))
    contour.refuse(tag::kContourPointCount, "is " + one_short_line(contour.text(tag::kContourPointCount)) +
                                                ", but there are " + std::to_string(values.size() / 3) +
                                                " points; export it again");
  std::vector<Vec3> points;
  points.reserve(values.size() / 3);
  for (std::size_t n = 0; n < values.size(); n += 3)
    points.push_back(ras_of_lps({values[n], values[n + 1], values[n + 2]}));
  return points;
}

/// Contours of a plane are combined by even and odd in both closed types: a CLOSED_PLANAR within another is its hole.
bool is_closed(const DicomItem& contour) {
  const std::string type = contour.text(tag::kContourType);
  if (type == "CLOSED_PLANAR" || type == "CLOSEDPLANAR_XOR") return true;
  if (type != "POINT" && type != "OPEN_PLANAR" && type != "OPEN_NONPLANAR")
    contour.refuse(tag::kContourType, "is \"" + one_short_line(type) + "\"; export it as CLOSED_PLANAR");
  return false;
}

}  // namespace

RtStructureSet read_rt_structure(const DicomFile& file) {
  const DicomItem data = file.data();
  RtStructureSet set;
  std::map<int, std::size_t> by_number;
  for (const DicomItem& item : data.sequence(tag::kStructureSetRois)) {
    RtRoi roi;
    roi.number = static_cast<int>(item.count(tag::kRoiNumber, 0, 1'000'000));
    roi.name = item.text(tag::kRoiName);
    const std::string frame = item.text(tag::kRoiFrame);
    if (!frame.empty() && !set.frame.empty() && frame != set.frame)
      item.refuse(tag::kRoiFrame,
                  "differs from that of the structures before; export one frame of reference");
    if (!frame.empty()) set.frame = frame;
    if (!by_number.emplace(roi.number, set.rois.size()).second)
      item.refuse(tag::kRoiNumber, std::to_string(roi.number) + " occurs twice; export it again");
    set.rois.push_back(std::move(roi));
  }
  if (set.rois.empty())
    data.refuse(tag::kStructureSetRois, "is missing or empty; export a structure set with structures");
  if (set.frame.empty()) set.frame = data.text(tag::kFrameOfReference);
  std::size_t points = 0;
  for (const DicomItem& item : data.sequence(tag::kRoiContours)) {
    const auto number = static_cast<int>(item.count(tag::kReferencedRoi, 0, 1'000'000));
    const auto found = by_number.find(number);
    if (found == by_number.end())
      item.refuse(tag::kReferencedRoi,
                  "is " + std::to_string(number) + ", which is no ROI Number of the file; export it again");
    RtRoi& roi = set.rois[found->second];
    if (item.has(tag::kRoiColour)) {
      const std::vector<double> rgb = item.numbers(tag::kRoiColour, 3);
      roi.colour.emplace();
      for (std::size_t c = 0; c < 3; ++c) (*roi.colour)[c] = std::clamp(rgb[c] / 255, 0.0, 1.0);
    }
    for (const DicomItem& contour : item.sequence(tag::kContours)) {
      if (!is_closed(contour)) {
        ++roi.other_contours;
        continue;
      }
      roi.contours.push_back(read_contour(contour));
      points += roi.contours.back().size();
      if (points > kMostPoints)
        contour.refuse(tag::kContourData, "the file has over 20 million points; export fewer structures");
    }
  }
  return set;
}

}  // namespace brachy
