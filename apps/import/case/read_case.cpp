#include <algorithm>
#include <memory>
#include <set>

#include "apps/import/case/case_structures.h"
#include "apps/import/case/case_volume.h"
#include "apps/import/case/imported_case.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom/identifiers.h"
#include "apps/import/dicom/rt_structure.h"
#include "apps/import/labels/import_limits.h"
#include "apps/import/labels/label_nifti.h"
#include "apps/import/voxels/rt_dose.h"
#include "core/base/error.h"
#include "core/geometry/volume/file_bytes.h"

namespace brachy {
namespace {

std::vector<std::string> files_of(const std::vector<std::string>& inputs) {
  std::vector<std::string> files;
  for (const std::string& input : inputs) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(input, ignored)) {
      files.push_back(input);
      continue;
    }
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(
             input, std::filesystem::directory_options::skip_permission_denied))
      if (entry.is_regular_file(ignored) && !entry.path().filename().string().starts_with('.'))
        found.push_back(entry.path().string());
    if (found.size() > 20'000)
      throw UserError(input + ": has over 20,000 files; give the folder of one patient");
    std::ranges::sort(found);
    files.insert(files.end(), found.begin(), found.end());
  }
  if (files.empty())
    throw UserError(inputs.front() + ": the folder has no file; give a DICOM folder or a label map");
  return files;
}

class CaseReader {
 public:
  CaseReader(const ImportOptions& options, const std::function<void(double, const std::string&)>& progress)
      : options_(options),
        progress_(progress),
        structures_(
            options, [this](const std::string& what) { progress_(share_, what); }, case_) {}
  ImportedCase read();

 private:
  void read_file(const std::string& file, const std::string& place);
  void read_dicom(const std::string& bytes, const std::string& file, const std::string& place);
  void check_frame(const std::string& frame, const std::string& file);
  std::string first_left() const;

  const ImportOptions& options_;
  const std::function<void(double, const std::string&)>& progress_;
  ImportedCase case_;
  CaseStructures structures_;
  double share_ = 0;
  std::string frame_, frame_file_;
  std::set<std::string> dropped_;
  SeriesByUid series_;
  std::optional<RtBrachyPlan> plan_;
  std::string plan_file_;
};

void CaseReader::check_frame(const std::string& frame, const std::string& file) {
  if (frame.empty()) {
    case_.left.push_back(
        "a file without Frame of Reference UID (0020,0052): taken to be in the others' frame");
    return;
  }
  if (!frame_.empty() && frame != frame_)
    throw UserError(
        file + ": " + tag::kFrameOfReference.text() + ": is not that of " + frame_file_ +
        ", so nothing says how the two lie; register them first, or import the files of one frame");
  frame_ = frame;
  frame_file_ = file;
}

/// " (what was left; …)", for a case without a structure.
std::string CaseReader::first_left() const {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t n = 0; n < std::min(kShown, case_.left.size()); ++n)
    text.append(n == 0 ? " (" : "; ").append(case_.left[n]);
  if (case_.left.size() > kShown) text += "; …";
  return text.empty() ? text : text + ")";
}

void CaseReader::read_dicom(const std::string& bytes, const std::string& file, const std::string& place) {
  auto dicom = std::make_unique<DicomFile>(bytes, file);
  for (const Identifier& identifier : identifiers_of(*dicom)) {
    if (options_.keep_identifiers)
      case_.identifiers.emplace_back(identifier.tag, identifier.value);
    else
      dropped_.insert(identifier.tag);
  }
  const std::string modality = dicom->modality();
  if (modality == "RTSTRUCT") {
    const RtStructureSet set = read_rt_structure(*dicom);
    check_frame(set.frame, file);
    structures_.add_rois(set, file);
    case_.taken.push_back("structures from an RTSTRUCT, " + place);
  } else if (modality == "RTPLAN") {
    if (plan_) throw UserError(file + ": is a second RTPLAN beside " + plan_file_ + "; import one of them");
    plan_ = read_rt_plan(*dicom);
    plan_file_ = file;
    check_frame(plan_->frame, file);
    case_.taken.push_back("plan from an RTPLAN, " + place);
  } else if (modality == "RTDOSE") {
    if (case_.dose) throw UserError(file + ": is a second RTDOSE; import one of them");
    case_.dose = read_rt_dose(*dicom);
    check_frame(case_.dose->frame, file);
    case_.taken.push_back("dose from an RTDOSE, " + place);
  } else if (modality == "CT" || modality == "MR" || modality == "US" || modality == "PT") {
    ImageSeries& series = series_[dicom->data().text(tag::kSeriesInstance)];
    if (series.images.empty()) series.first_file = file;
    series.images.push_back(std::move(dicom));
  } else {
    case_.left.push_back("a file of modality " + plain_name(modality, "none") + ", " + place);
  }
}

