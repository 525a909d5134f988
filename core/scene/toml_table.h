#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "core/error.h"
#include "core/math/rigid_transform.h"
#include "core/number_text.h"

namespace brachy {

/// A file's text, whose `name` is what errors call it. Throws UserError "name:line: not valid TOML: …".
toml::table parse_toml(std::string_view text, const std::string& name);

/// One [table] of a scene file: takes the keys it is asked for, then refuses what is left over. Every refusal is a
/// UserError that names the file, the line, the key and what it may be.
class TomlTable {
 public:
  /// `table` may be null: nothing is given, every value stays. `prefix`: "model." for [model].
  TomlTable(const toml::table* table, std::string prefix, std::string file)
      : table_(table), prefix_(std::move(prefix)), file_(std::move(file)) {}

  bool has(const char* key) const { return table_ && table_->contains(key); }
  void number(const char* key, double& value, double least, double most);
  void numbers(const char* key, Vec3& value, double least, double most);  ///< three of them
  template <class Integer>
  void integer(const char* key, Integer& value, std::int64_t least, std::int64_t most) {
    std::int64_t v = 0;
    if (whole_number(key, v, least, most)) value = static_cast<Integer>(v);
  }
  void flag(const char* key, bool& value);
  void text(const char* key, std::string& value, const std::vector<std::string>& allowed = {});
  /// A list of texts, each at most once; nothing is said: false.
  bool texts(const char* key, std::vector<std::string>& values, const std::vector<std::string>& allowed);

  TomlTable table(const char* key);
  std::vector<TomlTable> tables(const char* key);  ///< of [[key]]

  void refuse_unknown() const;
  /// Refuses what the file says at `key` because of another key's value.
  [[noreturn]] void contradiction(const char* key, const std::string& what) const;
  /// Refuses the table for the lack of `key`.
  [[noreturn]] void missing(const char* key, const std::string& what) const;
  std::string place() const;  ///< file:line

 private:
  const toml::node* find(const char* key);
  bool whole_number(const char* key, std::int64_t& value, std::int64_t least, std::int64_t most);
  void require_between(const toml::node& node, const char* key, double v, double least, double most) const;
  [[noreturn]] void fail(const toml::node& node, const char* key, const std::string& what) const;

  const toml::table* table_;
  std::string prefix_;
  std::string file_;
  std::vector<std::string> known_;
};

}  // namespace brachy
