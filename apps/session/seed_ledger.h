#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/session/session_folder.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// The ledger of dropped seeds, an append-only file (core/brachytherapy/seeds/seed_file.h). Rows written by
/// append() survive a crash of the process; after sync(), also of the machine.
/// Threads: one; sync() any other.
class SeedLedger {
 public:
  /// Creates the session's seeds.csv, or continues an existing one: reads its seeds, and truncates an unfinished last
  /// row. Throws UserError if it cannot be read or written, or is not a ledger: then it is as it was.
  explicit SeedLedger(const SessionFolder& folder);
  ~SeedLedger();
  SeedLedger(const SeedLedger&) = delete;
  SeedLedger& operator=(const SeedLedger&) = delete;

  const std::vector<Seed>& restored() const { return restored_; }
  bool had_partial_row() const { return had_partial_row_; }  ///< an unfinished row was truncated
  std::size_t count() const { return count_; }               ///< rows

  /// Writes those of `seeds`, the complete list, that the file does not have yet, with `offset_s` added to
  /// their times. Throws std::runtime_error with the file and the reason: no row is half written, and the
  /// next call retries.
  void append(std::span<const Seed> seeds, double offset_s = 0);
  void sync() const noexcept;

 private:
  std::string name_;
  std::vector<Seed> restored_;
  bool had_partial_row_ = false;
  OpenFile file_;
  std::int64_t size_ = 0;  // bytes of whole rows
  std::size_t count_ = 0;
};

}  // namespace brachy
