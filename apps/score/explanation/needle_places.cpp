#include "apps/score/explanation/needle_places.h"

namespace brachy {
namespace {

constexpr double kAgreeMm = 2.5;  // seeds of a train that lies as it was loaded

std::vector<std::size_t> chosen(const std::vector<std::size_t>& from,
                                const std::vector<std::size_t>& members) {
  std::vector<std::size_t> all;
  for (const std::size_t m : members) all.push_back(from[m]);
  return all;
}

}  // namespace

std::vector<NeedlePlace> needle_places(const Deviations& deviations, const std::vector<Vec3>& rest) {
  std::vector<NeedlePlace> places;
  for (std::size_t i = 0; i < deviations.seeds.size(); ++i) {
    const SeedDeviation& seed = deviations.seeds[i];
    if (places.empty() || places.back().needle != seed.needle) {
      NeedlePlace& place = places.emplace_back();
      place.needle = seed.needle;
      place.at = seed.planned.head<2>();
    }
    places.back().seeds.push_back(i);
  }
  for (NeedlePlace& place : places) {
    std::vector<Vec2> across;
    std::vector<double> along;
    for (const std::size_t i : place.seeds) {
      across.emplace_back(rest[i].head<2>());
      along.push_back(rest[i].z());
    }
    const auto in_plane = largest_cluster<Vec2>(across, kAgreeMm);
    const auto in_depth = largest_cluster<double>(along, kAgreeMm);
    place.across = in_plane.mean;
    place.along = in_depth.mean;
    place.follow_across = chosen(place.seeds, in_plane.members);
    place.follow_along = chosen(place.seeds, in_depth.members);
  }
  return places;
}

}  // namespace brachy
