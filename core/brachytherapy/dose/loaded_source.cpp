#include "core/brachytherapy/dose/loaded_source.h"

#include <array>
#include <utility>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_loops.h"

namespace brachy {

extern const std::string_view kShippedCs1Rev2, kShippedMhdrV2;  // CMake makes them of config/sources

namespace {

/// Those of files: a slot is filled once, before its model is handed out, and stays.
struct SourceSlots {
  std::array<std::unique_ptr<const LoadedSource>, kMostSourceFiles> slots;
  std::size_t count = 0;
};

SourceSlots& source_slots() {
  static SourceSlots all;
  return all;
}

const std::array<LoadedSource, 2>& shipped_sources() {
  static const std::array<LoadedSource, 2> all = {
      LoadedSource(parse_source(kShippedCs1Rev2, "cs1-rev2.toml"), SourceModel::kIsoRayCs1),
      LoadedSource(parse_source(kShippedMhdrV2, "mhdr-v2.toml"), SourceModel::kMicroSelectronV2)};
  return all;
}

}  // namespace

LoadedSource::LoadedSource(SourceTables tables, SourceModel model)
    : tables_(std::move(tables)),
      data_(tables_.view(model)),
      dose_tables_(std::make_unique<const DoseTables>(make_dose_tables(data_))) {}

LoadedSource::~LoadedSource() = default;

std::vector<const LoadedSource*> loaded_sources() {
  std::vector<const LoadedSource*> all;
  for (const LoadedSource& shipped : shipped_sources()) all.push_back(&shipped);
  const SourceSlots& files = source_slots();
  for (std::size_t i = 0; i < files.count; ++i) all.push_back(files.slots[i].get());
  return all;
}

const LoadedSource* find_loaded(SourceModel model) {
  for (const LoadedSource& shipped : shipped_sources())
    if (shipped.data().model == model) return &shipped;
  const auto value = static_cast<std::size_t>(model),
             first = static_cast<std::size_t>(SourceModel::kFirstOfFiles);
  return value >= first && value < first + kMostSourceFiles ? source_slots().slots[value - first].get()
                                                            : nullptr;
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
  files.slots[files.count] = std::make_unique<const LoadedSource>(std::move(tables), model);
  ++files.count;
  return model;
}

}  // namespace brachy
