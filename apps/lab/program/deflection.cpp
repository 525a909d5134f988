#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "apps/command_line/options.h"
#include "apps/lab/deflection/deflection_fit.h"
#include "apps/lab/program/report_files.h"
#include "apps/lab/program/study.h"

namespace brachy {
namespace {

constexpr std::size_t kModuli = 40;
constexpr double kLeastModulus = 0.001, kMostModulus = 0.2;  // N/mm²

std::vector<double> moduli_grid() {
  std::vector<double> moduli;
  for (std::size_t i = 0; i < kModuli; ++i)
    moduli.push_back(kLeastModulus *
                     std::pow(kMostModulus / kLeastModulus, static_cast<double>(i) / (kModuli - 1)));
  return moduli;
}

std::string errors_row(const char* model, double calibrate_mm, const PredictionErrors& e) {
  return fmt::format("| {} | {:g} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {} of {} |\n", model, calibrate_mm,
                     e.end_mean_mm, e.end_max_mm, e.rms_mean_mm, e.rms_max_mm, e.passed_splits, e.splits);
}

nlohmann::json errors_json(const char* model, double calibrate_mm, const PredictionErrors& e) {
  return {{"model", model},
          {"calibrate_mm", calibrate_mm},
          {"predicted", e.predicted},
          {"end_mean_mm", e.end_mean_mm},
          {"end_max_mm", e.end_max_mm},
          {"rms_mean_mm", e.rms_mean_mm},
          {"rms_max_mm", e.rms_max_mm},
          {"splits", e.splits},
          {"passed_splits", e.passed_splits}};
}

}  // namespace

int deflection(const DeflectionOptions& options) {
  std::string text = fmt::format(
      "Fitted on three insertions, the others predicted; each told its own poses up to the depth that is "
      "given, from\nwhich its entry angle and origin follow. A choice of three passes if every other ends "
      "within "
      "{:g} mm and\nis within {:g} mm rms. EI {:g} N·mm², needle {:g} mm.\n",
      DeflectionStudy::kEndMm, DeflectionStudy::kRmsMm, options.bending_stiffness_nmm2,
      options.needle_length_mm);
  nlohmann::json all = nlohmann::json::array();
  bool passes = true;
  for (const std::filesystem::path& file : options.files) {
    NeedlePathSettings needle;
    needle.bending_stiffness_nmm2 = options.bending_stiffness_nmm2;
    needle.needle_length_mm = options.needle_length_mm;
    const DeflectionStudy study(load_insertions(file), needle, {}, moduli_grid());
    std::vector<std::size_t> every(study.insertions());
    std::iota(every.begin(), every.end(), 0u);
    const DeflectionFit fit = study.fit(every);
    const auto [least, most] = study.interval(every);
    const bool is_open = least == 0 || most + 1 == study.moduli().size();
    const double degrees = 180 / std::numbers::pi;
    text += fmt::format(
        "\n{}: all {} insertions: μ {:.4f} N/mm² ({:.4f} … {:.4f}{}), bevel's force {:.3f}, {:.3f} N (x, "
        "z), entry angle\n{:.2f}°, {:.2f}°.\n\n| model | told, mm | end, mean | end, max | rms, mean | rms, "
        "max | "
        "choices that pass |\n|---|---|---|---|---|---|---|\n",
        file.filename().string(), study.insertions(), study.moduli()[fit.modulus], study.moduli()[least],
        study.moduli()[most], is_open ? ", not determined: at the end of the grid" : "", fit.force_n[0],
        fit.force_n[1], fit.angle_rad[0] * degrees, fit.angle_rad[1] * degrees);
    nlohmann::json rows = nlohmann::json::array();
    std::vector<double> depths = {0, 25};
    depths.push_back(options.calibrate_mm);
    for (const double depth : depths) {
      const PredictionErrors bent = study.predict(depth), straight = study.predict(depth, true);
      text += errors_row("needle", depth, bent) + errors_row("straight line", depth, straight);
      rows.push_back(errors_json("needle", depth, bent));
      rows.push_back(errors_json("straight line", depth, straight));
      if (depth == options.calibrate_mm) passes &= bent.passed_splits == bent.splits;
    }
    all.push_back({{"file", file.string()},
                   {"insertions", study.insertions()},
                   {"shear_modulus", study.moduli()[fit.modulus]},
                   {"shear_modulus_interval", {study.moduli()[least], study.moduli()[most]}},
                   {"is_determined", !is_open},
                   {"bevel_force_n", fit.force_n},
                   {"entry_angle_rad", fit.angle_rad},
                   {"errors", rows}});
  }
  text += fmt::format("\nTold {:g} mm: {}.\n", options.calibrate_mm,
                      passes ? "every choice passes" : "NOT every choice passes");
  write_report(options.json, all.dump(1) + "\n", options.markdown, text);
  return passes ? kExitOk : kExitFailed;
}

}  // namespace brachy
