#pragma once

#include <functional>
#include <string>

#include "apps/import/case/imported_case.h"
#include "apps/import/dicom/rt_structure.h"
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

  void add_rois(const RtStructureSet& set, const std::string& file);
  void add_segments(const LabelMap& map, const std::string& file);
  /// By `options.gland` or its name, and calls it "prostate". There is a structure.
  void put_gland_first();

 private:
  void add(ImportedStructure structure, const std::string& file);
  std::string unique(const std::string& name) const;

  const ImportOptions& options_;
  std::function<void(const std::string&)> progress_;
  ImportedCase& imported_;
};

/// A structure's name as a scene can have it: "Prostate (CTV)" → "Prostate_CTV", an organ's in lower case, with _ for
/// what is no letter, digit, _ or -.
std::string plain_name(const std::string& name, const std::string& otherwise);

std::string lower_case(std::string text);

}  // namespace brachy
