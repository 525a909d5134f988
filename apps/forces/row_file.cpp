#include "apps/forces/row_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "apps/forces/session_file.h"
#include "core/base/error.h"

namespace brachy {
namespace {

constexpr std::size_t kMostWaiting = std::size_t{1} << 20;  // bytes

}  // namespace

RowFile::RowFile(const std::filesystem::path& file, Start start, std::string_view header)
    : name_(file.string()) {
  const int how = O_WRONLY | O_CREAT | O_CLOEXEC | (start == Start::kAnew ? O_TRUNC : O_APPEND);
  file_ = start == Start::kSession ? open_session_file(file) : ::open(name_.c_str(), how, 0644);
  struct stat status {};
  if (file_ < 0 || ::fstat(file_, &status) != 0)
    throw UserError(name_ + ": cannot be created: " + std::strerror(errno) +
                    "; give a file in a directory that you can write to");
  if (S_ISREG(status.st_mode)) size_ = static_cast<std::uint64_t>(status.st_size);
  if (size_ == 0) (waiting_ = header) += '\n';
}

RowFile::~RowFile() {
  flush();
  ::close(file_);
}

void RowFile::add(std::string_view row) {
  if (failure_) return;
  ((waiting_ += row) += '\n');
  ++rows_;
  if (waiting_.size() >= kMostWaiting) flush();
}

void RowFile::flush() {
  std::size_t written = 0;
  while (written < waiting_.size() && !failure_) {
    const ssize_t bytes = ::write(file_, waiting_.data() + written, waiting_.size() - written);
    if (bytes > 0)
      written += static_cast<std::size_t>(bytes);
    else if (bytes == 0 || errno != EINTR)
      failure_ = bytes == 0 ? ENOSPC : errno;
  }
  if (failure_ && !waiting_.empty()) {
    const std::size_t row_end = waiting_.substr(0, written).find_last_of('\n');
    const std::size_t kept = row_end == waiting_.npos ? 0 : row_end + 1;
    const auto lost = static_cast<std::uint64_t>(
        std::count(waiting_.begin() + static_cast<std::ptrdiff_t>(kept), waiting_.end(), '\n'));
    rows_ -= std::min(rows_, lost);  // the header may be among them
    written = kept;
    // A pipe or a device cannot be truncated and need not be.
    [[maybe_unused]] const int is_cut = ::ftruncate(file_, static_cast<off_t>(size_ + kept));
  }
  size_ += written;
  waiting_.clear();
}

std::string RowFile::failure() const {
  if (!failure_) return {};
  return name_ + ": not all rows could be written: " + std::strerror(failure_) +
         "; the first ones are kept. Free some space and give another name";
}

}  // namespace brachy
