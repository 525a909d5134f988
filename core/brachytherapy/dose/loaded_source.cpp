#include "core/brachytherapy/dose/loaded_source.h"

#include <array>
#include <memory>
#include <utility>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_loops.h"
#include "core/brachytherapy/dose/shipped_source.h"

namespace brachy {
namespace {

/// One of a file, with the tables of the inner loop.
struct FileSource {
  FileSource(SourceTables tables, SourceModel model)
      : source(std::move(tables), model), dose_tables(make_dose_tables(source.data())) {}
  LoadedSource source;
  DoseTables dose_tables;
};

/// Those of files: a slot is filled once, before its model is handed out, and stays.
struct SourceSlots {
  std::array<std::unique_ptr<const FileSource>, kMostSourceFiles> slots;
  std::size_t count = 0;
};

SourceSlots& source_slots() {
  static SourceSlots all;
  return all;
}

constexpr auto kFirstShipped = static_cast<std::size_t>(SourceModel::kIsoRayCs1),
               kFirstOfFile = static_cast<std::size_t>(SourceModel::kFirstOfFiles);
using ShippedSources = std::array<std::unique_ptr<const LoadedSource>, kShippedSourceCount>;

const ShippedSources& shipped_sources() {
  static const ShippedSources all = [] {
    ShippedSources sources;
    for (std::size_t i = 0; i < sources.size(); ++i)
      sources[i] = std::make_unique<const LoadedSource>(
          parse_source(kShippedSources[i].text, std::string(kShippedSources[i].file)),
          static_cast<SourceModel>(kFirstShipped + i));
    return sources;
  }();
  return all;
}

/// Of one shipped source: each is computed when it is asked for.
template <std::size_t I>
const DoseTables& shipped_dose_tables() {
  static const DoseTables tables = make_dose_tables(shipped_sources()[I]->data());
  return tables;
}

template <std::size_t... I>
const DoseTables& shipped_dose_tables(std::size_t i, std::index_sequence<I...>) {
  using Tables = const DoseTables& (*)();
  static constexpr std::array<Tables, sizeof...(I)> kAll = {shipped_dose_tables<I>...};
  return kAll[i]();
}

bool is_shipped(std::size_t value) {
  return value >= kFirstShipped && value < kFirstShipped + kShippedSourceCount;
}

}  // namespace

std::vector<const LoadedSource*> loaded_sources() {
  std::vector<const LoadedSource*> all;
  for (const auto& shipped : shipped_sources()) all.push_back(shipped.get());
  const SourceSlots& files = source_slots();
  for (std::size_t i = 0; i < files.count; ++i) all.push_back(&files.slots[i]->source);
  return all;
}

const LoadedSource* find_loaded(SourceModel model) {
  const auto value = static_cast<std::size_t>(model);
  if (is_shipped(value)) return shipped_sources()[value - kFirstShipped].get();
  const bool is_of_file = value >= kFirstOfFile && value < kFirstOfFile + kMostSourceFiles;
  const auto* const slot = is_of_file ? source_slots().slots[value - kFirstOfFile].get() : nullptr;
  return slot ? &slot->source : nullptr;
}

const DoseTables& loaded_dose_tables(SourceModel model) {
  const auto value = static_cast<std::size_t>(model);
  if (is_shipped(value))
    return shipped_dose_tables(value - kFirstShipped, std::make_index_sequence<kShippedSourceCount>());
  return source_slots().slots[value - kFirstOfFile]->dose_tables;
}

SourceModel add_source(SourceTables tables, const std::string& file) {
  for (const LoadedSource* loaded : loaded_sources())
    if (loaded->tables() == tables) return loaded->data().model;
  for (const std::string& taken : {tables.name, std::to_string(tables.number)})
    if (const auto other = find_source(taken))
      // A shipped source's own file, read by its path, is the shipped one where nothing in it differs.
      throw UserError(file + ": source " + taken + " exists already, with other data (" +
                      std::string(tg43_source(*other).description) +
                      "); give this one a name and a number of its own");
  SourceSlots& files = source_slots();
  if (files.count == kMostSourceFiles)
    throw UserError(file + ": " + std::to_string(kMostSourceFiles) +
                    " source files have been read; restart the program");
  const auto model =
      static_cast<SourceModel>(static_cast<std::size_t>(SourceModel::kFirstOfFiles) + files.count);
  files.slots[files.count] = std::make_unique<const FileSource>(std::move(tables), model);
  ++files.count;
  return model;
}

}  // namespace brachy
