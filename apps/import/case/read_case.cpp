#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "apps/import/case/imported_case.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom/identifiers.h"
#include "apps/import/dicom/rt_structure.h"
#include "apps/import/labels/import_limits.h"
#include "apps/import/labels/label_nifti.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/contours/contour_surface.h"
#include "core/geometry/label_map/label_surface.h"
#include "core/geometry/simplify/simplify.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/geometry/volume/file_bytes.h"
#include "core/geometry/volume/volume.h"

namespace brachy {
namespace {

constexpr double kDisplayedDb = 60;  // as of ultrasound.volume_db_per_value

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

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
      : options_(options), progress_(progress) {}
  ImportedCase read();

 private:
  void read_file(const std::string& file, const std::string& place);
  void read_dicom(const std::string& bytes, const std::string& file, const std::string& place);
  void add_rois(const RtStructureSet& set, const std::string& file);
  void add_segments(const LabelMap& map, const std::string& file);
  void add(ImportedStructure structure, const std::string& file);
  void check_frame(const std::string& frame, const std::string& file);
  void put_gland_first();
  void read_volume();
  std::string unique(const std::string& name) const;

  const ImportOptions& options_;
  const std::function<void(double, const std::string&)>& progress_;
  ImportedCase case_;
  double share_ = 0;
  std::string frame_, frame_file_;
  std::set<std::string> dropped_;
  std::map<std::string, std::vector<std::unique_ptr<DicomFile>>> series_;
  std::map<std::string, std::string> series_file_;
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

std::string CaseReader::unique(const std::string& name) const {
  const auto is_used = [&](const std::string& n) {
    return std::ranges::any_of(case_.structures, [&](const auto& s) { return s.name == n; });
  };
  if (!is_used(name)) return name;
  for (int n = 2;; ++n)
    if (const std::string next = name.substr(0, 28) + "_" + std::to_string(n); !is_used(next)) return next;
}

void CaseReader::add(ImportedStructure structure, const std::string& file) {
  SimplifyOptions simpler{options_.tolerance_mm, 200};
  SurfaceMesh mesh = simplify(structure.mesh, simpler);
  while (mesh.vertices.size() > options_.most_vertices && simpler.tolerance_mm < 1) {
    simpler.tolerance_mm *= 1.5;
    mesh = simplify(mesh, simpler);
  }
  if (simpler.tolerance_mm > options_.tolerance_mm)
    structure.notes.push_back("simplified to " + text_of(simpler.tolerance_mm) + " mm");
  PreparedSurface prepared = prepare_surface(mesh, {1e-4, 0.001}, file);
  require_closed(prepared.report, file + ": structure " + structure.name);
  if (prepared.report.dropped_islands > 0)
    structure.notes.push_back("left " + std::to_string(prepared.report.dropped_islands) + " islands, " +
                              text_of(prepared.report.dropped_island_volume_cc) + " cc");
  structure.mesh = std::move(prepared.mesh);
  structure.surface_cc = prepared.report.volume_cc;
  const double expected = structure.source_cc - prepared.report.dropped_island_volume_cc;
  if (std::abs(structure.surface_cc - expected) > 0.01 * structure.source_cc)
    structure.notes.push_back("volume " + text_of(structure.surface_cc) + " cc for " +
                              text_of(structure.source_cc) + " cc in the file");
  structure.name = unique(structure.name);
  case_.structures.push_back(std::move(structure));
}

void CaseReader::add_rois(const RtStructureSet& set, const std::string& file) {
  for (const RtRoi& roi : set.rois) {
    const std::string from = "ROI " + std::to_string(roi.number);
    ImportedStructure structure{
        plain_name(roi.name, "roi_" + std::to_string(roi.number)), from, roi.colour, {}, 0, 0, {}};
    progress_(share_, structure.name);
    if (roi.contours.empty()) {
      case_.left.push_back(from + ": has no closed contour");
      continue;
    }
    if (roi.other_contours > 0)
      case_.left.push_back(from + ": " + std::to_string(roi.other_contours) + " points or open contours");
    const std::string place = file + ": Contour Data (3006,0050): " + from;
    const ContourStack stack = stack_contours(roi.contours, place);
    if (stack.missing_planes > 0)
      structure.notes.push_back(std::to_string(stack.missing_planes) + " missing slices were interpolated");
    if (stack.repeated > 0)
      structure.notes.push_back(std::to_string(stack.repeated) + " contours occurred twice");
    ContourSurface surface = contour_surface(stack, place);
    structure.mesh = std::move(surface.mesh);
    structure.source_cc = surface.slabs_cc;
    add(std::move(structure), file);
  }
}

void CaseReader::add_segments(const LabelMap& map, const std::string& file) {
  for (const LabelMap::Segment& segment : map.segments) {
    const std::string from = "label " + std::to_string(segment.value) +
                             (map.layers.size() > 1 ? " of layer " + std::to_string(segment.layer) : "");
    const std::string fallback = "label_" + std::to_string(segment.value);
    const std::string name = plain_name(segment.name, fallback);
    progress_(share_, name);
    const auto& labels = map.layers[segment.layer];
    if (std::ranges::find(labels, segment.value) == labels.end()) {
      case_.left.push_back(from + ": no voxel has it");
      continue;
    }
    LabelSurface surface = label_surface(map.grid, labels, segment.value);
    add({name, from, segment.colour, std::move(surface.mesh), surface.voxels_cc, 0, {}}, file);
  }
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
    add_rois(set, file);
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
    const std::string series = dicom->data().text(tag::kSeriesInstance);
    series_file_.emplace(series, file);
    series_[series].push_back(std::move(dicom));
  } else {
    case_.left.push_back("a file of modality " + plain_name(modality, "none") + ", " + place);
  }
}

void CaseReader::read_file(const std::string& file, const std::string& place) {
  const std::string name = lower(std::filesystem::path(file).filename().string());
  const std::string bytes = file_bytes(file, kMostFileBytes);
  const std::string_view header =
      std::string_view(bytes).substr(0, std::min<std::size_t>(bytes.find("\n\n"), 65536));
  if (bytes.starts_with("NRRD") &&
      (header.find("\ntype: float") != header.npos || header.find("\ntype: double") != header.npos)) {
    case_.left.push_back("an NRRD image, which has no labels, " + place);
  } else if (bytes.starts_with("NRRD")) {
    add_segments(parse_label_nrrd(bytes, file), file);
    case_.taken.push_back("structures from an NRRD label map, " + place);
  } else if (name.ends_with(".nii") || name.ends_with(".nii.gz")) {
    add_segments(parse_label_nifti(bytes, file), file);
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

void CaseReader::put_gland_first() {
  auto& all = case_.structures;
  auto gland = all.end();
  if (!options_.gland.empty()) {
    gland = std::ranges::find(all, options_.gland, &ImportedStructure::name);
    if (gland == all.end()) {
      std::string names;
      for (const auto& s : all) names.append(names.empty() ? "" : ", ").append(s.name);
      throw UserError("--gland: there is no structure \"" + options_.gland + "\"; choose from " + names);
    }
  } else {
    for (const char* word : {"prostate", "gland", "ctv", "target", "ptv", "tumor", "tumour"})
      if (gland == all.end())
        gland = std::ranges::find_if(
            all, [&](const auto& s) { return lower(s.name).find(word) != std::string::npos; });
    if (gland == all.end()) {
      gland = all.begin();
      if (all.size() > 1)
        case_.left.push_back("no structure is called prostate, gland, ctv, target or ptv: \"" + gland->name +
                             "\", the first, is taken for the gland; --gland NAME chooses another");
    }
  }
  std::rotate(all.begin(), gland, gland + 1);
  // The scene's own word, for plans and the score.
  if (all.front().name != "prostate") {
    all.front().notes.push_back("is the gland, called \"prostate\" in the scene; in the file \"" +
                                all.front().name + "\"");
    for (std::size_t s = 1; s < all.size(); ++s)
      if (all[s].name == "prostate") all[s].name = unique("prostate_other");
    all.front().name = "prostate";
  }
}

void CaseReader::read_volume() {
  // The longest series is the volume.
  const auto longest = std::ranges::max_element(series_, {}, [](const auto& s) { return s.second.size(); });
  if (longest == series_.end()) return;
  std::vector<const DicomFile*> slices;
  for (const auto& file : longest->second) slices.push_back(file.get());
  const DicomItem first = slices.front()->data();
  case_.volume = read_image_series(slices);
  case_.volume_modality = slices.front()->modality();
  check_frame(case_.volume->frame, series_file_[longest->first]);
  case_.taken.push_back("volume from a series of " + std::to_string(slices.size()) + " images");
  if (series_.size() > 1)
    case_.left.push_back(std::to_string(series_.size() - 1) + " shorter series of images");
  const VoxelGrid& grid = case_.volume->grid;
  if (case_.volume_modality != "US") {
    case_.left.push_back(
        "the " + case_.volume_modality +
        " images are no echoes: the ultrasound image is made of the structures; to use them all "
        "the same, add under [ultrasound] in scene.toml: volume = \"volume.nrrd\"");
    return;
  }
  // The display of a scanner: its whole scale of grey for some 60 dB.
  const double bits = first.optional_number(tag::kBitsStored).value_or(8);
  const double slope = std::abs(first.optional_number(tag::kRescaleSlope).value_or(1));
  const double scale = slope * (std::exp2(std::clamp(bits, 1.0, 32.0)) - 1);
  const double db_per_value = kDisplayedDb / scale;
  const Volume image(grid, case_.volume->values);
  const bool meets_gland = std::ranges::any_of(case_.structures.front().mesh.vertices,
                                               [&](const Vec3& v) { return image.contains(v); });
  if (meets_gland && db_per_value >= 1e-6 && db_per_value <= 100)
    case_.echo_db_per_value = db_per_value;
  else
    case_.left.push_back(
        meets_gland ? "the US images are not used for the ultrasound image: Rescale Slope "
                      "(0028,1053) leaves no scale in dB"
                    : "the US images are not used for the ultrasound image: they do not meet the gland");
}

ImportedCase CaseReader::read() {
  const std::vector<std::string> files = files_of(options_.inputs);
  for (std::size_t n = 0; n < files.size(); ++n) {
    share_ = static_cast<double>(n) / static_cast<double>(files.size());
    progress_(share_, "file " + std::to_string(n + 1) + " of " + std::to_string(files.size()));
    read_file(files[n], "file " + std::to_string(n + 1) + " of " + std::to_string(files.size()));
  }
  if (case_.structures.empty())
    throw UserError(options_.inputs.front() +
                    ": no structure with a volume; add an RTSTRUCT or a label map to the files");
  put_gland_first();
  read_volume();
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

std::string plain_name(const std::string& name, const std::string& otherwise) {
  std::string plain;
  for (const char c : name) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    if (is_plain && static_cast<unsigned char>(c) < 128)
      plain += c;
    else if (!plain.empty() && plain.back() != '_')
      plain += '_';
  }
  while (plain.ends_with('_')) plain.pop_back();
  plain.resize(std::min<std::size_t>(plain.size(), 32));
  if (plain.empty()) return otherwise;
  for (const char* organ : {"prostate", "urethra", "rectum", "bladder"})
    if (lower(plain) == organ) return organ;
  return plain;
}

}  // namespace brachy
