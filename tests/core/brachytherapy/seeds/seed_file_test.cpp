#include "core/brachytherapy/seeds/seed_file.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace brachy
