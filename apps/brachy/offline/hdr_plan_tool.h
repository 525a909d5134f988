#pragma once

#include <filesystem>
#include <optional>

#include "core/scene/scene.h"

namespace brachy {

/// What `brachy plan` is asked for; as its options.
struct HdrPlanRequest {
  std::optional<std::filesystem::path> plan;
  bool generate = false, robust = false;
  std::optional<std::filesystem::path> out, seeds, structures, trajectory;
  double speed_mm_s = 50;
  bool json = false, force = false;
};

/// Makes the scene one of HDR, with its source and the prescription of a fraction where it had LDR's default.
void make_hdr(Scene& scene);

/// Whether a file that can be read is a plan of HDR.
bool is_hdr_plan_file(const std::filesystem::path& file);

/// `brachy plan` for catheters: generates or loads, writes, and reports. Returns the exit code. Errors: UserError.
int run_hdr_plan(const HdrPlanRequest& request, const Scene& scene);

}  // namespace brachy
