#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/source_tables.h"

namespace brachy {

struct DoseTables;

/// A source from a file's text, with the tables of the inner loop. It never moves or changes.
class LoadedSource {
 public:
  LoadedSource(SourceTables tables, SourceModel model);
  ~LoadedSource();
  LoadedSource(const LoadedSource&) = delete;
  LoadedSource& operator=(const LoadedSource&) = delete;

  const SourceTables& tables() const { return tables_; }
  const Tg43Source& data() const { return data_; }
  const DoseTables& dose_tables() const { return *dose_tables_; }

 private:
  SourceTables tables_;
  Tg43Source data_;
  std::unique_ptr<const DoseTables> dose_tables_;
};

/// The shipped ones that are no C++ tables, then those that add_source added. Threads: not during add_source.
std::vector<const LoadedSource*> loaded_sources();
/// Null for a model that has not been loaded. Threads: any that was handed the model after add_source returned it.
const LoadedSource* find_loaded(SourceModel model);

/// Registers a file's source and returns its model; the same content as before, the same model. Sources are kept until
/// the process ends, because seeds refer to them. Threads: one at a time, which reads scenes and plans.
/// Errors: UserError where another source has its name or number, or there are kMostSourceFiles already.
SourceModel add_source(SourceTables tables, const std::string& file);
inline constexpr std::size_t kMostSourceFiles = 64;

}  // namespace brachy
