#include "apps/import/dicom/rt_structure.h"

#include <algorithm>
#include <map>

#include "apps/import/dicom/dicom_tags.h"
#include "core/base/error.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr std::size_t kMostPoints = 20'000'000, kMostNumber = 2'000'000'000;

/// `miscounted` is raised where the number of points is not the one that is stated: the data tells.
std::vector<Vec3> read_contour(const DicomItem& contour, std::size_t& miscounted) {
  const std::vector<double> values = contour.numbers(tag::kContourData);
  if (values.size() % 3 != 0)
    contour.refuse(tag::kContourData, "has " + std::to_string(values.size()) +
                                          " numbers, which are not three a point; export it again");
  if (!values.empty() && contour.has(tag::kContourPointCount) &&
      contour.number(tag::kContourPointCount) != static_cast<double>(values.size() / 3))
    ++miscounted;
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

void read_contours(const DicomItem& item, RtRoi& roi, std::size_t& points) {
  if (item.has(tag::kRoiColour)) {
    const std::vector<double> rgb = item.numbers(tag::kRoiColour, 3);
    roi.colour.emplace();
    for (std::size_t c = 0; c < 3; ++c) (*roi.colour)[c] = std::clamp(rgb[c] / 255, 0.0, 1.0);
  }
  std::size_t miscounted = 0, empty = 0, unread = 0;
  for (const DicomItem& contour : item.sequence(tag::kContours)) {
    const bool has_inside = is_closed(contour);
    std::vector<Vec3> read;
    try {
      read = read_contour(contour, miscounted);
    } catch (const UserError&) {
      if (has_inside) throw;
      ++unread;
    }
    points += read.size();
    if (points > kMostPoints)
      contour.refuse(tag::kContourData, "the file has over 20 million points; export fewer structures");
    if (!has_inside) {
      ++roi.other_contours;
      roi.course.insert(roi.course.end(), read.begin(), read.end());
      continue;
    }
    if (read.empty())
      ++empty;
    else
      roi.contours.push_back(std::move(read));
  }
  if (unread > 0)
    roi.notes.push_back(std::to_string(unread) + " open contours have no points that can be read");
  if (empty > 0) roi.notes.push_back(std::to_string(empty) + " contours have no points");
  if (miscounted > 0)
    roi.notes.push_back(tag::kContourPointCount.text() + " is not the number of points in " +
                        std::to_string(miscounted) + " contours: all points are taken");
}

/// The frame in which most contours lie; structures of other ones get a fault.
void choose_frame(RtStructureSet& set, const DicomItem& data) {
  std::map<std::string, std::size_t> contours;
  for (const RtRoi& roi : set.rois)
    if (!roi.frame.empty()) contours[roi.frame] += 1 + roi.contours.size();
  std::size_t most = 0;
  for (const auto& [frame, count] : contours)
    if (count > most) {
      most = count;
      set.frame = frame;
    }
  if (set.frame.empty()) set.frame = data.text(tag::kFrameOfReference);
  for (RtRoi& roi : set.rois)
    if (!roi.frame.empty() && roi.frame != set.frame && roi.fault.empty())
      roi.fault = data.name() + ": " + tag::kRoiFrame.text() +
                  ": is not that of the other structures, so nothing says how they lie; register them first";
}

}  // namespace

RtStructureSet read_rt_structure(const DicomFile& file) {
  const DicomItem data = file.data();
  RtStructureSet set;
  std::map<int, std::size_t> by_number;
  // What is wrong with one item is said without the file's name.
  const auto leave = [&](const char* what, const UserError& e) {
    set.left.push_back(what + std::string(e.what()).substr(data.name().size() + 2));
  };
  for (const DicomItem& item : data.sequence(tag::kStructureSetRois)) try {
      RtRoi roi;
      roi.number = static_cast<int>(item.count(tag::kRoiNumber, 0, kMostNumber));
      roi.name = item.text(tag::kRoiName);
      roi.frame = item.text(tag::kRoiFrame);
      if (!by_number.emplace(roi.number, set.rois.size()).second)
        item.refuse(tag::kRoiNumber, std::to_string(roi.number) + " occurs twice; export it again");
      set.rois.push_back(std::move(roi));
    } catch (const UserError& e) {
      leave("a structure: ", e);
    }
  if (set.rois.empty())
    data.refuse(tag::kStructureSetRois, "is missing or empty; export a structure set with structures");
  std::size_t points = 0;
  for (const DicomItem& item : data.sequence(tag::kRoiContours)) {
    RtRoi* roi = nullptr;
    try {
      const auto number = static_cast<int>(item.count(tag::kReferencedRoi, 0, kMostNumber));
      const auto found = by_number.find(number);
      if (found == by_number.end())
        item.refuse(tag::kReferencedRoi,
                    "is " + std::to_string(number) + ", which is no ROI Number of the file; export it again");
      roi = &set.rois[found->second];
      read_contours(item, *roi, points);
    } catch (const UserError& e) {
      if (points > kMostPoints) throw;
      if (roi)
        roi->fault = e.what();
      else
        leave("contours: ", e);
    }
  }
  choose_frame(set, data);
  return set;
}

}  // namespace brachy
