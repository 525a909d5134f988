#pragma once

#include "apps/options.h"

namespace brachy {

// One function a command of `brachy`; each returns an ExitCode and throws UserError for bad input.

/// Steps the simulation through a trajectory without clock or network and prints a hash over every tick's state.
int replay_offline(const ReplayOptions& options);
/// Plays a trajectory into a daemon as its device.
int replay_live(const ReplayOptions& options);
/// Follows a daemon as a viewer.
int watch(const WatchOptions& options);
/// Writes what a daemon sends as files.
int record(const RecordOptions& options);
/// Serves viewers a session that a daemon publishes to a broker.
int relay(const RelayOptions& options);
/// Writes a recording as files to look at and to compute with.
int export_recording(const ExportOptions& options);
/// Deforms points or a mesh by landmarks.
int deform(const DeformOptions& options);
/// Adds up the dose of seeds at points, exactly, and on a grid with its structures' DVH.
int dose(const DoseOptions& options);
/// Describes a mesh, a scene's tissue, or a recording.
int inspect(const InspectOptions& options);
/// Runs every model on every reference scene: errors, times, memory; or scores rungs against measured beads.
int compare(const CompareOptions& options);
/// Sweeps every method to failure.
int stability(const StabilityOptions& options);
/// Finds the stiffest spring that a device renders stably, against rate and delay.
int zwidth(const ZWidthOptions& options);
/// Says what a scene needs: valid supports, expected error and cost of each rung, the choice.
int advise(const AdviseOptions& options);
/// Draws a force log: force against depth and against time.
int plot_force(const PlotForceOptions& options);
/// Makes a plan for a scene, or checks one.
int plan(const PlanOptions& options);
/// Measures a needle trajectory against a tissue surface: times, paths, passes, speeds.
int metrics(const MetricsOptions& options);
/// Judges a recording against its plan and writes the report.
int score(const ScoreOptions& options);
/// Makes a token, or shows one.
int token(const TokenOptions& options);

}  // namespace brachy
