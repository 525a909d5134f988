#include "core/base/toml_table.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include <toml++/toml.h>

#include "core/base/one_line.h"
#include "core/base/toml_precheck.h"

namespace brachy {
namespace {

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

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const auto& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

/// Messages quote the file, which may hold control characters.
[[noreturn]] void refuse(const std::string& what) {
  throw UserError(one_line(what));
}

}  // namespace

struct TomlTable::State {
  std::shared_ptr<const toml::table> file_root;  ///< keeps `table` alive
  const toml::table* table;                      ///< null: the file does not have it
  std::string prefix;                            ///< "model." for [model]
  std::string file;
  std::vector<std::string> known;  ///< the keys that have been asked for

  const toml::node* find(const char* key) {
    known.emplace_back(key);
    return table ? table->get(key) : nullptr;
  }

  [[noreturn]] void fail(const toml::node& node, const char* key, const std::string& what) const {
    refuse(file + ":" + std::to_string(node.source().begin.line) + ": '" + prefix + key + "' " + what);
  }

  void require_between(const toml::node& node, const char* key, double v, double least, double most) const {
    if (!(v >= least && v <= most))
      fail(node, key,
           "is " + text_of(v) + "; it must be between " + text_of(least) + " and " + text_of(most));
  }

  std::shared_ptr<State> child(const toml::table* of_child, const char* key) const {
    return std::make_shared<State>(State{file_root, of_child, std::string(key) + ".", file, {}});
  }
};

TomlTable parse_toml(std::string_view text, const std::string& name) {
  if (const auto excess = find_toml_excess(text))
    refuse(name + ":" + std::to_string(excess->line) + ": " + excess->what);
  try {
    const auto root = std::make_shared<const toml::table>(toml::parse(text, name));
    return TomlTable(std::make_shared<TomlTable::State>(TomlTable::State{root, root.get(), "", name, {}}));
  } catch (const toml::parse_error& e) {
    refuse(name + ":" + std::to_string(e.source().begin.line) +
           ": not valid TOML: " + std::string(e.description()));
  }
}

bool TomlTable::has(const char* key) const {
  return state_->table && state_->table->contains(key);
}

void TomlTable::number(const char* key, double& value, double least, double most) {
  const toml::node* node = state_->find(key);
  if (!node) return;
  const auto v = node->is_number() ? node->value<double>() : std::optional<double>();
  if (!v) state_->fail(*node, key, "needs a number");
  state_->require_between(*node, key, *v, least, most);
  value = *v;
}

void TomlTable::numbers(const char* key, Vec3& value, double least, double most) {
  const toml::node* node = state_->find(key);
  if (!node) return;
  const toml::array* list = node->as_array();
  if (!list || list->size() != 3)
    state_->fail(*node, key, "needs three numbers in brackets, such as [24, 18, 21]");
  for (std::size_t k = 0; k < 3; ++k) {
    const toml::node& entry = *list->get(k);
    if (!entry.is_number()) state_->fail(*node, key, "needs three numbers in brackets, such as [24, 18, 21]");
    state_->require_between(*node, key, *entry.value<double>(), least, most);
    value[static_cast<Eigen::Index>(k)] = *entry.value<double>();
  }
}

bool TomlTable::list(const char* key, std::vector<double>& values, double least, double most) {
  const toml::node* node = state_->find(key);
  if (!node) return false;
  const toml::array* entries = node->as_array();
  if (!entries) state_->fail(*node, key, "needs a list of numbers in brackets, such as [0.5, 1]");
  values.clear();
  for (const toml::node& entry : *entries) {
    if (!entry.is_number()) state_->fail(entry, key, "has an entry that is not a number");
    state_->require_between(entry, key, *entry.value<double>(), least, most);
    values.push_back(*entry.value<double>());
  }
  return true;
}

bool TomlTable::rows(const char* key, std::vector<std::vector<double>>& values, double least, double most) {
  const toml::node* node = state_->find(key);
  if (!node) return false;
  const toml::array* lists = node->as_array();
  if (!lists) state_->fail(*node, key, "needs a list of rows, such as [[1, 1], [0.9, 1]]");
  values.clear();
  for (const toml::node& row : *lists) {
    const toml::array* entries = row.as_array();
    if (!entries) state_->fail(row, key, "needs a list of rows, such as [[1, 1], [0.9, 1]]");
    if (!values.empty() && entries->size() != values.front().size())
      state_->fail(row, key,
                   "has a row of " + std::to_string(entries->size()) + " numbers, and the first has " +
                       std::to_string(values.front().size()));
    std::vector<double>& read = values.emplace_back();
    for (const toml::node& entry : *entries) {
      if (!entry.is_number()) state_->fail(entry, key, "has an entry that is not a number");
      const double v = *entry.value<double>();
      if (v == v) state_->require_between(entry, key, v, least, most);
      read.push_back(v);
    }
  }
  return true;
}

bool TomlTable::whole_number(const char* key, std::int64_t& value, std::int64_t least, std::int64_t most) {
  const toml::node* node = state_->find(key);
  if (!node) return false;
  if (!node->is_integer()) state_->fail(*node, key, "needs a whole number");
  const std::int64_t v = node->as_integer()->get();
  if (v < least || v > most)
    state_->fail(*node, key,
                 "is " + std::to_string(v) + "; it must be between " + std::to_string(least) + " and " +
                     std::to_string(most));
  value = v;
  return true;
}

void TomlTable::flag(const char* key, bool& value) {
  const toml::node* node = state_->find(key);
  if (!node) return;
  if (!node->is_boolean()) state_->fail(*node, key, "needs true or false");
  value = node->as_boolean()->get();
}

void TomlTable::text(const char* key, std::string& value, const std::vector<std::string>& allowed) {
  const toml::node* node = state_->find(key);
  if (!node) return;
  if (!node->is_string()) state_->fail(*node, key, "needs a string in quotes");
  const std::string v = node->as_string()->get();
  if (!allowed.empty() && std::find(allowed.begin(), allowed.end(), v) == allowed.end())
    state_->fail(*node, key, "is \"" + one_short_line(v) + "\"; it must be one of: " + listed(allowed));
  value = v;
}

bool TomlTable::texts(const char* key, std::vector<std::string>& values,
                      const std::vector<std::string>& allowed) {
  const toml::node* node = state_->find(key);
  if (!node) return false;
  const toml::array* list = node->as_array();
  if (!list) state_->fail(*node, key, "needs a list in brackets, of: " + listed(allowed));
  values.clear();
  for (const toml::node& entry : *list) {
    const auto v = entry.value<std::string>();
    if (!v || std::find(allowed.begin(), allowed.end(), *v) == allowed.end())
      state_->fail(
          *node, key,
          (v ? "has \"" + one_short_line(*v) + "\"" : std::string("has an entry that is not a string")) +
              "; its entries must be of: " + listed(allowed));
    if (std::find(values.begin(), values.end(), *v) != values.end())
      state_->fail(*node, key, "has \"" + *v + "\" twice");
    values.push_back(*v);
  }
  return true;
}

TomlTable TomlTable::table(const char* key) {
  const toml::node* node = state_->find(key);
  if (node && !node->is_table())
    state_->fail(*node, key, "needs to be a table: write [" + std::string(key) + "]");
  return TomlTable(state_->child(node ? node->as_table() : nullptr, key));
}

std::vector<TomlTable> TomlTable::tables(const char* key) {
  const toml::node* node = state_->find(key);
  if (!node) return {};
  const toml::array* list = node->as_array();
  if (!list || !list->is_homogeneous(toml::node_type::table))
    state_->fail(*node, key, "needs to be a list of tables: write [[" + std::string(key) + "]]");
  std::vector<TomlTable> all;
  for (const toml::node& entry : *list) all.push_back(TomlTable(state_->child(entry.as_table(), key)));
  return all;
}

void TomlTable::refuse_unknown(const std::vector<std::string>& elsewhere) const {
  if (!state_->table) return;
  for (const auto& [key, node] : *state_->table) {
    if (std::find(state_->known.begin(), state_->known.end(), key.str()) != state_->known.end()) continue;
    const std::string name = one_short_line(std::string(key.str()));
    for (const std::string& other : elsewhere)
      if (const auto dot = other.rfind('.'); other.substr(dot + 1) == name)
        refuse(state_->file + ":" + std::to_string(node.source().begin.line) + ": '" + name +
               "' belongs into the table [" + other.substr(0, dot) + "]: write it below that line");
    refuse(state_->file + ":" + std::to_string(node.source().begin.line) + ": unknown key '" +
           state_->prefix + name + "'; did you mean '" + state_->prefix + nearest(name, state_->known) +
           "'?");
  }
}

void TomlTable::contradiction(const char* key, const std::string& what) const {
  const toml::node* node = state_->table ? state_->table->get(key) : nullptr;
  const std::string line = node ? ":" + std::to_string(node->source().begin.line) : "";
  refuse(state_->file + line + ": '" + state_->prefix + key + "' " + what);
}

void TomlTable::missing(const char* key, const std::string& what) const {
  refuse(place() + ": '" + state_->prefix + key + "' is missing; " + what);
}

std::string TomlTable::place() const {
  return state_->table ? state_->file + ":" + std::to_string(state_->table->source().begin.line)
                       : state_->file;
}

}  // namespace brachy
