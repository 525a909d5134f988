#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/lab/comparators/compared_model.h"

namespace brachy {

/// One folder of tests/reference: a model's input, and the finite-element solution (tests/reference/README.md).
struct ReferenceScene {
  std::string name;                 ///< of the folder
  std::string group;                ///< homogeneous, stiff (both held all round), free_face, or neo_hookean
  ComparedScene given;              ///< points: field, targets, then filler of the gland up to 14,560 in all
  std::vector<Vec3> displacements;  ///< of the landmarks, mm
  std::vector<Vec3> field;          ///< u at the first points, mm
  std::vector<Vec3> targets;        ///< u at the points after those, mm

  /// Whether the scene counts in means: the neo-Hookean one shows where linearity ends.
  bool counts() const { return group != "neo_hookean"; }
};

/// Reads a folder. Errors: UserError names the file.
ReferenceScene load_reference_scene(const std::filesystem::path& folder);

/// Adds points, evenly spread over the first region (the box where there is none), until there are 14,560: what a tick
/// moves.
void fill_gland(const ElasticBody& body, std::vector<Vec3>& points);

/// The folders of `references` that hold a scene.toml, by name. UserError where there is none.
std::vector<std::filesystem::path> find_reference_scenes(const std::filesystem::path& references);

/// Where the reference scenes are: beside the installed program, else in the sources it was built from.
std::filesystem::path default_references();

}  // namespace brachy
