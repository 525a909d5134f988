#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "apps/session/session_folder.h"
#include "core/brachytherapy/contours/contour_score.h"

namespace brachy {

/// A volume study that was outlined in a session, with the truth it was scored against.
struct RecordedStudy {
  double t_s = 0;  ///< of the session, of the newest image outlined
  ContourStudy study;
  /// Of each of study.planes.
  struct Source {
    std::uint64_t tick = 0;  ///< of the image, and of the gland's shape
    double probe_depth_mm =
        std::numeric_limits<double>::quiet_NaN();  ///< as the client had it; NaN: not known
  };
  std::vector<Source> sources;
};

/// One line of volume_studies.jsonl (apps/README.md, "A volume study"), with its end.
std::string study_line(const RecordedStudy& study);

/// All of a file's studies. Errors: UserError "name:line: what; fix".
std::vector<RecordedStudy> parse_studies(std::string_view text, const std::string& name);

/// Appends a study to the file in `folder`, after what a killed process may have left of a line is cut off.
/// Threads: one at a time. Throws std::runtime_error with the file and the reason.
void append_study(const SessionFolder& folder, const RecordedStudy& study);

}  // namespace brachy
