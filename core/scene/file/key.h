#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/toml_table.h"

namespace brachy {

/// What a reload of the scene file (SIGHUP) does with a key whose value has changed.
enum class Reload {
  kLive,     ///< takes the new value while the daemon runs
  kRestart,  ///< keeps the old one and reports that a restart is needed
  kIgnored,  ///< is not compared: the choice that "auto" makes of it shows in other keys
};

/// One key of a section, whose value is stored in a `Settings`. The functions below make one for each type of value.
/// The unit is the name's suffix (core/scene/file/key_text.h).
template <class Settings>
struct Key {
  const char* name;   ///< as in the file, without the section
  std::string type;   ///< "number", "text" …
  std::string range;  ///< as a message would give it; empty: any value
  Reload reload;
  std::string doc;  ///< one line: what it is, its source, special values
  /// Reads the key where the table has it. Errors: UserError as TomlTable's.
  std::function<void(TomlTable&, Settings&)> read;
  std::function<std::string(const Settings&)> written;  ///< its value as TOML; empty: the settings have none
  std::function<bool(const Settings&, const Settings&)> is_same;
  std::function<void(Settings& to, const Settings& from)> copy;
  /// another way to give a value that has a key of its own; `written` is an example
  bool is_alternative = false;
};

struct Range {
  double least, most;
};
struct IntegerRange {
  std::int64_t least, most;
};

// A value as TOML writes it.
std::string toml_text(double v);
std::string toml_text(std::int64_t v);
std::string toml_text(bool v);
std::string toml_text(const std::string& v);
std::string toml_text(const Vec3& v);
std::string toml_text(const std::vector<std::string>& v);

std::string range_text(const Range& range);
std::string range_text(const IntegerRange& range);
std::string range_text(const std::vector<std::string>& allowed);

/// A key that is a field of `Settings`.
template <class Settings, class Value, class Read, class Written>
Key<Settings> field_key(const char* name, std::string type, std::string range, Value Settings::*field,
                        Reload reload, const char* doc, Read read, Written written) {
  return {name,
          std::move(type),
          std::move(range),
          reload,
          doc,
          [field, read](TomlTable& t, Settings& s) { read(t, s.*field); },
          [field, written](const Settings& s) { return written(s.*field); },
          [field](const Settings& a, const Settings& b) { return a.*field == b.*field; },
          [field](Settings& to, const Settings& from) { to.*field = from.*field; },
          false};
}

template <class Settings>
Key<Settings> number(const char* name, double Settings::*field, Range r, Reload reload, const char* doc) {
  return field_key(
      name, "number", range_text(r), field, reload, doc,
      [name, r](TomlTable& t, double& v) { t.number(name, v, r.least, r.most); },
      [](double v) { return toml_text(v); });
}

/// A number that a scene may leave open.
template <class Settings>
Key<Settings> number(const char* name, std::optional<double> Settings::*field, Range r, Reload reload,
                     const char* doc) {
  return field_key(
      name, "number", range_text(r), field, reload, doc,
      [name, r](TomlTable& t, std::optional<double>& v) {
        double given = 0;
        t.number(name, given, r.least, r.most);
        if (t.has(name)) v = given;
      },
      [](const std::optional<double>& v) { return v ? toml_text(*v) : std::string(); });
}

template <class Settings>
Key<Settings> numbers(const char* name, Vec3 Settings::*field, Range r, Reload reload, const char* doc) {
  return field_key(
      name, "three numbers", range_text(r), field, reload, doc,
      [name, r](TomlTable& t, Vec3& v) { t.numbers(name, v, r.least, r.most); },
      [](const Vec3& v) { return toml_text(v); });
}

template <class Settings, class Integer>
Key<Settings> integer(const char* name, Integer Settings::*field, IntegerRange r, Reload reload,
                      const char* doc) {
  return field_key(
      name, "whole number", range_text(r), field, reload, doc,
      [name, r](TomlTable& t, Integer& v) { t.integer(name, v, r.least, r.most); },
      [](const Integer& v) { return toml_text(static_cast<std::int64_t>(v)); });
}

template <class Settings>
Key<Settings> flag(const char* name, bool Settings::*field, Reload reload, const char* doc) {
  return field_key(
      name, "true or false", "", field, reload, doc, [name](TomlTable& t, bool& v) { t.flag(name, v); },
      [](bool v) { return toml_text(v); });
}

/// `allowed` empty: any text.
template <class Settings>
Key<Settings> text(const char* name, std::string Settings::*field, const std::vector<std::string>& allowed,
                   Reload reload, const char* doc) {
  return field_key(
      name, "text", range_text(allowed), field, reload, doc,
      [name, allowed](TomlTable& t, std::string& v) { t.text(name, v, allowed); },
      [](const std::string& v) { return toml_text(v); });
}

/// A second way to give a value that has a key of its own. It is read after that one, and `set(table, settings, value)`
/// stores it where the table has it.
template <class Settings, class Read>
Key<Settings> alternative_key(const char* name, std::string type, std::string range, std::string example,
                              Reload reload, const char* doc, Read read) {
  return {name,
          std::move(type),
          std::move(range),
          reload,
          doc,
          read,
          [example](const Settings&) { return example; },
          [](const Settings&, const Settings&) { return true; },
          [](Settings&, const Settings&) {},
          true};
}

template <class Settings, class Set>
Key<Settings> alternative(const char* name, Range r, double example, Reload reload, const char* doc,
                          Set set) {
  return alternative_key<Settings>(name, "number", range_text(r), toml_text(example), reload, doc,
                                   [name, r, set](TomlTable& t, Settings& s) {
                                     double v = 0;
                                     t.number(name, v, r.least, r.most);
                                     if (t.has(name)) set(t, s, v);
                                   });
}

template <class Settings, class Set>
Key<Settings> alternative(const char* name, IntegerRange r, std::int64_t example, Reload reload,
                          const char* doc, Set set) {
  return alternative_key<Settings>(name, "whole number", range_text(r), toml_text(example), reload, doc,
                                   [name, r, set](TomlTable& t, Settings& s) {
                                     std::int64_t v = 0;
                                     t.integer(name, v, r.least, r.most);
                                     if (t.has(name)) set(t, s, v);
                                   });
}

/// The same key of a larger settings struct: `part` returns the `Inner` of an `Outer`, const or not.
template <class Outer, class Inner, class Part>
Key<Outer> within(const Key<Inner>& key, Part part) {
  return {key.name,
          key.type,
          key.range,
          key.reload,
          key.doc,
          [key, part](TomlTable& t, Outer& s) { key.read(t, part(s)); },
          [key, part](const Outer& s) { return key.written(part(s)); },
          [key, part](const Outer& a, const Outer& b) { return key.is_same(part(a), part(b)); },
          [key, part](Outer& to, const Outer& from) { key.copy(part(to), part(from)); },
          key.is_alternative};
}

template <class Outer, class Inner, class Part>
std::vector<Key<Outer>> within(const std::vector<Key<Inner>>& keys, Part part) {
  std::vector<Key<Outer>> all;
  for (const Key<Inner>& key : keys) all.push_back(within<Outer>(key, part));
  return all;
}

}  // namespace brachy
