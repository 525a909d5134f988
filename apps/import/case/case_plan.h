#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/import/dicom/rt_plan.h"
#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_seed.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// A permanent implant as a plan of this program, on a template, or a fraction of high-dose-rate brachytherapy.
struct CasePlan {
  Plan plan;
  std::optional<HdrPlan> hdr;  ///< in place of `plan`
  TemplateGrid grid;
  bool has_assumed_source = false;  ///< of `hdr`: the file does not name it
  double most_moved_mm = 0;  ///< how far a seed lies from where the file has it: trains come in whole steps
  std::vector<std::string> notes;  ///< one line each
};

/// The template in front of a gland that has this box: 13 × 13 holes, 5 mm apart, G7 on its middle, 37.5 mm from it.
TemplateGrid template_before(const Vec3& min_mm, const Vec3& max_mm);

/// Seeds that lie on no template, as after an implant; the text says what is in the way.
struct NoTemplatePlan : UserError {
  using UserError::UserError;
};

inline constexpr double kMostBesideMm = 1.5;

/// The needles of a permanent implant: each channel's sources, along +z through a hole of the template. A plan that
/// `brachy export --dicom` wrote names its template in its description and comes back exactly; for others the holes are
/// laid through the first needle, and trains are the nearest ones of seeds (4.5 mm) and spacers (5.5 mm).
/// Errors: UserError "name: …; fix" where the source is not one of those that are known; NoTemplatePlan where needles
/// do not run along the patient's axis, are not of one strength, or lie farther than kMostBesideMm beside the holes.
CasePlan fit_plan(const RtBrachyPlan& file, const TemplateGrid& proposed, const std::string& name);

/// The sources of a permanent implant where the file has them, each once, however their needles run: after the implant
/// they lie anywhere. A seed without an orientation lies along its channel, and a single one along the patient's axis.
/// Errors: UserError "name: …; fix" where a source is not one of those that are known.
std::vector<DoseSeed> seeds_of(const RtBrachyPlan& file, const std::string& name);

/// The fraction of an HDR plan that `brachy export --dicom` wrote: its description names template, step and offset.
/// Errors: UserError "name: …; fix" where it is another's, or dwells lie beside the template's holes.
CasePlan fit_hdr_plan(const RtBrachyPlan& file, const std::string& name);

/// What an exported HDR plan's description says behind its template.
std::string hdr_text(const HdrPlan& plan);

/// The template and base plane as text of an RT Plan Description, and back; nothing where it is another text.
std::string template_text(const TemplateGrid& grid, double base_plane_mm);
struct DescribedTemplate {
  TemplateGrid grid;
  double base_plane_mm;
};
std::optional<DescribedTemplate> parse_template_text(const std::string& text);

}  // namespace brachy
