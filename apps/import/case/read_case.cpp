#include <algorithm>
#include <functional>
#include <memory>
#include <set>

#include "apps/import/case/case_catheters.h"
#include "apps/import/case/case_roles.h"
#include "apps/import/case/case_structures.h"
#include "apps/import/case/case_volume.h"
#include "apps/import/case/imported_case.h"
#include "apps/import/dicom/dicom_precheck.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom/identifiers.h"
#include "apps/import/dicom/rt_structure.h"
#include "apps/import/labels/image_or_labels.h"
#include "apps/import/labels/import_limits.h"
#include "apps/import/labels/voxel_file.h"
#include "apps/import/voxels/rt_dose.h"
#include "apps/import/voxels/segmentation.h"
#include "core/base/error.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/geometry/volume/file_bytes.h"
#include "core/geometry/volume/nrrd_data.h"

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

/// A file of DICOM RT that waits until all are there.
struct RtFile {
  std::string path;
  std::size_t number;  ///< from 1 on
  std::unique_ptr<DicomFile> dicom;
};

class CaseReader {
 public:
  CaseReader(const ImportOptions& options, const std::function<void(double, const std::string&)>& progress)
      : options_(options),
        progress_(progress),
        structures_(
            options, [this](const std::string& what) { progress_(share_, what); }, case_) {}
  ImportedCase read();

 private:
  void read_file(const std::string& file, std::size_t number);
  void read_dicom(const std::string& bytes, const std::string& file, std::size_t number);
  void read_voxels(const VoxelFile& file, const std::string& bytes, std::size_t number);
  void read_structure_sets();
  void read_segmentations();
  void take_image();
  bool is_only_file() const;
  void take_implant(const RtBrachyPlan& plan, const RtFile& file);
  void read_plan();
  void read_dose();
  bool is_in_frame(const std::string& frame, const RtFile& file, const char* what);
  std::string place(std::size_t number) const {
    return "file " + std::to_string(number) + " of " + std::to_string(case_.files.size());
  }
  std::string without_paths(std::string text) const;
  void leave(const RtFile& file, const std::string& why) {
    const std::string named = file.path + ": ";  // as errors begin
    case_.left.push_back(place(file.number) + ": " +
                         (why.starts_with(named) ? why.substr(named.size()) : why));
  }
  std::string first_left() const;

  const ImportOptions& options_;
  const std::function<void(double, const std::string&)>& progress_;
  ImportedCase case_;
  CaseStructures structures_;
  double share_ = 0;
  std::optional<std::string> frame_;  // of the structures
  std::set<std::string> dropped_;
  SeriesByUid series_;
  std::vector<RtFile> structure_sets_, segmentations_, plans_, doses_;
  std::string plan_instance_;  // SOP instance UID of the plan that was taken
  struct KeptImage {
    VoxelFile file;
    std::string reason;  ///< why it is no label map
  };
  std::vector<KeptImage> images_;
  std::string first_fault_;  ///< why the first file of voxels, or that is called .dcm, gave no structure
};

/// A text with "file 3 of 12" for each path, which could name a person.
std::string CaseReader::without_paths(std::string text) const {
  for (std::size_t n = 0; n < case_.files.size(); ++n)
    for (auto at = text.find(case_.files[n] + ": "); at != std::string::npos;
         at = text.find(case_.files[n] + ": "))
      text.replace(at, case_.files[n].size(), place(n + 1));
  return text;
}

