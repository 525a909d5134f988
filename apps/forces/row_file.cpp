#include "apps/forces/row_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr std::size_t kMostWaiting = std::size_t{1} << 20;  // bytes

OpenFile open_rows(const std::filesystem::path& file, RowFile::Start start) {
  std::error_code ignored;
  const bool is_device =
      std::filesystem::is_character_file(file, ignored) || std::filesystem::is_fifo(file, ignored);
  const int how = start == RowFile::Start::kAnew   ? O_TRUNC
                  : start == RowFile::Start::kGoOn ? O_APPEND
                  : is_device                      ? 0
                                                   : O_EXCL;
  OpenFile opened(::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0644));
  if (opened.is_open()) return opened;
  if (errno == EEXIST) throw UserError(file.string() + ": exists already; give another name");
  throw UserError(file.string() + ": cannot be created: " + std::strerror(errno) +
                  "; give a file in a directory that you can write to");
}

}  // namespace

RowFile::RowFile(const std::filesystem::path& file, Start start, std::string_view header)
    : RowFile(open_rows(file, start), file.string(), header) {}

RowFile::RowFile(OpenFile file, std::string name, std::string_view header)
    : name_(std::move(name)), file_(std::move(file)) {
  struct stat status {};
  if (::fstat(file_.get(), &status) == 0 && S_ISREG(status.st_mode))
    size_ = static_cast<std::uint64_t>(status.st_size);
  if (size_ == 0) (waiting_ = header) += '\n';
}

RowFile::~RowFile() {
  flush();
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
    const ssize_t bytes = ::write(file_.get(), waiting_.data() + written, waiting_.size() - written);
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
    [[maybe_unused]] const int is_cut = ::ftruncate(file_.get(), static_cast<off_t>(size_ + kept));
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
