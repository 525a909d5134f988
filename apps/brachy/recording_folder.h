#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "apps/brachy/paraview_writer.h"
#include "apps/recording/read_recording.h"
#include "apps/session/session_log.h"
#include "net/server_messages.h"

namespace brachy {

/// Writes what a server sends as files to look at and to compute with: recording.pvd and its .vtp series, poses.csv,
/// forces.csv (a row a snapshot), seeds.csv, events.csv, and structures/ where the SCENE came. What `brachy record --out DIR`
/// and `brachy export` make; the same messages make the same bytes. Where the simulation was reset, what follows goes into a
/// folder of its own within: run_2, run_3, ….
/// Threads: one.
class RecordingFolder {
 public:
  struct Counts {
    std::uint64_t runs = 0, snapshots = 0, poses = 0, forces = 0, seeds = 0, events = 0;
    std::uint64_t ticks_missed = 0;  ///< whose poses came too late to be known
  };

  /// Makes the folder. `surface_only`: leave the interior points out. Throws UserError where it cannot be made or holds a
  /// recording.
  RecordingFolder(std::filesystem::path folder, bool surface_only);

  /// Hand the messages to this one: it writes them. Its take() throws std::runtime_error where a file cannot be written;
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

/// What has been written and where, a line for people without its end.
std::string to_text(const RecordingFolder& folder);

}  // namespace brachy
