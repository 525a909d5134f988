#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/seeds/seed.h"

namespace brachy {

/// The ledger of the seeds that fell, a file that is only ever added to (core/seeds/seed_file.h). What append() has written
/// survives the process, what sync() has seen also the machine.
/// Threads: one; sync() any other.
class SeedLedger {
 public:
  /// Makes the file, or goes on with the one that is there: reads its seeds, and cuts off a last row that has no end.
  /// Throws UserError where it cannot be read or written, or is no ledger.
  explicit SeedLedger(const std::filesystem::path& file);
  ~SeedLedger();
  SeedLedger(const SeedLedger&) = delete;
  SeedLedger& operator=(const SeedLedger&) = delete;

  const std::vector<Seed>& restored() const { return restored_; }
  bool was_torn() const { return was_torn_; }   ///< a row without its end was cut off
  std::size_t count() const { return count_; }  ///< rows

  /// Writes those of `seeds`, all there are, that it has not yet; their times, of this run, are put `offset_s` later.
  /// Throws std::runtime_error, naming the file and the reason: nothing is half written, and the next call tries again.
  void append(std::span<const Seed> seeds, double offset_s = 0);
  void sync() const noexcept;

 private:
  std::string name_;
  int file_ = -1;
  std::int64_t size_ = 0;  // bytes of whole rows
  std::vector<Seed> restored_;
  bool was_torn_ = false;
  std::size_t count_ = 0;
};

}  // namespace brachy
