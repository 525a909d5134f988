#pragma once

#include "apps/charts/svg_chart.h"
#include "apps/score/score.h"

namespace brachy {

/// Cumulative dose-volume histograms of all structures: dashed as planned, dotted as dropped, solid at rest, which the
/// legend calls `at_rest`.
Chart dvh_chart(const DoseScore& dose, const char* at_rest = "after relaxation");

/// Each planned seed seen along `away` (0: x, 1: y), arrows from where it was planned to where it fell to where it
/// lies at rest; grey: the convex hull of the prostate. z upwards.
Chart displacement_chart(const SeedsScore& seeds, const Plan& plan, const TemplateGrid& grid,
                         const SurfaceMesh& prostate, int away);

/// Each seed's error across its needle against that along it, as it fell and at rest.
Chart error_chart(const SeedsScore& seeds);

}  // namespace brachy
