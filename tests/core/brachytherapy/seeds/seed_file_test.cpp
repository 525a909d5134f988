#include "core/brachytherapy/seeds/seed_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/base/error.h"

namespace brachy {
namespace {

Seed seed(std::uint32_t id) {
  Seed s;
  s.id = id;
  s.tick = 123456789 + id;
  s.t_s = 1.0 / 3;
  s.needle = 2;
  s.is_certified = id % 2 == 1;
  s.planned = id == 1 ? Seed::kUnplanned : 7;
  s.source = id == 1 ? SourceModel::kAmersham6711 : SourceModel::kTheraSeed200;
  s.air_kerma_strength_u = 0.1 + 0.2;
  s.dropped = {1e-17, -2.0 / 7, 3};
  s.dropped_axis = Vec3(1, 2, 3).normalized();
  s.rest = {4, 5, 6.0 / 7};
  s.rest_axis = Vec3(-1, 2, 3).normalized();
  s.gland_motion = {0.1, 0.2, 0.3};
  s.position = s.rest;
  s.axis = s.rest_axis;
  return s;
}

std::string text_of(std::initializer_list<Seed> seeds) {
  std::string text(kSeedHeader);
  text += '\n';
  for (const Seed& s : seeds) text += seed_row(s) + "\n";
  return text;
}

std::string refusal_of(const std::string& text) {
  try {
    parse_seeds(text, "seeds.csv");
  } catch (const UserError& e) {
    return e.what();
  }
  return "";
}

TEST(SeedFile, ReadsBackTheSameBits) {
  EXPECT_EQ(parse_seeds(text_of({seed(1), seed(2)}), "seeds.csv"), (std::vector<Seed>{seed(1), seed(2)}));
  EXPECT_TRUE(parse_seeds(text_of({}), "seeds.csv").empty());
}

TEST(SeedFile, ASeedFixedOutsideTheTissueIsReadBackSo) {
  Seed fixed = seed(2);
  fixed.is_fixed = true;
  EXPECT_EQ(parse_seeds(text_of({seed(1), fixed}), "seeds.csv"), (std::vector<Seed>{seed(1), fixed}));
}

TEST(SeedFile, RefusesWhatNoLedgerSays) {
  EXPECT_NE(refusal_of(text_of({seed(2)})).find("seeds.csv:2: seed is 2, expected 1"), std::string::npos);
  EXPECT_NE(refusal_of(text_of({seed(1), seed(1)})).find("seeds.csv:3"), std::string::npos);
  Seed weak = seed(1);
  weak.air_kerma_strength_u = 0;
  EXPECT_NE(refusal_of(text_of({weak})).find("strength_u"), std::string::npos);
  Seed bent = seed(1);
  bent.rest_axis *= 2;
  EXPECT_NE(refusal_of(text_of({bent})).find("rest_ax"), std::string::npos);
  std::string other = text_of({seed(1)});
  other.replace(other.find(",6711,"), 6, ",6712,");
  EXPECT_NE(refusal_of(other).find("source"), std::string::npos);
  EXPECT_NE(refusal_of("a,b\n1,2\n"), "");
}

TEST(SeedFile, SeedsInPlaceAreThoseOfALedgerOrOfATableForDoses) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "seeds_in_place.csv";
  std::ofstream(file) << text_of({seed(1), seed(2)});
  EXPECT_EQ(load_seeds_in_place(file), (std::vector<Seed>{seed(1), seed(2)}));
  // As a spreadsheet writes it.
  std::ofstream(file) << "\xEF\xBB\xBFX, Y, Z, AX, AY, AZ, Source, Strength_U\r\n1,2,3,0,0,-2,200,1.5\r\n";
  const std::vector<Seed> table = load_seeds_in_place(file);
  ASSERT_EQ(table.size(), 1u);
  EXPECT_TRUE(table[0].was_there());
  EXPECT_EQ(table[0].planned, Seed::kUnplanned);
  EXPECT_EQ(table[0].rest, Vec3(1, 2, 3));
  EXPECT_EQ(table[0].position, Vec3(1, 2, 3));
  EXPECT_EQ(table[0].rest_axis, Vec3(0, 0, -1));
  EXPECT_EQ(table[0].source, SourceModel::kTheraSeed200);
  EXPECT_EQ(table[0].air_kerma_strength_u, 1.5);
  EXPECT_EQ(parse_seeds(text_of({table[0]}), "seeds.csv"),
            table);  // and is written to a ledger as what it is
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace brachy
