#include "apps/brachy/offline/cbc.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/base/error.h"
#include "core/base/number_text.h"

extern char** environ;

namespace brachy {
namespace {

/// A directory that is removed again.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "brachy-cbc-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw UserError("cannot make a directory in " + name + "; set TMPDIR");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string operator/(const char* file) const { return (path_ / file).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace

std::string solve_with_cbc(const std::string& programme, double seconds) {
  const ScratchFolder folder;
  const std::string model = folder / "plan.lp", solution = folder / "solution.txt", limit = text_of(seconds);
  std::ofstream(model) << programme;
  const std::array<const char*, 11> arguments = {
      "cbc",    model.c_str(), "-timeMode",      "elapsed", "-seconds", limit.c_str(),
      "-solve", "-solution",   solution.c_str(), nullptr,   nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed =
      ::posix_spawnp(&child, "cbc", &actions, nullptr, const_cast<char* const*>(arguments.data()), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw UserError("--method integer needs the program cbc; install coinor-cbc");
  int status = 0;
  ::waitpid(child, &status, 0);
  std::ostringstream text;
  std::ifstream in(solution);
  text << in.rdbuf();
  if (!in || text.str().empty())
    throw UserError("cbc found no plan in " + limit + " s; give it more with --seconds");
  return text.str();
}

}  // namespace brachy
