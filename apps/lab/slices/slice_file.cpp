#include "apps/lab/slices/slice_file.h"

#include <fmt/format.h>

#include <fstream>
#include <optional>

#include "core/base/error.h"
#include "core/base/simd/simd_target.h"
#include "core/base/version.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

struct ReadFile {
  std::string name;
  Slice slice;
  OrderedJson json;
};

ReadFile read_file(const std::filesystem::path& path, const std::string& tool) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw UserError(path.string() + ": cannot be read");
  OrderedJson json = OrderedJson::parse(in, nullptr, false);
  const auto refuse = [&](const std::string& why) {
    throw UserError(
        fmt::format("{}: {}; write it with `brachy {} --slice I/N --json FILE`", path.string(), why, tool));
  };
  if (json.is_discarded()) refuse("is not JSON, or is truncated");
  const auto text_at = [&](const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_string() ? json[key].get<std::string>()
                                                                           : "";
  };
  const auto slice = find_slice(text_at("slice"));
  if (text_at("tool") != tool || !slice || !json.contains("run") || !json["run"].is_object())
    refuse("is not a slice of `brachy " + tool + "`");
  return {path.string(), *slice, std::move(json)};
}

/// A value, shortened for an error message.
std::string shown(const OrderedJson& value) {
  const std::string text = value.dump();
  return text.size() <= 40 ? text : "another";
}

void check_same_run(const ReadFile& first, const ReadFile& other) {
  if (other.slice.count != first.slice.count)
    throw UserError(fmt::format("{}: is of {} slices, {} of {}", other.name, other.slice.count, first.name,
                                first.slice.count));
  const OrderedJson &run = first.json["run"], &its = other.json["run"];
  for (const auto& [key, value] : run.items())
    if (!its.contains(key) || its[key] != value)
      throw UserError(fmt::format("{}: is of another run than {}: {} is {}, not {}", other.name, first.name,
                                  key, its.contains(key) ? shown(its[key]) : "missing", shown(value)));
}

}  // namespace

OrderedJson slice_file(const std::string& tool, const Slice& slice, OrderedJson run) {
  run["version"] = version();
  run["simd"] = to_string(best_simd_target());
  return {{"tool", tool}, {"slice", to_string(slice)}, {"run", std::move(run)}};
}

std::vector<OrderedJson> read_slice_files(const std::vector<std::filesystem::path>& files,
                                          const std::string& tool) {
  std::vector<std::optional<ReadFile>> slices;
  const ReadFile* first = nullptr;
  for (const auto& file : files) {
    ReadFile read = read_file(file, tool);
    if (!first) slices.resize(static_cast<std::size_t>(read.slice.count));
    if (first) check_same_run(*first, read);
    auto& place = slices[static_cast<std::size_t>(read.slice.index - 1)];
    if (place)
      throw UserError(
          fmt::format("{} and {}: both are slice {}", place->name, read.name, to_string(read.slice)));
    place = std::move(read);
    if (!first) first = &*place;
  }
  std::string missing;
  for (std::size_t i = 0; i < slices.size(); ++i)
    if (!slices[i]) missing.append(missing.empty() ? "" : ", ").append(std::to_string(i + 1));
  if (!missing.empty())
    throw UserError(fmt::format("--merge: of {} slices these are missing: {}", slices.size(), missing));
  std::vector<OrderedJson> all;
  all.reserve(slices.size());
  for (auto& slice : slices) all.push_back(std::move(slice->json));
  return all;
}

}  // namespace brachy
