#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "apps/import/case/imported_case.h"
#include "apps/import/dicom/rt_structure.h"
#include "core/geometry/contours/contour_stack.h"
#include "core/geometry/label_map/label_map.h"

namespace brachy {

/// Makes closed surfaces of what files hold and adds them to a case, with names that occur once. Errors: UserError with
/// file and tag.
class CaseStructures {
 public:
  /// `progress` is called with the name of each structure. `options` and `imported` must outlive it.
  CaseStructures(const ImportOptions& options, std::function<void(const std::string&)> progress,
                 ImportedCase& imported)
      : options_(options), progress_(std::move(progress)), imported_(imported) {}

  /// `file`: its path, for errors; `number`: from 1 on, in "file 3 of 12", which `place` says. `images`: beside which
  /// the contours were drawn. A structure that cannot be read gets a `fault`.
  void add_rois(const RtStructureSet& set, const std::string& file, std::size_t number,
                const std::string& place, const ImageSlices& images);
  /// A file with one segment and no name for it is called as its file, as far as that tells an organ and nothing else.
  void add_segments(const LabelMap& map, const std::string& file, std::size_t number,
                    const std::string& place);
  /// Leaves those that are there twice, of contours and labels the labels. Errors: UserError where a name of
  /// `options.leave` or `options.only` is no structure's.
  void leave_repeated();
  /// Leaves those with a fault. Errors: the fault of the first one, which is the gland.
  void leave_faulty();

 private:
  void add(ImportedStructure structure, const std::string& file);
  void read_contours(const RtRoi& roi, const std::string& file, const ImageSlices& images,
                     ImportedStructure& structure);
  /// Whether the structure is to be read, by `options.leave` and `options.only`; else it is said to be left.
  bool is_wanted(const std::string& file_name, const std::string& name, const std::string& place);
  std::string unique(const std::string& name) const;

  const ImportOptions& options_;
  std::function<void(const std::string&)> progress_;
  ImportedCase& imported_;
  std::set<std::string> seen_;  // names of structures, in the file and in the scene
};

/// A structure's name as a scene can have it: "Prostate (CTV)" → "Prostate_CTV", "Harnröhre" → "Harnroehre", an organ's
/// in lower case, with _ for what is no letter, digit, _ or -; of one without such letters what it means, or else
/// `otherwise`.
std::string plain_name(const std::string& name, const std::string& otherwise);

std::string lower_case(std::string text);

}  // namespace brachy
