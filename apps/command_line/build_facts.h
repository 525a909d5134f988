#pragma once

#include <span>

namespace brachy {

/// A library that the programs were built with, by the version that CMake found.
struct BuiltWith {
  const char *name, *version;
};

/// How the programs were built; apps/command_line/build_facts.cpp.in is filled in by CMake.
struct BuildFacts {
  const char *build_type, *compiler;
  const char* flags;  ///< of the compiler, without warnings
  bool has_openmp, has_nats;
  std::span<const BuiltWith> libraries;
};
BuildFacts build_facts();

}  // namespace brachy
