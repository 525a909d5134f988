#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/command_line/tool.h"

namespace brachy {

// Options that several tools share.

/// How a tool reaches a daemon.
struct ConnectOptions {
  std::string host;
  std::uint16_t port = 0;
  std::optional<std::filesystem::path> token_file;  ///< none: no token is sent
  bool tls = false;                                 ///< TLS also without any of the files below
  std::filesystem::path tls_ca;                     ///< empty: the system's
  std::filesystem::path tls_certificate, tls_key;   ///< the tool's own; empty: none is sent
};

/// --connect, which is returned, --token-file and the options of TLS. `help`: of --connect.
Option add_connect_options(OptionList& list, ConnectOptions& connect, const std::string& help);

/// --units and --frame of a mesh file.
struct MeshFileFormat {
  std::string units = "mm", frame = "RAS";
};
void add_mesh_options(OptionList& list, MeshFileFormat& format);

/// Seconds that a run or a measurement takes: 0.001 to 10⁷.
Option as_duration(Option option);

/// A name that is written into files: 1 to 100 bytes on one line.
Option as_short_name(Option option);

/// Instruction sets of the field evaluation.
Option as_simd(Option option);

}  // namespace brachy
