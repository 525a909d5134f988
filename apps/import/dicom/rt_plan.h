#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/import/dicom/dicom_file.h"

namespace brachy {

struct RtSource {
  int number = 0;
  std::string model, maker, isotope;
  double air_kerma_strength_u = 0;  ///< µGy/h at 1 m, at the reference time
  double active_length_mm = 0;      ///< 0: the file does not say it, as below
  double half_life_days = 0;
  std::string strength_date;  ///< YYYYMMDD; empty: not said
};

/// Where a source is, or dwells.
struct RtControlPoint {
  Vec3 position;  ///< mm, RAS
  double relative_mm =
      0;  ///< behind the most distal position of the channel, or from another mark: of any sign
  double time_weight = 0;    ///< of the channel's total time
  std::optional<Vec3> axis;  ///< RAS
};

/// A needle or catheter of an application setup.
struct RtChannel {
  std::string setup_name, applicator;
  int number = 0;
  int source = 0;                      ///< its number
  double total_time_s = 0;             ///< 0 of a permanent implant
  std::optional<double> final_weight;  ///< the time weight that stands for the total time
  std::optional<int> roi;              ///< of the structure set: the structure that is its applicator
  std::vector<RtControlPoint> points;
};

/// A dose that a plan states at a point.
struct RtPointDose {
  Vec3 position;  ///< mm, RAS
  double gy = 0;
};

/// A brachytherapy plan as the file has it, LDR or HDR.
struct RtBrachyPlan {
  std::string frame, treatment_type, technique, description;
  std::string date;  ///< YYYYMMDD; empty: not said
  std::vector<RtSource> sources;
  std::vector<RtChannel> channels;
  std::optional<double> prescription_gy;  ///< of the dose reference, else of the fraction's setups
  std::vector<RtPointDose> point_doses;
  std::optional<double> total_air_kerma_ugy;  ///< at 1 m, of all setups, as the file states it
  std::string private_data;                   ///< DicomItem::private_data

  bool is_permanent() const { return technique == "PERMANENT"; }
};

/// A position of a channel at which the source dwells.
struct RtDwell {
  Vec3 position;  ///< mm, RAS
  double relative_mm = 0, seconds = 0;
};

/// The dwells of a channel, in the file's order: each is two control points of one position, between which the time
/// weight grows. Weights are seconds, shares or totals of pulses, and run on through the channel or begin from 0 at
/// each position: the total time is divided as the weights are. Errors: UserError "name: tag: what; fix" where the
/// control points are not in pairs, or the channel's total time is missing.
std::vector<RtDwell> dwells_of(const RtChannel& channel, const std::string& name);

/// Reads the brachytherapy part of an RTPLAN. Errors: UserError "FILE: tag: what; fix". Limits: 100,000 control points.
RtBrachyPlan read_rt_plan(const DicomFile& file);

}  // namespace brachy
