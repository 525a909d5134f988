#include "apps/bench/report.h"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/base/error.h"

namespace brachy::bench {

const Row* Report::find(std::string_view name, std::size_t points, std::size_t landmarks, int threads,
                        bool moving, std::string_view kernel, double support_mm) const {
  for (const Row& row : rows)
    if (row.name == name && row.points == points && row.landmarks == landmarks && row.threads == threads &&
        row.moving == moving && row.kernel == kernel && row.support_mm == support_mm)
      return &row;
  return nullptr;
}

void Report::write_json(const std::string& path) const {
  using OrderedJson = nlohmann::ordered_json;
  OrderedJson json{{"simd", simd_target}, {"machine", machine}, {"others_load", others_load},
                   {"limits", limits},    {"memory", memory},   {"rows", OrderedJson::array()}};
  for (const Row& row : rows) {
    OrderedJson entry{{"case", row.name},
                      {"kernel", row.kernel},
                      {"points", row.points},
                      {"landmarks", row.landmarks},
                      {"support_mm", row.support_mm},
                      {"threads", row.threads},
                      {"moving", row.moving},
                      {"ms", row.ms},
                      {"baseline_ms", row.baseline_ms},
                      {"ratio", row.ratio()}};
    for (const auto& [key, value] : row.more) entry[key] = value;
    json["rows"].push_back(std::move(entry));
  }
  json["goals"] = OrderedJson::array();
  for (const Goal& goal : goals(*this))
    json["goals"].push_back({{"work", goal.work},
                             {"figure", goal.figure},
                             {"measured", goal.measured},
                             {goal.at_least ? "at_least" : "at_most", goal.target},
                             {"met", goal.is_met()}});
  std::ofstream file(path);
  file << json.dump(1) << "\n";
  if (!file.flush()) throw UserError(path + ": cannot be written");
}

void print_goals(const Report& report) {
  std::printf("\n%s, simd %s; others used %.0f %% of it meanwhile%s\n", report.machine.c_str(),
              report.simd_target.c_str(), 100 * report.others_load,
              report.others_load > 0.05 ? ": repeat this on a quiet machine" : "");
  std::printf("%-66s %-24s %9s  %-9s %s\n", "work (psi31, a = 12 mm, unless said)", "figure", "measured",
              "target", "met");
  for (const Goal& goal : goals(report))
    std::printf("%-66s %-24s %9.3g  %s %-6g %s\n", goal.work.c_str(), goal.figure.c_str(), goal.measured,
                goal.at_least ? ">=" : "<=", goal.target, goal.is_met() ? "yes" : "NO");
}

}  // namespace brachy::bench
