#include "apps/forces/force_log.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "core/error.h"

namespace brachy {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

}  // namespace

ForceSample force_sample(double t_s, std::uint32_t needle, const NeedleState& state, double min_det) {
  ForceSample sample{t_s,    needle, state.contact, state.tip_depth_mm, state.forces, state.landmark_count,
                     min_det};
  sample.forces.tip_torque_nmm = sample.forces.hub_torque_nmm = Vec3::Zero();
  return sample;
}

ForceLogWriter::ForceLogWriter(const std::filesystem::path& file, Start start) : name_(file.string()) {
  std::error_code none;
  const bool goes_on = start == Start::kGoOn && std::filesystem::file_size(file, none) > 0 && !none;
  file_.reset(std::fopen(name_.c_str(), goes_on ? "a" : "w"));
  if (!file_)
    throw UserError(name_ + ": cannot be made: " + std::strerror(errno) +
                    "; give a file in a folder of yours");
  std::setvbuf(file_.get(), nullptr, _IOFBF, kBufferBytes);
  if (goes_on) return;
  check(std::fprintf(file_.get(), "%.*s\n", static_cast<int>(kForceLogHeader.size()),
                     kForceLogHeader.data()) > 0);
}

void ForceLogWriter::add(const ForceSample& sample) {
  if (failure_) return;
  const std::string row = force_row(sample) + '\n';
  check(std::fwrite(row.data(), 1, row.size(), file_.get()) == row.size());
  rows_ += !failure_;
}

void ForceLogWriter::flush() {
  if (!failure_) check(std::fflush(file_.get()) == 0);
}

void ForceLogWriter::close() {
  flush();
  if (file_) {
    const bool closed = std::fclose(file_.release()) == 0;
    if (!failure_) check(closed);
  }
  if (failure_)
    throw std::runtime_error(name_ + ": not all rows could be written: " + std::strerror(failure_) +
                             "; the first ones stay. Make room and run again with another name");
}

void ForceLogWriter::check(bool written) {
  if (!written && !failure_) failure_ = errno ? errno : EIO;
}

}  // namespace brachy
