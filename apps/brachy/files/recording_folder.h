#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "apps/brachy/files/paraview_writer.h"
#include "apps/recording/read_recording.h"
#include "apps/session/session_log.h"
#include "net/client/server_messages.h"

namespace brachy {

/// Writes a server's messages as files for viewing and analysis: recording.pvd and its .vtp series, poses.csv,
/// forces.csv (a row per snapshot), seeds.csv, events.csv, and structures/ once a SCENE was received. `brachy record
/// --out DIR` and `brachy export` use it; the same messages give the same bytes. After a reset of the simulation the
/// rest goes into a sub-directory: run_2, run_3, ….
/// Threads: one.
class RecordingFolder {
 public:
  struct Counts {
    std::uint64_t runs = 0, snapshots = 0, poses = 0, forces = 0, seeds = 0, events = 0;
    std::uint64_t ticks_missed = 0;  ///< ticks whose poses were not received
  };

  /// Creates the directory. `surface_only`: leave the interior points out. Throws UserError where it cannot be created
  /// or holds a recording.
  RecordingFolder(std::filesystem::path folder, bool surface_only);

  /// Receives the messages and writes them. Its take() throws std::runtime_error where a file cannot be written;
  /// what has been written stays.
  net::ServerMessages& messages() { return messages_; }

  /// Throws std::runtime_error where something could not all be written.
  void close();

  Counts counts() const;
  const std::filesystem::path& path() const { return folder_; }

 private:
  struct Run {
    Run(const std::filesystem::path& folder, const net::TopologyMessage& topology, bool surface_only,
        std::size_t needle_count, double period_s);
    ParaviewWriter paraview;
    SessionLog log;
    std::filesystem::path events_file;
    std::ofstream events;
  };

  net::MessageHandlers handlers();
  void start_run();
  void end_run();
  void write(const net::FrameMessage& frame);
  void write(const net::EventMessage& event);
  void write(const net::SceneMessage& scene);
  void write_poses(const net::FrameMessage& frame);
  void write_forces(const net::FrameMessage& frame);
  std::vector<float> points() const;  // the mesh's, or its surface's

  const std::filesystem::path folder_;
  const bool surface_only_;
  double period_s_ = 0;
  std::size_t needle_count_ = 1;
  net::TopologyMessage topology_;
  RunStarts starts_;
  std::optional<Run> run_;
  Counts ended_;  // of the runs before this one
  std::uint64_t events_ = 0;
  net::ServerMessages messages_;
};

/// Summary of what has been written and where, a line without its end.
std::string to_text(const RecordingFolder& folder);

}  // namespace brachy
