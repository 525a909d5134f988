#include "apps/lab/compare/compare_beads.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <Eigen/QR>
#include <fstream>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/command_line/options.h"
#include "apps/lab/compare/bead_model.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"

namespace brachy {
namespace {

std::vector<Vec3> picked(const std::vector<Vec3>& all, const std::vector<std::size_t>& which) {
  std::vector<Vec3> some;
  some.reserve(which.size());
  for (const std::size_t i : which) some.push_back(all[i]);
  return some;
}

BeadRow scored(std::string model, const std::vector<Vec3>& u, const Beads& beads, const Beads::Load& load) {
  BeadRow row{std::move(model), load.number, 0, 0, {}};
  for (std::size_t k = 0; k < u.size(); ++k) {
    const double off = (u[k] - load.displacements[beads.interior[k]]).norm();
    row.rms_mm += off * off / static_cast<double>(u.size());
    row.max_mm = std::max(row.max_mm, off);
  }
  row.rms_mm = std::sqrt(row.rms_mm);
  return row;
}

Eigen::MatrixXd affine_basis(const std::vector<Vec3>& points) {
  Eigen::MatrixXd B(static_cast<Eigen::Index>(points.size()), 4);
  for (std::size_t i = 0; i < points.size(); ++i)
    B.row(static_cast<Eigen::Index>(i)) << 1, points[i].transpose();
  return B;
}

void score_affine(const Beads& beads, std::vector<BeadRow>& rows) {
  const Eigen::MatrixXd B = affine_basis(picked(beads.rest, beads.boundary)),
                        X = affine_basis(picked(beads.rest, beads.interior));
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(B);
  for (const Beads::Load& load : beads.loads) {
    const std::vector<Vec3> d = picked(load.displacements, beads.boundary);
    Eigen::MatrixXd D(static_cast<Eigen::Index>(d.size()), 3);
    for (std::size_t i = 0; i < d.size(); ++i) D.row(static_cast<Eigen::Index>(i)) = d[i].transpose();
    const Eigen::MatrixXd U = X * qr.solve(D);
    std::vector<Vec3> u;
    for (Eigen::Index i = 0; i < U.rows(); ++i) u.push_back(U.row(i).transpose());
    rows.push_back(scored("affine", u, beads, load));
  }
}

struct ScoredSmoothing {
  double error = std::numeric_limits<double>::infinity();  // leave-one-out, mm
  const BeadKernel* kernel = nullptr;
  BeadModel::Smoothing smoothing;
};

// λ in half decades from 1e-7 to 1.
ScoredSmoothing best_smoothing(const BeadKernel& kernel, const std::vector<Vec3>& P,
                               const std::vector<Vec3>& d) {
  const BeadModel model(kernel, P);
  ScoredSmoothing best;
  for (const bool affine : {false, true})
    for (int step = -14; step <= 0; ++step) {
      const BeadModel::Smoothing smoothing{std::pow(10.0, 0.5 * step), affine};
      const double error = model.leave_one_out(d, smoothing);
      if (error < best.error) best = {error, &kernel, smoothing};
    }
  return best;
}

void write_json(const std::filesystem::path& file, const std::vector<BeadRow>& rows) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const BeadRow& row : rows) {
    nlohmann::ordered_json parameters = nlohmann::ordered_json::object();
    for (const auto& [name, value] : row.parameters) parameters[name] = value;
    list.push_back({{"model", row.model},
                    {"load", row.load},
                    {"rms_mm", row.rms_mm},
                    {"max_mm", row.max_mm},
                    {"parameters", parameters}});
  }
  std::ofstream out(file, std::ios::binary);
  out << nlohmann::ordered_json{{"rows", list}}.dump(1) << "\n";
  out.close();
  if (!out) throw UserError(file.string() + ": cannot be written; check the folder and the free space");
}

}  // namespace

std::vector<BeadRow> compare_beads(const Beads& beads, Progress* progress) {
  const std::vector<Vec3> P = picked(beads.rest, beads.boundary), X = picked(beads.rest, beads.interior);
  const std::vector<Vec3> first = picked(beads.loads[0].displacements, beads.boundary);
  Vec3 least = P[0], most = P[0];
  for (const Vec3& p : P) {
    least = least.cwiseMin(p);
    most = most.cwiseMax(p);
  }
  const std::vector<BeadKernel> kernels = bead_kernels((most - least).maxCoeff());

  std::vector<BeadRow> rows;
  score_affine(beads, rows);
  for (auto at = kernels.begin(); at != kernels.end();) {
    ScoredSmoothing best;
    for (const std::string model_name = at->model; at != kernels.end() && at->model == model_name; ++at) {
      const auto done = static_cast<std::size_t>(at - kernels.begin());
      if (progress) progress->show_step(done, kernels.size(), model_name);
      if (const ScoredSmoothing found = best_smoothing(*at, P, first); found.error < best.error) best = found;
    }
    if (!best.kernel) continue;  // none of them could be fitted
    const BeadModel model(*best.kernel, P);
    auto parameters = best.kernel->parameters;
    parameters.emplace_back("smoothing", best.smoothing.lambda);
    parameters.emplace_back("affine", best.smoothing.affine);
    parameters.emplace_back("leave_one_out_mm", best.error);
    for (const Beads::Load& load : beads.loads) {
      const auto u = model.evaluate(X, picked(load.displacements, beads.boundary), best.smoothing);
      rows.push_back(scored(best.kernel->model, u, beads, load));
      rows.back().parameters = parameters;
    }
  }
  return rows;
}

int compare_beads(const std::filesystem::path& file, const std::optional<std::filesystem::path>& json,
                  std::ostream& out) {
  const Beads beads = load_beads(file);
  Progress progress("compare");
  const std::vector<BeadRow> rows = compare_beads(beads, &progress);
  progress.finish();
  if (json) write_json(*json, rows);
  out << fmt::format(
      "{}: {} boundary beads predict {} interior ones; parameters chosen on the boundary of load {}\n",
      file.string(), beads.boundary.size(), beads.interior.size(), beads.loads[0].number);
  out << fmt::format("{:<16}", "model");
  for (const Beads::Load& load : beads.loads)
    out << fmt::format("{:>14}{:>14}", fmt::format("rms {} (mm)", load.number),
                       fmt::format("max {} (mm)", load.number));
  out << "  parameters\n";
  for (std::size_t i = 0; i < rows.size(); i += beads.loads.size()) {
    out << fmt::format("{:<16}", rows[i].model);
    for (std::size_t k = 0; k < beads.loads.size(); ++k)
      out << fmt::format("{:>14.3f}{:>14.3f}", rows[i + k].rms_mm, rows[i + k].max_mm);
    out << " ";
    for (const auto& [name, value] : rows[i].parameters) out << fmt::format(" {}={:.3g}", name, value);
    out << "\n";
  }
  return kExitOk;
}

}  // namespace brachy
