#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/compare/measure.h"
#include "apps/lab/slices/slice.h"

namespace brachy {

/// The plan of `brachy compare`: every model on every scene, scene after scene.
struct ComparePlan {
  bool quick = false;
  std::vector<std::string> scenes, models;

  /// Whether the slice has this row. Neighbours go to different slices, and so do a model's rows: costs are shared
  /// evenly.
  static bool has_row(const Slice& slice, std::size_t scene, std::size_t model) {
    return (scene + model) % static_cast<std::size_t>(slice.count) ==
           static_cast<std::size_t>(slice.index - 1);
  }
};

/// The file of a comparison's slice. `yardstick_ms`: a tick of kYardstick on this machine; none: it had no result.
std::string to_json(const ComparePlan& plan, const Slice& slice, std::optional<double> yardstick_ms,
                    const std::vector<CompareRow>& rows);
constexpr const char* kYardstick = "paper_csrbf_psi31_a12";  ///< on the plan's first scene

/// All rows, in the order of a run that was not sliced.
struct MergedComparison {
  std::vector<CompareRow> rows;
  std::string json;   ///< as to_json(rows, quick), and each row's slice, and each slice's yardstick_ms
  std::string times;  ///< a sentence: how far times of different slices can be compared
};

/// Reads the slices' files. Errors: UserError, as read_slice_files, and where rows are missing or damaged.
MergedComparison merge_comparison(const std::vector<std::filesystem::path>& files);

}  // namespace brachy
