// Files of seeds, and the grid as NRRD, read back by an independent reader of the format.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <map>
#include <sstream>
#include <string>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_nrrd.h"
#include "core/brachytherapy/dose/dose_seed_file.h"

namespace brachy {
namespace {

const std::string kHeader = std::string(kDoseSeedHeader) + "\n";

TEST(DoseSeedFile, GivesSeedsWithAxesOfUnitLength) {
  const auto seeds =
      parse_dose_seeds(kHeader + "1,2,3,0,0,-2,6711,0.5\n\n# spare\n-4,5.5,6e1,3,4,0,200,1.75\n", "S.csv");
  ASSERT_EQ(seeds.size(), 2u);
  EXPECT_EQ(seeds[0].position, Vec3(1, 2, 3));
  EXPECT_EQ(seeds[0].axis, Vec3(0, 0, -1));
  EXPECT_EQ(seeds[0].source, SourceModel::kAmersham6711);
  EXPECT_EQ(seeds[0].air_kerma_strength_u, 0.5);
  EXPECT_EQ(seeds[1].position, Vec3(-4, 5.5, 60));
  EXPECT_NEAR((seeds[1].axis - Vec3(0.6, 0.8, 0)).norm(), 0, 1e-15);
  EXPECT_EQ(seeds[1].source, SourceModel::kTheraSeed200);
}

TEST(DoseSeedFile, TakesAxesOfAnyLengthThatIsNotZero) {
  for (const char* axis : {"1e-300,0,1e-300", "1e300,0,1e300", "5e-324,0,5e-324"}) {
    const auto seeds = parse_dose_seeds(kHeader + "0,0,0," + axis + ",6711,1\n", "S.csv");
    EXPECT_NEAR((seeds.at(0).axis - Vec3(1, 0, 1).normalized()).norm(), 0, 1e-15) << axis;
  }
}

TEST(DoseSeedFile, RefusesWhatIsNoSeedByLineWithTheFix) {
  const std::map<std::string, std::vector<std::string>> bad = {
      {"0,0,0,0,0,0,6711,1", {"S.csv:3:", "axis", "0,0,1"}},
      {"0,0,0,0,0,1,6702,1", {"S.csv:3:", "6702", "6711", "200"}},
      {"0,0,0,0,0,1,6711.5,1", {"S.csv:3:", "6711.5"}},
      {"0,0,0,0,0,1,6711,0", {"S.csv:3:", "strength_u", "above 0"}},
      {"0,0,0,0,0,1,6711,-1", {"S.csv:3:", "strength_u", "-1"}},
      {"0,0,0,0,0,1,6711", {"S.csv:3:"}},
      {"0,0,0,0,0,1,iodine,1", {"S.csv:3:"}},
      {"0,0,nan,0,0,1,6711,1", {"S.csv:3:"}},
  };
  for (const auto& [row, parts] : bad) try {
      parse_dose_seeds(kHeader + "0,0,0,0,0,1,6711,1\n" + row + "\n", "S.csv");
      ADD_FAILURE() << row;
    } catch (const UserError& e) {
      for (const std::string& part : parts)
        EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what() << " lacks " << part;
    }
  EXPECT_THROW(parse_dose_seeds("x,y,z\n0,0,0\n", "S.csv"), UserError);
  EXPECT_THROW(parse_dose_seeds("", "S.csv"), UserError);
}

TEST(DoseNrrd, ComesBackWithItsPlaceAndValues) {
  DoseGrid grid({-3.5, 2, 0.1}, {4.5, 8, 3.1}, 1.5);
  grid.add({.position = Vec3(0, 5, 1), .axis = Vec3::UnitZ(), .air_kerma_strength_u = 0.5});
  const std::string file = to_nrrd(grid);
  const std::size_t end = file.find("\n\n");
  ASSERT_NE(end, std::string::npos);
  std::istringstream header(file.substr(0, end + 1));
  std::string line;
  std::getline(header, line);
  EXPECT_EQ(line, "NRRD0004");
  std::map<std::string, std::string> fields;
  bool space_known = false;
  while (std::getline(header, line)) {
    if (line.starts_with('#')) continue;
    const std::size_t colon = line.find(": ");
    ASSERT_NE(colon, std::string::npos) << line;
    const std::string key = line.substr(0, colon);
    if (key == "space") space_known = true;
    if (key == "space directions" || key == "space origin" || key == "space units") {
      EXPECT_TRUE(space_known) << "a reader must know the space's dimension before its vectors";
    }
    fields[key] = line.substr(colon + 2);
  }
  const auto [nx, ny, nz] = grid.size();
  EXPECT_EQ(fields["type"], "float");
  EXPECT_EQ(fields["dimension"], "3");
  EXPECT_EQ(fields["space"], "right-anterior-superior");
  EXPECT_EQ(fields["sizes"], std::to_string(nx) + " " + std::to_string(ny) + " " + std::to_string(nz));
  EXPECT_EQ(fields["space directions"], "(1.5,0,0) (0,1.5,0) (0,0,1.5)");
  EXPECT_EQ(fields["space origin"], "(-3.5,2,0.1)");
  EXPECT_EQ(fields["endian"], "little");
  EXPECT_EQ(fields["encoding"], "raw");
  ASSERT_EQ(file.size() - end - 2, 4 * grid.dose_gy().size());
  for (std::size_t i = 0; i < grid.dose_gy().size(); ++i) {
    std::uint32_t bits = 0;
    for (std::size_t byte = 0; byte < 4; ++byte)
      bits |= static_cast<std::uint32_t>(static_cast<unsigned char>(file[end + 2 + 4 * i + byte]))
              << (8 * byte);
    ASSERT_EQ(std::bit_cast<float>(bits), grid.dose_gy()[i]) << i;
  }
}

}  // namespace
}  // namespace brachy