void CaseReader::read_file(const std::string& file, const std::string& place) {
  const std::string name = lower_case(std::filesystem::path(file).filename().string());
  const std::string bytes = file_bytes(file, kMostFileBytes);
  const std::string_view header =
      std::string_view(bytes).substr(0, std::min<std::size_t>(bytes.find("\n\n"), 65536));
  if (bytes.starts_with("NRRD") &&
      (header.find("\ntype: float") != header.npos || header.find("\ntype: double") != header.npos)) {
    case_.left.push_back("an NRRD image of type float or double, which has no labels, " + place);
  } else if (bytes.starts_with("NRRD")) {
    structures_.add_segments(parse_label_nrrd(bytes, file), file);
    case_.taken.push_back("structures from an NRRD label map, " + place);
  } else if (name.ends_with(".nii") || name.ends_with(".nii.gz")) {
    structures_.add_segments(parse_label_nifti(bytes, file), file);
    case_.taken.push_back("structures from a NIfTI label map, " + place);
  } else if (is_dicom(bytes) || name.ends_with(".dcm") || options_.inputs.size() == 1) {
    if (!is_dicom(bytes) && std::filesystem::is_directory(options_.inputs.front()) && !name.ends_with(".dcm"))
      case_.left.push_back("a file that is no DICOM, NRRD or NIfTI, " + place);
    else
      read_dicom(bytes, file, place);
  } else {
    case_.left.push_back("a file that is no DICOM, NRRD or NIfTI, " + place);
  }
}

ImportedCase CaseReader::read() {
  const std::vector<std::string> files = files_of(options_.inputs);
  for (std::size_t n = 0; n < files.size(); ++n) {
    share_ = static_cast<double>(n) / static_cast<double>(files.size());
    progress_(share_, "file " + std::to_string(n + 1) + " of " + std::to_string(files.size()));
    read_file(files[n], "file " + std::to_string(n + 1) + " of " + std::to_string(files.size()));
  }
  if (case_.structures.empty())
    throw UserError(options_.inputs.front() + ": no structure with a volume" + first_left() +
                    "; add an RTSTRUCT or a label map to the files");
  structures_.put_gland_first();
  if (const ImageSeries* images = longest_series(series_, frame_, case_.left)) {
    check_frame(images->frame(), images->first_file);
    add_volume(*images, case_);
  }
  Vec3 min = Vec3::Constant(1e9), max = -min;
  for (const Vec3& v : case_.structures.front().mesh.vertices) {
    min = min.cwiseMin(v);
    max = max.cwiseMax(v);
  }
  case_.grid = template_before(min, max);
  if (plan_ && plan_->is_permanent()) {
    case_.plan = fit_plan(*plan_, case_.grid, plan_file_);
    case_.grid = case_.plan->grid;
  } else if (plan_) {
    case_.left.push_back("the plan is " + plain_name(plan_->treatment_type, "of no type") + " with " +
                         std::to_string(plan_->channels.size()) + " channels, not a permanent implant");
  }
  case_.dropped.assign(dropped_.begin(), dropped_.end());
  return std::move(case_);
}

}  // namespace

ImportedCase read_case(const ImportOptions& options,
                       const std::function<void(double, const std::string&)>& progress) {
  return CaseReader(options, progress).read();
}

}  // namespace brachy
