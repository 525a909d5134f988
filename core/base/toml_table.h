#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/rigid_transform.h"

namespace brachy {

/// One table of a TOML file. It reads the keys that are asked for, one by one, then refuses those that nothing asked
/// for. Every error is a UserError of one line that gives the file, the line, the key and the fix.
/// Copies share what has been asked for. Threads: one.
class TomlTable {
 public:
  bool has(const char* key) const;

  // Each of these leaves `value` as it is where the file does not have the key.
  void number(const char* key, double& value, double least, double most);
  void numbers(const char* key, Vec3& value, double least, double most);  ///< a list of three
  /// A list of any length. Returns false where the file does not have the key.
  bool list(const char* key, std::vector<double>& values, double least, double most);
  /// A list of such lists, all of one length. A number may be nan, where the table has no value. Returns as list().
  bool rows(const char* key, std::vector<std::vector<double>>& values, double least, double most);
  template <class Integer>
  void integer(const char* key, Integer& value, std::int64_t least, std::int64_t most) {
    std::int64_t v = 0;
    if (whole_number(key, v, least, most)) value = static_cast<Integer>(v);
  }
  void flag(const char* key, bool& value);
  void text(const char* key, std::string& value, const std::vector<std::string>& allowed = {});
  /// A list of strings, each at most once. Returns false where the file does not have the key.
  bool texts(const char* key, std::vector<std::string>& values, const std::vector<std::string>& allowed);

  TomlTable table(const char* key);                ///< [key]; an empty one where the file has none
  std::vector<TomlTable> tables(const char* key);  ///< every [[key]], in the order of the file

  /// Throws for the first key that has not been asked for, and proposes the nearest one that has been.
  /// `elsewhere`: "table.key" of keys in other tables, which the message names where one is meant.
  void refuse_unknown(const std::vector<std::string>& elsewhere = {}) const;
  /// Refuses the value at `key` because of another key's value.
  [[noreturn]] void contradiction(const char* key, const std::string& what) const;
  /// Refuses the table because `key` is missing.
  [[noreturn]] void missing(const char* key, const std::string& what) const;
  std::string place() const;  ///< file:line

 private:
  friend TomlTable parse_toml(std::string_view text, const std::string& name);

  struct State;
  explicit TomlTable(std::shared_ptr<State> state) : state_(std::move(state)) {}

  bool whole_number(const char* key, std::int64_t& value, std::int64_t least, std::int64_t most);

  std::shared_ptr<State> state_;
};

/// Parses a file's text; `name` stands for the file in errors. Returns the table of the top level.
/// Throws UserError "name:line: not valid TOML: …", and for text beyond the limits of core/base/toml_precheck.h.
TomlTable parse_toml(std::string_view text, const std::string& name);

}  // namespace brachy
