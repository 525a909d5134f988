#include "core/scene/file/key_text.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

constexpr std::size_t kCommentColumn = 33, kColumns = 119;

std::size_t columns_of(std::string_view utf8) {
  std::size_t columns = 0;
  for (const char c : utf8) columns += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return columns;
}

/// `text` after `first`, broken at spaces; further lines start with `next`.
std::string wrapped(std::string first, const std::string& next, std::string_view text) {
  std::string out, line = std::move(first);
  bool is_empty = true;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    if (!is_empty && columns_of(line) + 1 + columns_of(word) > kColumns) {
      out += line + "\n";
      line = next;
      is_empty = true;
    }
    if (!is_empty) line += ' ';
    line += word;
    is_empty = false;
  }
  return out + line + "\n";
}

std::string heading_of(const SceneSection& section) {
  return section.list ? std::string("[[") + section.name + "]]" : std::string("[") + section.name + "]";
}

const char* reload_text(Reload reload) {
  switch (reload) {
    case Reload::kLive:
      return "live";
    case Reload::kRestart:
      return "restart";
    case Reload::kIgnored:
      return "ignored";
  }
  return "";
}

/// The default scene with the example of every [[section]].
const Scene& example_scene() {
  static const Scene scene = [] {
    Scene with_lists;
    for (const SceneSection& section : scene_sections())
      if (section.list) section.list->append_example(with_lists);
    return with_lists;
  }();
  return scene;
}

std::string toml_line(const Key<Scene>& key, bool is_comment) {
  std::string line = is_comment ? "# " : "";
  line += key.name + std::string(" = ") + key.written(example_scene());
  const std::size_t columns = columns_of(line);
  line += std::string(columns < kCommentColumn ? kCommentColumn - columns : 2, ' ');
  std::string indent(kCommentColumn, ' ');
  if (is_comment) indent[0] = '#';
  const std::string range = key.range.empty() ? "" : key.range + ": ";
  return wrapped(line + "# ", indent + "#   ", range + key.doc);
}

std::string markdown_row(const Key<Scene>& key) {
  std::string row;
  for (const std::string& cell :
       {std::string("`") + key.name + "`", unit_of_key(key.name), key.type, key.range,
        std::string("`") + key.written(example_scene()) + "`", std::string(reload_text(key.reload)), key.doc})
    row += "| " + cell + (cell.empty() ? "" : " ");
  return row + "|\n";
}

}  // namespace

std::string unit_of_key(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, const char*>, 12> kUnits = {{{"_n_per_mm2", "N/mm²"},
                                                                                {"_n_per_mm", "N/mm"},
                                                                                {"_per_s", "1/s"},
                                                                                {"_bytes", "bytes"},
                                                                                {"_kpa", "kPa"},
                                                                                {"_mm", "mm"},
                                                                                {"_hz", "Hz"},
                                                                                {"_ms", "ms"},
                                                                                {"_gy", "Gy"},
                                                                                {"_n", "N"},
                                                                                {"_s", "s"},
                                                                                {"_u", "U"}}};
  for (const auto& [suffix, unit] : kUnits)
    if (name.ends_with(suffix)) return unit;
  return "";
}

std::string default_scene_toml() {
  std::string out =
      "# The default scene: a phantom of clinical size with as many points as the paper's prostate.\n"
      "# Every key is optional; the values below are the defaults, of a [[list]] an example. A name ends in "
      "its unit. World\n"
      "# frame W: patient RAS. Generated from core/scene/file; config/KEYS.md has the same keys as tables.\n";
  for (const SceneSection& section : scene_sections()) {
    const std::string comment = section.comment;
    if (!section.is_top()) out += "\n";
    if (!comment.empty()) out += wrapped("# ", "# ", comment);
    if (!section.is_top()) out += std::string(section.list ? "# " : "") + heading_of(section) + "\n";
    for (const Key<Scene>& key : section.keys) out += toml_line(key, section.list || key.is_alternative);
  }
  return out;
}

std::string scene_keys_markdown() {
  std::string out =
      "# Keys of a scene file\n\n"
      "Generated from the list in `core/scene/file/*_keys.cpp`, as is `prostate.toml`, the default scene: "
      "edit the list and run\n"
      "`scripts/scene_keys.sh`. `brachyd --check-config FILE` checks a scene file against it.\n\n"
      "Every key is optional unless its section says otherwise. A `[[section]]` may stand several times; the "
      "table shows\n"
      "an example of it. At a reload (SIGHUP), a key that is *live* takes its new value while brachyd runs, "
      "*restart* keeps the\n"
      "old value until brachyd is restarted, and *ignored* is not compared: what `auto` chooses shows in "
      "other keys.\n";
  for (const SceneSection& section : scene_sections()) {
    out += section.is_top() ? "\n## Top of the file\n" : std::string("\n## `") + heading_of(section) + "`\n";
    if (*section.comment != 0) out += std::string("\n") + wrapped("", "", section.comment);
    out += section.list ? "\n| key | unit | type | range | example | reload | meaning |\n"
                        : "\n| key | unit | type | range | default | reload | meaning |\n";
    out += "|---|---|---|---|---|---|---|\n";
    for (const Key<Scene>& key : section.keys) out += markdown_row(key);
  }
  return out;
}

}  // namespace brachy
