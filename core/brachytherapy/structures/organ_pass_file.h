#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/structures/organ_contact.h"

namespace brachy {

/// A needle's pass through an organ, or the beginning of one.
struct OrganPass {
  std::string organ;
  std::uint64_t tick = 0;  ///< when it began or, is_ended, ended
  double t_s = 0;          ///< simulated time then
  std::uint32_t needle = 0;
  std::uint32_t pass = 0;  ///< 1, 2, … of this needle and organ in this run
  bool is_ended = false;   ///< false: depth and time are not known yet
  double depth_mm = 0;     ///< OrganContact::depth_mm
  double time_s = 0;       ///< with the needle inside
  Vec3 entered_at = Vec3::Zero(),
       axis = Vec3::UnitZ();  ///< the tip and the needle's axis when it began, mm, W
};

/// The first line of a session's file of passes: a row when one begins and another when it has ended, so that what was
/// known survives a killed process. Rows begin with the organ's name.
inline constexpr std::string_view kOrganPassHeader =
    "organ,tick,t_s,needle,pass,ended,depth_mm,time_s,x,y,z,ax,ay,az";

/// One line without its end.
std::string organ_pass_row(const OrganPass& pass);
/// Parses such a text; `name` stands for the file in errors. A pass whose end is there is given once, ended. Throws
/// UserError "name:line: what; fix".
std::vector<OrganPass> parse_organ_passes(std::string_view text, const std::string& name);

/// The pass under way, or the last one, of a contact; `organ`, `needle` and `t_s` are given.
OrganPass pass_of(const OrganContact& contact, const std::string& organ, std::uint32_t needle, double t_s,
                  bool is_ended);

}  // namespace brachy