/// Whether what is in `frame` lies as the structures do; else it is left.
bool CaseReader::is_in_frame(const std::string& frame, const RtFile& file, const char* what) {
  if (frame.empty()) {
    leave(file, "has no Frame of Reference UID (0020,0052): taken to be in the others' frame");
    return true;
  }
  if (!frame_ || frame_->empty()) frame_ = frame;
  if (*frame_ == frame) return true;
  leave(file, std::string(what) + ": " + tag::kFrameOfReference.text() +
                  ": is not that of the structures, so nothing says how the two lie; register them first");
  return false;
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

void CaseReader::read_dicom(const std::string& bytes, const std::string& file, std::size_t number) {
  auto dicom = std::make_unique<DicomFile>(bytes, file);
  for (const Identifier& identifier : identifiers_of(*dicom)) {
    if (options_.keep_identifiers)
      case_.identifiers.emplace_back(identifier.tag, identifier.value);
    else
      dropped_.insert(identifier.tag);
  }
  const std::string modality = dicom->modality();
  if (modality == "RTSTRUCT") {
    structure_sets_.push_back({file, number, std::move(dicom)});
  } else if (modality == "RTPLAN") {
    plans_.push_back({file, number, std::move(dicom)});
  } else if (modality == "RTDOSE") {
    doses_.push_back({file, number, std::move(dicom)});
  } else if (modality == "SEG") {
    segmentations_.push_back({file, number, std::move(dicom)});
  } else if (modality == "CT" || modality == "MR" || modality == "US" || modality == "PT") {
    ImageSeries& series = series_[dicom->data().text(tag::kSeriesInstance)];
    if (series.images.empty()) series.first_file = file;
    series.images.push_back(std::move(dicom));
  } else {
    case_.left.push_back(place(number) + ": is of modality " + plain_name(modality, "none"));
  }
}

void CaseReader::read_segmentations() {
  for (RtFile& file : segmentations_) try {
      if (!is_in_frame(file.dicom->data().text(tag::kFrameOfReference), file, "segmentation")) continue;
      structures_.add_segments(read_segmentation(*file.dicom), file.path, file.number, place(file.number));
      case_.taken.push_back("structures from a DICOM segmentation, " + place(file.number));
    } catch (const UserError& e) {
      if (first_fault_.empty()) first_fault_ = e.what();
      leave(file, e.what());
    }
}

/// Beside the images in the frame of the structures, which are read before them.
void CaseReader::read_structure_sets() {
  std::vector<std::pair<RtFile*, RtStructureSet>> sets;
  std::string fault;
  for (RtFile& file : structure_sets_) try {
      RtStructureSet set = read_rt_structure(*file.dicom);
      if (is_in_frame(set.frame, file, "structures")) sets.emplace_back(&file, std::move(set));
    } catch (const UserError& e) {
      if (fault.empty()) fault = e.what();
      leave(file, e.what());
    }
  if (sets.empty() && case_.structures.empty() && segmentations_.empty() && !fault.empty())
    throw UserError(fault);
  read_segmentations();
  const ImageSeries* images = add_volume(series_, frame_.value_or(""), case_);
  ImageSlices slices;
  if (images) {
    const VoxelGrid& grid = case_.volume->grid;
    slices.normal = grid.steps.col(0).cross(grid.steps.col(1)).normalized();
    slices.spacing_mm = std::abs(slices.normal.dot(grid.steps.col(2)));
  }
  for (const auto& [file, set] : sets) {
    structures_.add_rois(set, file->path, file->number, place(file->number), slices);
    case_.taken.push_back("structures from an RTSTRUCT, " + place(file->number));
  }
  structures_.leave_repeated();
  if (case_.structures.empty()) {
    if (!options_.needs_structure) return;
    if (!first_fault_.empty()) throw UserError(first_fault_);
    throw UserError(options_.inputs.front() + ": no structure with a volume" + first_left() +
                    "; add an RTSTRUCT or a label map to the files");
  }
  assign_roles(options_, case_);
  structures_.leave_faulty();
  if (images) add_echoes(*images, case_);
}

/// A permanent implant's seeds where the file has them, and its needles, if it has any.
void CaseReader::take_implant(const RtBrachyPlan& plan, const RtFile& file) {
  case_.seeds = seeds_of(plan, file.path);
  try {
    case_.plan = fit_plan(plan, case_.grid, file.path);
  } catch (const NoTemplatePlan& e) {
    case_.taken.push_back(std::to_string(case_.seeds.size()) + " seeds from an RTPLAN, " +
                          place(file.number));
    leave(file, std::string(e.what()) + "; its seeds are in seeds.csv");
  }
}

/// The first permanent implant, or else a fraction of our own export; others are left.
void CaseReader::read_plan() {
  if (!case_.structures.empty()) {
    Eigen::AlignedBox3d box;
    for (const Vec3& v : case_.structures.front().mesh.vertices) box.extend(v);
    case_.grid = template_before(box.min(), box.max());
  }
  // Permanent implants first: a session with both is of that.
  std::ranges::stable_sort(plans_, std::greater(), [](const RtFile& file) {
    return file.dicom->data().text(tag::kTechnique) == "PERMANENT";
  });
  std::string fault;
  for (const RtFile& file : plans_) try {
      const DicomItem data = file.dicom->data();
      const bool is_permanent = data.text(tag::kTechnique) == "PERMANENT";
      const bool is_taken = case_.plan || !case_.seeds.empty();
      if (is_taken && is_permanent) {
        leave(file, "is another plan; to take this one, name it without the other");
        continue;
      }
      const RtBrachyPlan plan = read_rt_plan(*file.dicom);
      const bool is_own = parse_template_text(plan.description).has_value();
      if (is_taken)
        leave(file, "is another plan; to take this one, name it without the other");
      else if (is_in_frame(plan.frame, file, "plan")) {
        std::vector<ImportedCourse> courses = case_.courses;
        if (plan.is_permanent())
          take_implant(plan, file);
        else
          case_.plan = is_own ? fit_hdr_plan(plan, file.path)
                              : catheters_of(plan, courses, options_.source, file.path);
        case_.courses = std::move(courses);
        plan_instance_ = data.text(tag::kSopInstance);
        case_.plan_points = plan.point_doses;
        case_.plan_date = plan.date;
        case_.strength_date = plan.sources.front().strength_date;
        if (!case_.plan) continue;
        if (is_own || plan.is_permanent()) case_.grid = case_.plan->grid;
        case_.taken.push_back("plan from an RTPLAN, " + place(file.number));
      }
    } catch (const UserError& e) {
      if (case_.plan_fault.empty()) case_.plan_fault = e.what();
      if (fault.empty() && file.dicom->data().text(tag::kTechnique) == "PERMANENT") fault = e.what();
      leave(file, e.what());
    }
  if (!case_.plan && case_.seeds.empty() && !fault.empty()) throw UserError(fault);
  for (const ImportedCourse& course : case_.courses) case_.left.push_back(course.left);
}

/// Of the plan that was taken, else of any plan, else the first.
void CaseReader::read_dose() {
  const auto rank = [&](const RtFile& file) {
    const DicomItem data = file.dicom->data();
    const auto plans = data.sequence(tag::kReferencedPlan);
    const bool is_of_plan = !plan_instance_.empty() && std::ranges::any_of(plans, [&](const DicomItem& item) {
      return item.text(tag::kReferencedInstance) == plan_instance_;
    });
    return (is_of_plan ? 2 : 0) + (data.text(tag::kDoseSummation) == "PLAN" ? 1 : 0);
  };
  std::vector<const RtFile*> near;
  for (const RtFile& file : doses_)
    if (is_in_frame(file.dicom->data().text(tag::kFrameOfReference), file, "dose")) near.push_back(&file);
  std::ranges::stable_sort(near, std::greater<>(), [&](const RtFile* file) { return rank(*file); });
  for (std::size_t n = 0; n < near.size(); ++n) {
    if (n > 0) {
      leave(*near[n], "is another dose; to take this one, name it without the other");
      continue;
    }
    case_.dose = read_rt_dose(*near[n]->dicom);
    case_.taken.push_back("dose from an RTDOSE, " + place(near[n]->number));
  }
}

/// Label maps become structures; images are kept for the end, when the gland is known.
void CaseReader::read_voxels(const VoxelFile& file, const std::string& bytes, std::size_t number) {
  std::string reason;
  try {
    const LabelMap map = file.read_labels(bytes);
    reason = image_reason(map, file.path);
    if (reason.empty()) {
      structures_.add_segments(map, file.path, number, file.place);
      case_.taken.push_back("structures from " + std::string(file.label_map()) + ", " + file.place);
      return;
    }
    if (first_fault_.empty())
      first_fault_ = file.path + ": is an image (" + reason + "), not a label map; add a segmentation";
  } catch (const NoLabels& e) {
    reason = "values that are no labels";
    if (first_fault_.empty()) first_fault_ = e.what();
  } catch (const UserError& e) {
    if (is_only_file()) throw;
    if (first_fault_.empty()) first_fault_ = e.what();
    const std::string what = std::string(e.what()).starts_with(file.path + ": ")
                                 ? std::string(e.what()).substr(file.path.size() + 2)
                                 : std::string(e.what());
    case_.left.push_back(file.place + ": " + what);
    return;
  }
  images_.push_back({file, reason});
}

bool CaseReader::is_only_file() const {
  std::error_code ignored;
  return options_.inputs.size() == 1 && !std::filesystem::is_directory(options_.inputs.front(), ignored);
}

bool holds(const VoxelGrid& grid, const Vec3& X) {
  const Vec3 at = grid.steps.inverse() * (X - grid.origin);
  const Vec3 size(static_cast<double>(grid.size[0]), static_cast<double>(grid.size[1]),
                  static_cast<double>(grid.size[2]));
  return (at.array() >= -0.5).all() && ((size - at).array() >= 0.5).all();
}

/// The first image in which the middle of the gland lies, or else the last, is the case's; unless a series of DICOM is.
void CaseReader::take_image() {
  const Vec3 middle = structure_places(as_structures(case_)).front().centroid;
  const std::size_t taken = images_.size();
  std::optional<std::size_t> best;
  for (std::size_t n = 0; n < images_.size() && !case_.volume; ++n) try {
      const VoxelFile& file = images_[n].file;
      ImageVoxels image = file.read_image(file_bytes(file.path, kMostFileBytes));
      if (!holds(image.grid, middle) && n + 1 < images_.size()) continue;
      case_.volume = VoxelVolume{image.grid, {}, std::move(image.values)};
      best = n;
    } catch (const UserError& e) {
      case_.left.push_back("an image, " + images_[n].file.place + ": " +
                           std::string(e.what()).substr(
                               std::min(std::string(e.what()).size(), images_[n].file.path.size() + 2)));
    }
  for (std::size_t n = 0; n < taken; ++n)
    if (n == best)
      case_.taken.push_back("volume from an image (" + images_[n].reason + "), " + images_[n].file.place);
    else
      case_.left.push_back("an image (" + images_[n].reason + "), " + images_[n].file.place);
}

void CaseReader::read_file(const std::string& file, std::size_t number) {
  const std::string name = lower_case(std::filesystem::path(file).filename().string());
  const std::string bytes = file_bytes(file, kMostFileBytes);
  if (const auto format = voxel_format(bytes, name))
    read_voxels({*format, file, place(number)}, bytes, number);
  else if (begins_as_dicom(bytes) || is_only_file())
    read_dicom(bytes, file, number);
  else if (name.ends_with(".dcm")) {
    const std::string what = ": is no DICOM file: it has no DICM at byte 128; export it as DICOM part 10";
    if (first_fault_.empty()) first_fault_ = file + what;
    case_.left.push_back(place(number) + what);
  } else
    case_.left.push_back(place(number) + ": is no DICOM, NRRD, NIfTI or MetaImage");
}

ImportedCase CaseReader::read() {
  case_.files = files_of(options_.inputs);
  for (std::size_t n = 0; n < case_.files.size(); ++n) {
    share_ = static_cast<double>(n) / static_cast<double>(case_.files.size());
    progress_(share_, place(n + 1));
    read_file(case_.files[n], n + 1);
  }
  read_structure_sets();
  if (!case_.structures.empty()) {
    take_image();
    const std::vector<std::string> warnings =
        anatomy_warnings(as_structures(case_), case_.volume ? &case_.volume->grid : nullptr);
    case_.warnings.insert(case_.warnings.end(), warnings.begin(), warnings.end());
  }
  read_plan();
  if (std::string warning = implant_warning(as_structures(case_), middles_of(case_.seeds)); !warning.empty())
    case_.warnings.push_back(std::move(warning));
  read_dose();
  for (std::string& line : case_.left) line = without_paths(std::move(line));
  case_.dropped.assign(dropped_.begin(), dropped_.end());
  return std::move(case_);
}

}  // namespace

ImportedCase read_case(const ImportOptions& options,
                       const std::function<void(double, const std::string&)>& progress) {
  return CaseReader(options, progress).read();
}

}  // namespace brachy
