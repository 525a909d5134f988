#include "apps/session/seed_ledger.h"

#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "core/base/error.h"
#include "core/brachytherapy/seeds/seed_file.h"

namespace brachy {

SeedLedger::SeedLedger(const SessionFolder& folder) : name_(folder.path_of(kSeedsFile).string()) {
  if (const std::optional<std::string> text = folder.read(kSeedsFile)) {
    const std::string_view whole = whole_lines(*text);
    had_partial_row_ = whole.size() < text->size();
    if (!whole.empty() && whole.find_first_not_of(" \t\r\n") != whole.npos)
      restored_ = parse_seeds(whole, name_);
  }
  file_ = folder.append_to(kSeedsFile);
  // An earlier version locks nothing but this file.
  if (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0)
    throw UserError(name_ + ": another process records into it; end that process or give another directory");
  size_ = ::lseek(file_.get(), 0, SEEK_END);
  count_ = restored_.size();
  if (size_ > 0) return;
  std::string header(kSeedHeader);
  header += '\n';
  if (::write(file_.get(), header.data(), header.size()) != static_cast<ssize_t>(header.size()))
    throw UserError(name_ + ": cannot be written: " + std::strerror(errno) +
                    "; free some space or give another directory");
  size_ = static_cast<std::int64_t>(header.size());
}

SeedLedger::~SeedLedger() {
  sync();
}

void SeedLedger::append(std::span<const Seed> seeds, double offset_s) {
  for (; count_ < seeds.size(); ++count_) {
    Seed seed = seeds[count_];
    seed.t_s += offset_s;
    const std::string row = seed_row(seed) + "\n";
    const auto bytes = static_cast<ssize_t>(row.size());
    errno = 0;
    if (::write(file_.get(), row.data(), row.size()) != bytes) {
      const int reason = errno ? errno : ENOSPC;
      if (::ftruncate(file_.get(), size_) != 0) throw std::runtime_error(name_ + ": a row is incomplete");
      throw std::runtime_error(name_ + ": seed " + std::to_string(seed.id) +
                               " could not be written: " + std::strerror(reason));
    }
    size_ += bytes;
  }
}

void SeedLedger::sync() const noexcept {
  ::fdatasync(file_.get());
}

}  // namespace brachy
