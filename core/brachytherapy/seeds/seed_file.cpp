#include "core/brachytherapy/seeds/seed_file.h"

#include <array>
#include <cmath>
#include <limits>

#include "core/base/number_csv.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

constexpr std::size_t kColumns = 23;
constexpr std::size_t kMaxSeeds = 100'000;
constexpr int kFixed = 2;  // in the column `certified`
constexpr double kUnitTolerance = 1e-6;

/// Reads a row's numbers one by one and refuses invalid ones.
class Row {
 public:
  Row(std::span<const double> cells, const std::string& name, std::size_t line)
      : cells_(cells), name_(name), line_(line) {}

  double number() { return cells_[next_++]; }
  Vec3 vector() {
    const Vec3 v(cells_[next_], cells_[next_ + 1], cells_[next_ + 2]);
    next_ += 3;
    return v;
  }
  Vec3 axis(const char* what) {
    const Vec3 v = vector();
    if (std::abs(v.norm() - 1) > kUnitTolerance) refuse(std::string(what) + " is not a unit vector");
    return v;
  }
  template <class Integer>
  Integer whole(const char* what, double least, double most) {
    const double v = number();
    if (v != std::floor(v) || v < least || v > most)
      refuse(std::string(what) + " is " + std::to_string(v) + ", which is not valid");
    return static_cast<Integer>(v);
  }
  [[noreturn]] void refuse(const std::string& what) const {
    refuse_line(name_, line_, what + "; was the ledger edited?");
  }

 private:
  std::span<const double> cells_;
  std::size_t next_ = 0;
  const std::string& name_;
  std::size_t line_;
};

Seed read_seed(Row row, std::size_t expected_id) {
  Seed seed;
  seed.id = row.whole<std::uint32_t>("seed", 0, kMaxSeeds);
  if (seed.id != expected_id)
    row.refuse("seed is " + std::to_string(seed.id) + ", expected " + std::to_string(expected_id));
  seed.tick = row.whole<std::uint64_t>("tick", 0, 9e15);
  seed.t_s = row.number();
  seed.needle = row.whole<std::uint16_t>("needle", 0, 65535);
  seed.planned = row.whole<std::int32_t>("planned", -1, kMaxSeeds);
  const int certified = row.whole<int>("certified", 0, kFixed);
  seed.is_certified = certified == 1;
  seed.is_fixed = certified == kFixed;
  const auto source = find_seed_source(std::to_string(row.whole<int>("source", 0, 1e9)));
  if (!source) row.refuse("source is the number of none of " + source_names());
  seed.source = *source;
  seed.air_kerma_strength_u = row.number();
  if (!(seed.air_kerma_strength_u > 0)) row.refuse("strength_u is not positive");
  seed.dropped = row.vector();
  seed.dropped_axis = row.axis("ax,ay,az");
  seed.rest = row.vector();
  seed.rest_axis = row.axis("rest_ax,rest_ay,rest_az");
  seed.gland_motion = row.vector();
  seed.position = seed.rest;
  seed.axis = seed.rest_axis;
  return seed;
}

NumberCsvLimits limits() {
  NumberCsvLimits limits;
  limits.max_rows = kMaxSeeds;
  limits.may_be_empty = true;
  return limits;
}

std::vector<Seed> seeds_of(const NumberTable& table, const std::string& name) {
  std::vector<Seed> seeds;
  for (std::size_t i = 0; i < table.rows(); ++i)
    seeds.push_back(read_seed(Row(table.row(i), name, table.lines[i]), i + 1));
  return seeds;
}

}  // namespace

std::string seed_row(const Seed& seed) {
  std::array<double, kColumns> row;
  std::size_t next = 0;
  const auto add = [&](double v) { row[next++] = v; };
  const auto add_all = [&](const Vec3& v) {
    for (int k = 0; k < 3; ++k) add(v[k]);
  };
  add(seed.id);
  add(static_cast<double>(seed.tick));
  add(seed.t_s);
  add(seed.needle);
  add(seed.planned);
  add(seed.is_fixed ? kFixed : seed.is_certified ? 1 : 0);
  add(tg43_source(seed.source).number);
  add(seed.air_kerma_strength_u);
  for (const Vec3& v : {seed.dropped, seed.dropped_axis, seed.rest, seed.rest_axis, seed.gland_motion})
    add_all(v);
  std::string text;
  append_csv_row(text, row);
  return text;
}

std::vector<Seed> parse_seeds(std::string_view text, const std::string& name) {
  return seeds_of(parse_number_csv(text, name, kSeedHeader, limits()), name);
}

std::vector<Seed> load_seeds(const std::filesystem::path& file) {
  return seeds_of(load_number_csv(file, kSeedHeader, limits()), file.string());
}

std::vector<Seed> load_seeds_in_place(const std::filesystem::path& file) {
  const std::string name = file.string();
  const std::string text = load_csv_text(file, kDoseSeedHeader, NumberCsvLimits{}.max_bytes);
  if (csv_header(text) == kSeedHeader) return parse_seeds(text, name);
  return seeds_at_start(parse_dose_seeds(text, name));
}

std::vector<Seed> seeds_at_start(std::span<const DoseSeed> seeds) {
  std::vector<Seed> all;
  for (const DoseSeed& from : seeds) {
    Seed seed;
    seed.id = static_cast<std::uint32_t>(all.size() + 1);
    seed.needle = Seed::kNoNeedle;
    seed.is_certified = true;
    seed.source = from.source;
    seed.air_kerma_strength_u = from.air_kerma_strength_u;
    seed.dropped = seed.rest = seed.position = from.position;
    seed.dropped_axis = seed.rest_axis = seed.axis = from.axis;
    all.push_back(seed);
  }
  return all;
}

std::vector<DoseSeed> at_rest(std::span<const Seed> seeds) {
  std::vector<DoseSeed> all;
  for (const Seed& seed : seeds) all.push_back(seed.at_rest());
  return all;
}

std::vector<Vec3> middles_of(std::span<const DoseSeed> seeds) {
  std::vector<Vec3> all;
  for (const DoseSeed& seed : seeds) all.push_back(seed.position);
  return all;
}

}  // namespace brachy
