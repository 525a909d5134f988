#pragma once

#include <gtest/gtest.h>

#include "tests/apps/apps_testing.h"
#include "tests/reference_files.h"

namespace brachy::test {

/// What a command that runs models on reference scenes reports.
struct ReferenceRun {
  nlohmann::json rows;
  std::string table;
};

/// `brachy ARGUMENTS… --json FILE`, which must succeed.
inline ReferenceRun run_on_references(std::vector<std::string> arguments) {
  const TempFolder folder;
  const std::filesystem::path file = folder / "rows.json";
  arguments.insert(arguments.end(), {"--json", file.string()});
  const Ended ended = run_brachy(arguments);
  EXPECT_TRUE(exited(ended, 0));
  return {nlohmann::json::parse(read_file(file)).at("rows"), ended.out};
}

}  // namespace brachy::test
