#include "apps/session/seed_ledger.h"

#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "apps/forces/session_file.h"
#include "apps/session/whole_lines.h"
#include "core/base/error.h"
#include "core/brachytherapy/seeds/seed_file.h"

namespace brachy {

SeedLedger::SeedLedger(const std::filesystem::path& file) : name_(file.string()) {
  if (std::filesystem::is_regular_file(file)) {  // anything else is refused below
    had_partial_row_ = truncate_partial_line(file);
    if (std::filesystem::file_size(file) > 0) restored_ = load_seeds(file);
  }
  file_ = open_session_file(file);
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0)
    throw UserError(name_ + ": another process records into it; end that process or give another directory");
  size_ = static_cast<std::int64_t>(std::filesystem::file_size(file));
  count_ = restored_.size();
  if (size_ > 0) return;
  std::string header(kSeedHeader);
  header += '\n';
  if (::write(file_, header.data(), header.size()) != static_cast<ssize_t>(header.size()))
    throw UserError(name_ + ": cannot be written: " + std::strerror(errno) +
                    "; free some space or give another directory");
  size_ = static_cast<std::int64_t>(header.size());
}

SeedLedger::~SeedLedger() {
  sync();
  ::close(file_);
}

void SeedLedger::append(std::span<const Seed> seeds, double offset_s) {
  for (; count_ < seeds.size(); ++count_) {
    Seed seed = seeds[count_];
    seed.t_s += offset_s;
    const std::string row = seed_row(seed) + "\n";
    const auto bytes = static_cast<ssize_t>(row.size());
    errno = 0;
    if (::write(file_, row.data(), row.size()) != bytes) {
      const int reason = errno ? errno : ENOSPC;
      if (::ftruncate(file_, size_) != 0) throw std::runtime_error(name_ + ": a row is incomplete");
      throw std::runtime_error(name_ + ": seed " + std::to_string(seed.id) +
                               " could not be written: " + std::strerror(reason));
    }
    size_ += bytes;
  }
}

void SeedLedger::sync() const noexcept {
  ::fdatasync(file_);
}

}  // namespace brachy
