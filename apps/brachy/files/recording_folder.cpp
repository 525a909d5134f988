#include "apps/brachy/files/recording_folder.h"

#include <fmt/format.h>

#include <stdexcept>

#include "apps/brachy/files/structure_files.h"
#include "apps/recording/event_kinds.h"
#include "core/base/error.h"

namespace brachy {
namespace {

std::filesystem::path made(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw UserError(folder.string() + ": cannot be created: " + error.message());
  if (SessionLog::is_recording(folder) || std::filesystem::exists(folder / "recording.pvd"))
    throw UserError(folder.string() +
                    ": already holds a recording; give another directory, nothing is overwritten");
  if (!std::filesystem::is_empty(folder, error))
    throw UserError(folder.string() + ": is not empty; give another directory, nothing is overwritten");
  return folder;
}

std::vector<float> first_points(const std::vector<float>& positions, std::size_t count) {
  return {positions.begin(), positions.begin() + static_cast<std::ptrdiff_t>(3 * count)};
}

/// A name received over the wire, made safe as a file name within its directory.
std::string file_name_of(const std::string& name) {
  std::string result;
  for (const char c : name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    result += is_plain || c == '-' || c == '_' ? c : '_';
  }
  return result.empty() ? "unnamed" : result;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

}  // namespace

RecordingFolder::Run::Run(const std::filesystem::path& folder, const net::TopologyMessage& topology,
                          bool surface_only, std::size_t needle_count, double period_s)
    : paraview(folder, topology.triangles,
               surface_only ? first_points(topology.rest_vertices, topology.surface_vertex_count)
                            : topology.rest_vertices,
               topology.surface_vertex_count),
      log(folder, needle_count, period_s),
      events_file(folder / "events.csv"),
      events(events_file, std::ios::binary) {
  events << "tick,t_s,kind,needle,text\n" << std::flush;
  if (!events) throw std::runtime_error(events_file.string() + ": cannot be written; is the disk full?");
}

RecordingFolder::RecordingFolder(std::filesystem::path folder, bool surface_only)
    : folder_(made(folder)), surface_only_(surface_only), messages_(handlers()) {}

net::MessageHandlers RecordingFolder::handlers() {
  net::MessageHandlers h;
  h.on_welcome = [this](const net::WelcomeMessage& welcome) {
    period_s_ = 1 / welcome.deformation_hz;
    needle_count_ = welcome.needle_count;
  };
  h.on_topology = [this](const net::TopologyMessage& topology) {
    topology_ = topology;
    start_run();
  };
  h.on_frame = [this](const net::FrameMessage& frame) { write(frame); };
  h.on_event = [this](const net::EventMessage& event) { write(event); };
  h.on_scene = [this](const net::SceneMessage& scene) { write(scene); };
  return h;
}

void RecordingFolder::start_run() {
  end_run();
  const std::uint64_t number = ++ended_.runs;
  const std::filesystem::path folder = number == 1 ? folder_ : made(folder_ / fmt::format("run_{}", number));
  run_.emplace(folder, topology_, surface_only_, needle_count_, period_s_);
}

void RecordingFolder::end_run() {
  if (!run_) return;
  const Counts all = counts();
  run_->log.close();
  run_.reset();
  ended_ = all;
}

void RecordingFolder::close() {
  if (run_) run_->log.close();
}

RecordingFolder::Counts RecordingFolder::counts() const {
  Counts all = ended_;
  all.events = events_;
  if (!run_) return all;
  all.snapshots += run_->paraview.steps();
  all.poses += run_->log.poses();
  all.forces += run_->log.forces();
  all.seeds += run_->log.seeds();
  all.ticks_missed += run_->log.ticks_missed();
  return all;
}

std::vector<float> RecordingFolder::points() const {
  const std::vector<float>& all = messages_.mesh().positions();
  return surface_only_ ? first_points(all, topology_.surface_vertex_count) : all;
}

void RecordingFolder::write(const net::FrameMessage& frame) {
  if (starts_.is_first_of_a_run(frame)) start_run();
  run_->paraview.add(frame.sim_time_s, points(), frame.certificate);
  run_->log.add_seeds(messages_.mesh().seeds());
  write_poses(frame);
  write_forces(frame);
  run_->log.flush();
}

// A reset event belongs to the run that it ends. An event without a tick gets that of the previous frame.
void RecordingFolder::write(const net::EventMessage& event) {
  starts_.add(event);
  if (!run_) return;
  const std::uint64_t tick = event.tick ? event.tick : messages_.mesh().tick();
  run_->events << fmt::format("{},{},{},{},{}\n", tick, static_cast<double>(tick) * period_s_,
                              to_string(event.kind), event.needle, quoted(event.text))
               << std::flush;
  if (!run_->events)
    throw std::runtime_error(run_->events_file.string() + ": cannot be written; is the disk full?");
  ++events_;
}

void RecordingFolder::write(const net::SceneMessage& scene) {
  std::vector<Structure> structures;
  for (const net::SceneStructure& from : scene.structures) {
    Structure& to = structures.emplace_back();
    to.name = file_name_of(from.name);
    for (std::size_t i = 0; i + 2 < from.vertices.size(); i += 3)
      to.mesh.vertices.emplace_back(from.vertices[i], from.vertices[i + 1], from.vertices[i + 2]);
    to.mesh.triangles = from.triangles;
  }
  if (!structures.empty()) write_structures(folder_ / "structures", structures);
}

// Every pose the simulation used, at its tick's time: replayed offline at the same rate they give the same ticks.
void RecordingFolder::write_poses(const net::FrameMessage& frame) {
  std::vector<UsedPose> used;
  for (const TickPose& pose : frame.pose_history) used.push_back({0, pose});
  for (const net::NeedlePoses& other : frame.poses_of_needles)
    for (const TickPose& pose : other.poses) used.push_back({other.needle, pose});
  run_->log.add_poses(std::move(used));
}

// Snapshots only: what happened between two is not sent.
void RecordingFolder::write_forces(const net::FrameMessage& frame) {
  const double det = frame.certificate ? frame.certificate->vertex_det : Certificate::kNotKnown;
  for (const net::NeedleRecord& needle : frame.needles)
    if (needle.state.present && needle.has_forces)
      run_->log.add_forces(frame.tick, needle.id, needle.state, det);
}

std::string to_text(const RecordingFolder& folder) {
  const RecordingFolder::Counts counts = folder.counts();
  const std::string out = folder.path().string();
  std::string text = fmt::format(
      "{} snapshots in {}/recording.pvd (ParaView), {} poses in {}/poses.csv, {} forces in {}/forces.csv, "
      "{} seeds in {}/seeds.csv, {} events in {}/events.csv",
      counts.snapshots, out, counts.poses, out, counts.forces, out, counts.seeds, out, counts.events, out);
  if (counts.runs > 1)
    text += fmt::format("; the simulation was reset: {} runs, the later ones in run_2 … within", counts.runs);
  if (counts.ticks_missed) text += fmt::format("; {} ticks' poses were missed", counts.ticks_missed);
  return text;
}

}  // namespace brachy
