#include "apps/session/volume_study_file.h"

#include <unistd.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/base/error.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson to_json(const std::vector<PlaneEdge>& edges) {
  OrderedJson list = OrderedJson::array();
  for (const auto& [a, b] : edges) list.push_back({a.x(), a.y(), b.x(), b.y()});
  return list;
}

std::vector<PlaneEdge> edges_of(const OrderedJson& list) {
  std::vector<PlaneEdge> edges;
  for (const OrderedJson& e : list)
    edges.push_back({Vec2(e.at(0).get<double>(), e.at(1).get<double>()),
                     Vec2(e.at(2).get<double>(), e.at(3).get<double>())});
  return edges;
}

OrderedJson pose_json(const RigidTransform& X) {
  OrderedJson rows = OrderedJson::array();
  for (Eigen::Index r = 0; r < 3; ++r) rows.push_back({X.R(r, 0), X.R(r, 1), X.R(r, 2), X.p[r]});
  return rows;
}

RigidTransform pose_of(const OrderedJson& rows) {
  RigidTransform X;
  for (Eigen::Index r = 0; r < 3; ++r) {
    const OrderedJson& row = rows.at(static_cast<std::size_t>(r));
    for (Eigen::Index c = 0; c < 3; ++c) X.R(r, c) = row.at(static_cast<std::size_t>(c)).get<double>();
    X.p[r] = row.at(3).get<double>();
  }
  return X;
}

RecordedStudy study_of(const OrderedJson& json) {
  RecordedStudy recorded;
  recorded.t_s = json.at("t_s").get<double>();
  ContourStudy& study = recorded.study;
  study.step_mm = json.at("step_mm").get<double>();
  study.gland_cm3 = json.at("gland_cm3").get<double>();
  study.X_WS = pose_of(json.at("X_WS"));
  for (const OrderedJson& p : json.at("planes")) {
    StudyPlane& plane = study.planes.emplace_back();
    if (!p.at("slice").is_null()) plane.slice = p.at("slice").get<long long>();
    plane.offset_mm = p.at("offset_mm").get<double>();
    plane.outlined = edges_of(p.at("outlined"));
    plane.truth = edges_of(p.at("truth"));
    RecordedStudy::Source& source = recorded.sources.emplace_back();
    source.tick = p.at("tick").get<std::uint64_t>();
    if (const OrderedJson& depth = p.at("probe_depth_mm"); !depth.is_null())
      source.probe_depth_mm = depth.get<double>();
  }
  return recorded;
}

}  // namespace

std::string study_line(const RecordedStudy& recorded) {
  const ContourStudy& study = recorded.study;
  OrderedJson planes = OrderedJson::array();
  for (std::size_t i = 0; i < study.planes.size(); ++i) {
    const StudyPlane& plane = study.planes[i];
    const RecordedStudy::Source& source = recorded.sources.at(i);
    planes.push_back(
        {{"slice", plane.slice ? OrderedJson(*plane.slice) : OrderedJson()},
         {"offset_mm", plane.offset_mm},
         {"tick", source.tick},
         {"probe_depth_mm",
          std::isfinite(source.probe_depth_mm) ? OrderedJson(source.probe_depth_mm) : OrderedJson()},
         {"outlined", to_json(plane.outlined)},
         {"truth", to_json(plane.truth)}});
  }
  return OrderedJson{{"t_s", recorded.t_s},
                     {"step_mm", study.step_mm},
                     {"gland_cm3", study.gland_cm3},
                     {"X_WS", pose_json(study.X_WS)},
                     {"planes", planes}}
             .dump() +
         "\n";
}

std::vector<RecordedStudy> parse_studies(std::string_view text, const std::string& name) {
  std::vector<RecordedStudy> studies;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::string_view row = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), row.size() + 1));
    try {
      studies.push_back(study_of(OrderedJson::parse(row)));
    } catch (const nlohmann::json::exception&) {
      throw UserError(name + ":" + std::to_string(line) +
                      ": is no volume study; remove the line, brachyd did not write it");
    }
  }
  return studies;
}

void append_study(const SessionFolder& folder, const RecordedStudy& study) {
  const OpenFile file = folder.append_to(kStudiesFile);
  const std::string line = study_line(study);
  // A line that is not whole is cut off by the next study.
  if (::write(file.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size())) return;
  throw std::runtime_error(folder.path_of(kStudiesFile).string() +
                           ": a volume study could not be written; free some space");
}

}  // namespace brachy
