#include "core/scene/scene_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <sstream>
#include <vector>

#include <toml++/toml.h>

#include "core/error.h"

namespace brachy {
namespace {

constexpr std::uintmax_t kMaxSceneBytes = 1 << 20;

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
    }
  }
  return row.back();
}

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  const auto best = std::min_element(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
    return edit_distance(word, a) < edit_distance(word, b);
  });
  return best == candidates.end() ? std::string() : *best;
}

std::string text_of(double v) {
  std::ostringstream out;
  out << v;
  return out.str();
}

/// One [table] of the file: takes the keys it is asked for, then refuses what is left over.
class Table {
 public:
  Table(const toml::table* table, std::string prefix, std::string file)
      : table_(table), prefix_(std::move(prefix)), file_(std::move(file)) {}

  void number(const char* key, double& value, double least, double most) {
    const toml::node* node = find(key);
    if (!node) return;
    const auto v = node->is_number() ? node->value<double>() : std::optional<double>();
    if (!v) fail(*node, key, "needs a number");
    if (!(*v >= least && *v <= most))
      fail(*node, key,
           "is " + text_of(*v) + "; it must be between " + text_of(least) + " and " + text_of(most));
    value = *v;
  }

  template <class Integer>
  void integer(const char* key, Integer& value, std::int64_t least, std::int64_t most) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_integer()) fail(*node, key, "needs a whole number");
    const std::int64_t v = node->as_integer()->get();
    if (v < least || v > most)
      fail(*node, key,
           "is " + std::to_string(v) + "; it must be between " + std::to_string(least) + " and " +
               std::to_string(most));
    value = static_cast<Integer>(v);
  }

  void flag(const char* key, bool& value) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_boolean()) fail(*node, key, "needs true or false");
    value = node->as_boolean()->get();
  }

  void text(const char* key, std::string& value, const std::vector<std::string>& allowed = {}) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_string()) fail(*node, key, "needs a text in quotes");
    const std::string v = node->as_string()->get();
    if (!allowed.empty() && std::find(allowed.begin(), allowed.end(), v) == allowed.end()) {
      std::string list;
      for (const auto& a : allowed) list += (list.empty() ? "" : ", ") + a;
      fail(*node, key, "is \"" + v + "\"; it must be one of: " + list);
    }
    value = v;
  }

  void refuse_unknown() const {
    if (!table_) return;
    for (const auto& [key, node] : *table_) {
      const std::string name(key.str());
      if (std::find(known_.begin(), known_.end(), name) == known_.end())
        throw UserError(file_ + ":" + std::to_string(node.source().begin.line) + ": unknown key '" + prefix_ +
                        name + "'; did you mean '" + prefix_ + nearest(name, known_) + "'?");
    }
  }

  Table table(const char* key) {
    const toml::node* node = find(key);
    if (node && !node->is_table()) fail(*node, key, "needs to be a table: write [" + std::string(key) + "]");
    return {node ? node->as_table() : nullptr, std::string(key) + ".", file_};
  }

  /// Refuses what the file says at `key` because of another key's value.
  [[noreturn]] void contradiction(const char* key, const std::string& what) const {
    const toml::node* node = table_ ? table_->get(key) : nullptr;
    const std::string line = node ? ":" + std::to_string(node->source().begin.line) : "";
    throw UserError(file_ + line + ": '" + prefix_ + key + "' " + what);
  }

 private:
  const toml::node* find(const char* key) {
    known_.emplace_back(key);
    return table_ ? table_->get(key) : nullptr;
  }
  [[noreturn]] void fail(const toml::node& node, const char* key, const std::string& what) const {
    throw UserError(file_ + ":" + std::to_string(node.source().begin.line) + ": '" + prefix_ + key + "' " +
                    what);
  }

  const toml::table* table_;
  std::string prefix_;
  std::string file_;
  std::vector<std::string> known_;
};

std::vector<std::string> kernel_list() {
  std::vector<std::string> names;
  for_each_kernel([&](auto kernel) { names.emplace_back(kernel.kName); });
  return names;
}

void read_tissue(Table t, TissueSettings& s) {
  t.text("mesh", s.mesh);
  t.text("units", s.units, {"mm", "m"});
  t.text("frame", s.frame, {"RAS", "LPS"});
  t.integer("points", s.points, 4, 5'000'000);
  t.integer("phantom_surface_vertices", s.phantom_surface_vertices, 100, 1'000'000);
  t.number("min_island_share", s.min_island_share, 0, 0.5);
  t.number("weld_tolerance_mm", s.weld_tolerance_mm, 0, 1);
  t.integer("seed", s.seed, 0, std::numeric_limits<std::int64_t>::max());
  t.refuse_unknown();
  if (s.mesh.empty() && s.points < s.phantom_surface_vertices)
    t.contradiction("points", "is less than tissue.phantom_surface_vertices (" +
                                  std::to_string(s.phantom_surface_vertices) +
                                  "); raise one or lower the other");
}

void read_model(Table t, ModelSettings& s) {
  t.text("kernel", s.kernel, kernel_list());
  t.number("support_radius_mm", s.support_radius_mm, 0.5, 500);
  t.refuse_unknown();
}

