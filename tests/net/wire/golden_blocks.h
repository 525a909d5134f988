#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "net/wire/byte_io.h"
#include "test_paths.h"

namespace brachy::net::test {

/// The blocks of a document of the project fenced as ```hex NAME; comments start at '#'.
inline std::map<std::string, Bytes> golden_blocks(const std::string& document = "/net/PROTOCOL.md") {
  const std::filesystem::path path = BRACHY_SOURCE_DIR + document;
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::map<std::string, Bytes> blocks;
  std::string line, name;
  while (std::getline(file, line)) {
    if (line.starts_with("```")) {
      name = line.starts_with("```hex ") ? line.substr(7) : "";
    } else if (!name.empty()) {
      std::istringstream words(line.substr(0, line.find('#')));
      for (std::string word; words >> word;) {
        blocks[name].push_back(static_cast<std::byte>(std::stoi(word, nullptr, 16)));
      }
    }
  }
  return blocks;
}

}  // namespace brachy::net::test
