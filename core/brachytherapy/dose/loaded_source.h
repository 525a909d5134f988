#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/brachytherapy/dose/source_tables.h"

namespace brachy {

struct DoseTables;

/// A source from a file's text. It never moves or changes.
class LoadedSource {
 public:
  LoadedSource(SourceTables tables, SourceModel model)
      : tables_(std::move(tables)), data_(tables_.view(model)) {}
  LoadedSource(const LoadedSource&) = delete;
  LoadedSource& operator=(const LoadedSource&) = delete;

  const SourceTables& tables() const { return tables_; }
  const Tg43Source& data() const { return data_; }

 private:
  SourceTables tables_;
  Tg43Source data_;
};

/// The shipped ones that are no C++ tables, then those that add_source added. Threads: not during add_source.
std::vector<const LoadedSource*> loaded_sources();
/// Null for a model that has not been loaded. Threads: any that was handed the model after add_source returned it.
const LoadedSource* find_loaded(SourceModel model);
/// The tables of the inner loop of a source that find_loaded() finds; those of a shipped one are computed at the first
/// call. Threads: as find_loaded.
const DoseTables& loaded_dose_tables(SourceModel model);

/// Registers a file's source and returns its model; the same content as before, the same model. Sources are kept until
/// the process ends, because seeds refer to them. Threads: one at a time, which reads scenes and plans.
/// Errors: UserError where another source has its name or number, or there are kMostSourceFiles already.
SourceModel add_source(SourceTables tables, const std::string& file);
inline constexpr std::size_t kMostSourceFiles = 64;

}  // namespace brachy
