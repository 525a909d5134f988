#include "apps/doctor/doctor.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "apps/daemon/control/read_scene.h"
#include "apps/doctor/doctor_report.h"
#include "apps/doctor/work_scale.h"
#include "core/base/error.h"

namespace brachy {
namespace {

/// A temporary file, removed by the destructor.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) {
    std::string name = std::filesystem::temp_directory_path() / "brachyd-doctor-XXXXXX";
    const int descriptor = ::mkstemp(name.data());
    if (descriptor < 0) throw UserError(name + ": cannot be created; set TMPDIR to another directory");
    ::close(descriptor);
    path = name;
    if (!(std::ofstream(path) << text << std::flush))
      throw UserError(name + ": cannot be written; set TMPDIR to another directory");
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  std::filesystem::path path;
};

}  // namespace

int doctor(const DaemonOptions& options) {
  spdlog::set_level(spdlog::level::err);
  ::unsetenv("NOTIFY_SOCKET");  // the daemons on trial are not the service
  const double seconds = options.doctor_s.value();
  const Scene scene = read_scene(options);
  const TemporaryFile insertion(representative_insertion(scene, seconds));
  std::cerr << fmt::format("doctor: the machine's clock, {:g} s\n", seconds);
  Machine machine = measure_machine(scene, seconds);
  const Diagnosis diagnosis = diagnose(scene, [&](const Scene& tried) {
    std::cerr << fmt::format("doctor: {}, support {:g} mm, at {:g} Hz, {:g} s\n", tried.model.kernel,
                             tried.model.support_radius_mm, tried.rates.deformation_hz, seconds);
    return try_scene(tried, insertion.path, seconds);
  });
  // After the trials, which need a process of one thread: setting up a model starts others.
  std::cerr << "doctor: the costs of a tick's work\n";
  machine.work_scale = measure_work_scale(scene);
  std::cout << (options.json ? to_json(machine, scene, diagnosis) + "\n"
                             : to_text(machine, scene, diagnosis));
  return diagnosis.fit == std::size_t{0} ? kExitOk : kExitFailed;
}

}  // namespace brachy