void read_anchors(Table t, Anchors::Options& s) {
  t.integer("count", s.count, 0, 64);
  t.number("lambda_rest", s.lambda_rest, 0.01, 0.99);
  s.lambda_loaded = s.lambda_rest;
  t.number("lambda_loaded", s.lambda_loaded, 0.01, 0.99);
  t.number("relaxation_s", s.relaxation_s, 0.001, 100);
  t.number("clearance_mm", s.clearance_mm, 0, 100);
  t.integer("seed", s.seed, 0, std::numeric_limits<std::int64_t>::max());
  t.refuse_unknown();
  if (s.lambda_loaded > s.lambda_rest)
    t.contradiction("lambda_loaded", "must not exceed anchors.lambda_rest (" + text_of(s.lambda_rest) +
                                         "): anchors retreat under load");
}

void read_needle(Table t, NeedleSettings& s) {
  t.number("length_mm", s.length_mm, 10, 500);
  t.number("diameter_mm", s.diameter_mm, 0.1, 10);
  t.refuse_unknown();
}

void read_contact(Table t, ContactSettings& s, double needle_length_mm) {
  t.number("puncture_indentation_mm", s.puncture_indentation_mm, 0.01, 50);
  t.number("cutting_displacement_mm", s.cutting_displacement_mm, 0, 50);
  t.number("friction_displacement_mm", s.friction_displacement_mm, 0, 50);
  t.number("surface_slip_mm", s.surface_slip_mm, 0, 50);
  t.number("landmark_spacing_mm", s.landmark_spacing_mm, 0.5, 50);
  t.number("max_displacement_mm", s.max_displacement_mm, 0.1, 100);
  t.number("max_jump_mm", s.max_jump_mm, 0.1, 1000);
  t.integer("max_landmarks", s.max_landmarks, 2, 100);
  t.refuse_unknown();
  if (s.landmark_spacing_mm * (s.max_landmarks - 1) < needle_length_mm)
    t.contradiction(
        "max_landmarks",
        "(" + std::to_string(s.max_landmarks) +
            ") at contact.landmark_spacing_mm = " + text_of(s.landmark_spacing_mm) +
            " does not cover the needle of " + text_of(needle_length_mm) + " mm; set it to at least " +
            text_of(std::ceil(needle_length_mm / s.landmark_spacing_mm) + 1) + " or widen the spacing");
}

void read_device(Table t, DeviceSettings& s) {
  t.text("kind", s.kind, {"network", "scripted"});
  t.text("trajectory", s.trajectory);
  t.flag("loop", s.loop);
  t.flag("centre_on_tissue", s.centre_on_tissue);
  t.number("stale_pose_ms", s.stale_pose_ms, 1, 60000);
  t.refuse_unknown();
  if (s.kind == "scripted" && s.trajectory.empty())
    t.contradiction("kind", "is \"scripted\" and needs device.trajectory = \"FILE.csv\"");
}

void read_server(Table t, ServerSettings& s) {
  t.text("address", s.address);
  t.integer("port", s.port, 0, 65535);
  t.integer("max_clients", s.max_clients, 1, 1024);
  t.integer("max_message_bytes", s.max_message_bytes, 256, 16 << 20);
  t.number("max_poses_per_s", s.max_poses_per_s, 1, 100000);
  t.refuse_unknown();
}

void read_rates(Table t, RateSettings& s) {
  t.number("deformation_hz", s.deformation_hz, 1, 1000);
  t.number("snapshot_hz", s.snapshot_hz, 1, 120);
  t.refuse_unknown();
}

void read_engine(Table t, EngineSettings& s) {
  t.text("simd", s.simd, {"auto", "generic", "sse4", "avx2", "avx512"});
  t.integer("threads", s.threads, 1, 64);
  t.refuse_unknown();
}

void read_realtime(Table t, RealtimeSettings& s) {
  t.integer("fifo_priority", s.fifo_priority, 0, 99);
  t.flag("lock_memory", s.lock_memory);
  t.flag("control_thread", s.control_thread);
  t.refuse_unknown();
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name) {
  Scene scene;
  toml::table root;
  try {
    root = toml::parse(text, name);
  } catch (const toml::parse_error& e) {
    throw UserError(name + ":" + std::to_string(e.source().begin.line) +
                    ": not valid TOML: " + std::string(e.description()));
  }
  Table top(&root, "", name);
  top.text("name", scene.name);
  read_tissue(top.table("tissue"), scene.tissue);
  read_model(top.table("model"), scene.model);
  read_anchors(top.table("anchors"), scene.anchors);
  read_needle(top.table("needle"), scene.needle);
  read_contact(top.table("contact"), scene.contact, scene.needle.length_mm);
  read_rates(top.table("rates"), scene.rates);
  read_engine(top.table("engine"), scene.engine);
  read_realtime(top.table("realtime"), scene.realtime);
  read_device(top.table("device"), scene.device);
  read_server(top.table("server"), scene.server);
  top.refuse_unknown();
  return scene;
}

Scene load_scene(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(
        name + ": no such scene file; give one with --config (config/prostate.toml is the default scene)");
  if (std::filesystem::file_size(file, error) > kMaxSceneBytes)
    throw UserError(name + ": larger than 1 MiB; a scene file is a page of TOML");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(name + ": cannot be read; check its permissions");
  Scene scene = parse_scene(text.str(), name);
  scene.directory = file.parent_path();
  return scene;
}

}  // namespace brachy
