#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/import/dicom/dicom_file.h"

namespace brachy {

struct RtSource {
  int number = 0;
  std::string model, isotope;
  double air_kerma_strength_u = 0;  ///< µGy/h at 1 m, at the reference time
};

/// Where a source is, or dwells.
struct RtControlPoint {
  Vec3 position;             ///< mm, RAS
  double relative_mm = 0;    ///< behind the most distal position of the channel
  double time_weight = 0;    ///< cumulative, of the channel's total time
  std::optional<Vec3> axis;  ///< RAS
};

/// A needle or catheter of an application setup.
struct RtChannel {
  std::string setup_name, applicator;
  int number = 0;
  int source = 0;           ///< its number
  double total_time_s = 0;  ///< 0 of a permanent implant
  std::vector<RtControlPoint> points;
};

/// A brachytherapy plan as the file has it, LDR or HDR.
struct RtBrachyPlan {
  std::string frame, treatment_type, technique, description;
  std::vector<RtSource> sources;
  std::vector<RtChannel> channels;
  std::optional<double> prescription_gy;

  bool is_permanent() const { return technique == "PERMANENT"; }
};

/// Reads the brachytherapy part of an RTPLAN. Errors: UserError "FILE: tag: what; fix". Limits: 100,000 control points.
RtBrachyPlan read_rt_plan(const DicomFile& file);

}  // namespace brachy
