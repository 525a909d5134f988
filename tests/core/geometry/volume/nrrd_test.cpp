// NRRD volumes: what is read, where it lies, and what is refused.
#include <gtest/gtest.h>

#include <numeric>

#include "core/base/error.h"
#include "core/geometry/volume/nrrd_file.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"

namespace brachy {
namespace {

using test::NrrdText;

std::string bytes_0_to_23() {
  std::string bytes(24, '\0');
  std::iota(bytes.begin(), bytes.end(), '\0');
  return bytes;
}

// The message of a refusal, which must be one line that begins with the name.
std::string refusal(const std::string& bytes, const NrrdLimits& limits = {}) {
  try {
    parse_nrrd(bytes, "v.nrrd", limits);
  } catch (const UserError& e) {
    const std::string message = e.what();
    EXPECT_TRUE(message.starts_with("v.nrrd: ")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_TRUE(message.find("; ") != message.npos || message.find("\": ") != message.npos)
        << "no fix: " << message;
    return message;
  }
  return "accepted";
}

void expect_refused(const std::string& bytes, std::initializer_list<const char*> parts) {
  const std::string message = refusal(bytes);
  for (const char* part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
}

TEST(Nrrd, ReadsValuesInTheOrderOfTheFile) {
  const NrrdVolume nrrd = parse_nrrd(NrrdText{}.header() + bytes_0_to_23(), "v.nrrd");
  EXPECT_TRUE(nrrd.is_integer());
  EXPECT_EQ(nrrd.volume.grid().count(), 24u);
  EXPECT_EQ(nrrd.volume.value(1, 2, 3), 23);
  EXPECT_EQ(nrrd.volume.value(1, 0, 2), 13);
}

TEST(Nrrd, PlacesVoxelsInRasWhateverTheSpace) {
  struct Case {
    const char* space;
    Vec3 signs;
  };
  for (const Case& c : {Case{"right-anterior-superior", {1, 1, 1}}, Case{"RAS", {1, 1, 1}},
                        Case{"left-posterior-superior", {-1, -1, 1}}, Case{"LPS", {-1, -1, 1}},
                        Case{"left-anterior-superior", {-1, 1, 1}}}) {
    NrrdText text;
    text.space = c.space;
    text.directions = "(0,0,2.5) (0.6,0.8,0) (-0.4,0.3,0)";  // oblique, of three spacings
    const Volume volume = parse_nrrd(text.header() + bytes_0_to_23(), "v.nrrd").volume;
    const Vec3 in_file = Vec3(10, 20, 30) + Vec3(0, 0, 2.5) + 2 * Vec3(0.6, 0.8, 0) + 3 * Vec3(-0.4, 0.3, 0);
    const Vec3 X = c.signs.cwiseProduct(in_file);
    EXPECT_LE((volume.grid().position({1, 2, 3}) - X).norm(), 1e-12) << c.space;
    EXPECT_LE((volume.index_of(X) - Vec3(1, 2, 3)).norm(), 1e-12) << c.space;
    EXPECT_NEAR(volume.at(X), 23, 1e-5) << c.space;
  }
}

TEST(Nrrd, ReadsEveryTypeInBothByteOrdersRawAndCompressed) {
  for (const bool is_big : {false, true})
    for (const bool is_gzip : {false, true}) {
      NrrdText text;
      text.sizes = "2 1 1";
      text.encoding = is_gzip ? "gzip" : "raw";
      text.more = is_big ? "endian: big\n" : "endian: little\n";
      const auto values = [&](const std::string& type, const std::string& data) {
        text.type = type;
        const NrrdVolume nrrd = parse_nrrd(text.header() + (is_gzip ? test::gzipped(data) : data), "v.nrrd");
        return std::vector<float>(nrrd.volume.values().begin(), nrrd.volume.values().end());
      };
      const auto word16 = test::words<std::uint16_t>({0xFFFE, 0x1234}, is_big);
      const auto word32 = test::words<std::uint32_t>({0xFFFFFFFD, 0x10000}, is_big);
      EXPECT_EQ(values("int8", "\xFE\x7F"), (std::vector<float>{-2, 127}));
      EXPECT_EQ(values("unsigned char", "\xFE\x7F"), (std::vector<float>{254, 127}));
      EXPECT_EQ(values("short", word16), (std::vector<float>{-2, 4660}));
      EXPECT_EQ(values("uint16", word16), (std::vector<float>{65534, 4660}));
      EXPECT_EQ(values("int", word32), (std::vector<float>{-3, 65536}));
      const auto floats = test::words<std::uint32_t>(
          {std::bit_cast<std::uint32_t>(-0.5F), std::bit_cast<std::uint32_t>(1e10F)}, is_big);
      EXPECT_EQ(values("float", floats), (std::vector<float>{-0.5F, 1e10F}));
      const auto doubles = test::words<std::uint64_t>(
          {std::bit_cast<std::uint64_t>(0.25), std::bit_cast<std::uint64_t>(-3.0)}, is_big);
      EXPECT_EQ(values("double", doubles), (std::vector<float>{0.25F, -3}));
    }
}

TEST(Nrrd, ReadsTextSkipsAndSeveralGzipMembers) {
  NrrdText text;
  text.sizes = "3 1 1";
  text.encoding = "ascii";
  EXPECT_EQ(parse_nrrd(text.header() + "1 -2.5\n3e1\n", "v").volume.value(2, 0, 0), 30);
  text.encoding = "raw";
  text.more = "line skip: 2\nbyte skip: 1\n";
  EXPECT_EQ(parse_nrrd(text.header() + "one\ntwo\n_abc", "v").volume.value(0, 0, 0), 'a');
  text.more = "byte skip: -1\r\n";
  EXPECT_EQ(parse_nrrd(text.header() + "whatever abc", "v").volume.value(2, 0, 0), 'c');
  text.encoding = "gz";
  text.more = "byte skip: 2\nkey:=value: with a colon\ncontent: a name\n";
  EXPECT_EQ(parse_nrrd(text.header() + test::gzipped("__ab") + test::gzipped("c") + std::string(5, '\0'), "v")
                .volume.value(2, 0, 0),
            'c');
}

TEST(Nrrd, RefusesWhatIsNoVolumeInThePatient) {
  const std::string data = bytes_0_to_23();
  expect_refused("", {"not an NRRD"});
  expect_refused("NRRD0009\n\n", {"not an NRRD"});
  expect_refused("NRRD0005\ntype: uint8\n", {"no end"});
  expect_refused("NRRD0005\nnonsense\n\n", {"line 2", "nonsense"});
  expect_refused("NRRD0005\ntype: uint8\ntype: int8\n\n", {"twice"});
  const auto with = [&](auto change) {
    NrrdText text;
    change(text);
    return text.header() + data;
  };
  expect_refused(with([](NrrdText& t) { t.dimension = "4", t.sizes = "3 2 2 2"; }), {"dimension: 4", "3-D"});
  expect_refused(with([](NrrdText& t) { t.sizes = "2 12"; }), {"sizes", "three"});
  expect_refused(with([](NrrdText& t) { t.sizes = "0 3 4"; }), {"sizes", "1 or more"});
  expect_refused(with([](NrrdText& t) { t.sizes = "-2 3 4"; }), {"sizes"});
  expect_refused(with([](NrrdText& t) { t.sizes = "4294967296 4294967296 4294967296"; }),
                 {"more than", "crop"});
  expect_refused(with([](NrrdText& t) { t.type = "block"; }), {"type: block", "convert"});
  expect_refused(with([](NrrdText& t) { t.encoding = "bzip2"; }), {"bzip2", "gzip"});
  expect_refused(with([](NrrdText& t) { t.space = ""; }), {"no \"space\"", "LPS or RAS"});
  expect_refused(with([](NrrdText& t) { t.space = "scanner-xyz"; }), {"scanner-xyz", "LPS or RAS"});
  expect_refused(with([](NrrdText& t) { t.directions = ""; }), {"no \"space directions\"", "orientation"});
  expect_refused(with([](NrrdText& t) { t.directions = "none (0,1,0) (0,0,1)"; }), {"space directions"});
  expect_refused(with([](NrrdText& t) { t.directions = "(1,0,0) (2,0,0) (0,0,1)"; }), {"in a plane"});
  expect_refused(with([](NrrdText& t) { t.directions = "(nan,0,0) (0,1,0) (0,0,1)"; }), {"step 1"});
  expect_refused(with([](NrrdText& t) { t.directions = "(1,0,0) (0,0,0) (0,0,1)"; }), {"step 2"});
  expect_refused(with([](NrrdText& t) { t.directions = "(1,0) (0,1) (0,1)"; }), {"space directions"});
  expect_refused(with([](NrrdText& t) { t.origin = ""; }), {"no \"space origin\""});
  expect_refused(with([](NrrdText& t) { t.origin = "(0,inf,0)"; }), {"space origin"});
  expect_refused(with([](NrrdText& t) { t.type = "int16"; }), {"no \"endian\""});
  expect_refused(with([](NrrdText& t) { t.more = "data file: LIST\n"; }), {"another file"});
  expect_refused(with([](NrrdText& t) { t.more = "space units: \"m\" \"m\" \"m\"\n"; }), {"mm"});
  expect_refused(with([](NrrdText& t) { t.more = "line skip: 9\n"; }), {"line skip"});
}

TEST(Nrrd, RefusesDataThatAreNotAsManyAsItsSizesSay) {
  const std::string data = bytes_0_to_23();
  NrrdText text;
  expect_refused(text.header() + data.substr(1), {"23 bytes", "need 24"});
  expect_refused(text.header() + data + "x", {"25 bytes", "need 24"});
  text.encoding = "gzip";
  expect_refused(text.header() + test::gzipped(data.substr(1)), {"23 bytes", "need 24"});
  expect_refused(text.header() + test::gzipped(data + "x"), {"more bytes"});
  const std::string whole = test::gzipped(data);
  expect_refused(text.header() + whole.substr(0, whole.size() - 9), {"damaged or cut short"});
  expect_refused(text.header() + data, {"damaged"});
  text.encoding = "ascii";
  expect_refused(text.header() + "1 2 3", {"at most 3 numbers"});
  expect_refused(text.header() + std::string(80, '1'), {"16777216"});
  std::string words;
  for (int k = 0; k < 25; ++k) words += "1 ";
  expect_refused(text.header() + words, {"more numbers"});
  expect_refused(text.header() + words.substr(4) + "x y ", {"\"x\"", "no number"});
}

TEST(Nrrd, DecompressesNoMoreThanItsSizesNeed) {
  // 64 MiB of zeros in 64 KiB.
  const std::string bomb = test::gzipped(std::string(std::size_t{1} << 26, '\0'), 9);
  ASSERT_LT(bomb.size(), 70'000u);
  NrrdText text;
  text.encoding = "gzip";
  expect_refused(text.header() + bomb, {"more bytes", "need 24"});
  // And the other way: few bytes that claim a large volume are refused before memory is taken for it.
  text.sizes = "512 512 400";
  expect_refused(text.header() + test::gzipped(bytes_0_to_23()), {"compressed bytes"});
  NrrdLimits few;
  few.max_values = 23;
  EXPECT_NE(refusal(NrrdText{}.header() + bytes_0_to_23(), few).find("23 values"), std::string::npos);
}

TEST(Nrrd, RefusesValuesThatAreNotFiniteOrNotExact) {
  NrrdText text;
  text.sizes = "2 1 1";
  text.more = "endian: little\n";
  text.type = "float";
  expect_refused(text.header() + test::words<std::uint32_t>({0, 0x7FC00000}, false),
                 {"value 1", "not a finite"});
  text.type = "double";
  expect_refused(text.header() + test::words<std::uint64_t>({std::bit_cast<std::uint64_t>(1e300), 0}, false),
                 {"value 0", "not a finite"});
  text.type = "uint32";
  expect_refused(text.header() + test::words<std::uint32_t>({0, 16777217}, false), {"16777216", "convert"});
}

TEST(Nrrd, ReadsOnlyRegularFilesOfBoundedSize) {
  const test::TempFile file("v.nrrd", NrrdText{}.header() + bytes_0_to_23());
  EXPECT_EQ(read_nrrd_file(file.path()).volume.value(1, 2, 3), 23);
  EXPECT_THROW(read_nrrd_file(file.path(), {.max_bytes = 50}), UserError);
  EXPECT_THROW(read_nrrd_file(file.path().parent_path()), UserError);
  EXPECT_THROW(read_nrrd_file(file.path().string() + ".not"), UserError);
}

TEST(Volume, IsLinearBetweenVoxelsAndConstantBeyond) {
  VoxelGrid grid;
  grid.size = {4, 5, 6};
  grid.origin = Vec3(-3, 2, 1);
  grid.steps << 0.5, 0.1, 0, -0.1, 0.6, 0, 0, 0.2, 2;
  std::vector<float> values;
  const auto linear = [](const Vec3& X) { return 3 + 2 * X.x() - X.y() + 0.5 * X.z(); };
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 4; ++i) values.push_back(static_cast<float>(linear(grid.position(Vec3(i, j, k)))));
  const Volume volume(grid, values);
  for (const Vec3& index : {Vec3(0, 0, 0), Vec3(3, 4, 5), Vec3(1.3, 2.7, 4.9)})
    EXPECT_NEAR(volume.at(grid.position(index)), linear(grid.position(index)), 1e-5);
  EXPECT_NEAR(volume.at(grid.position({-9, 2, 3})), linear(grid.position({0, 2, 3})), 1e-5);
  EXPECT_EQ(volume.nearest(grid.position({1.4, 2.6, 7})), volume.value(1, 3, 5));
  EXPECT_TRUE(volume.contains(grid.position({-0.4, 4.4, 5.4})));
  EXPECT_FALSE(volume.contains(grid.position({-0.6, 4, 5})));
  EXPECT_NEAR(volume.steps_inside(grid.position({1, 2, 4.5})), 0.5, 1e-9);
  EXPECT_EQ(volume.at(Vec3::Constant(std::numeric_limits<double>::quiet_NaN())), volume.value(0, 0, 0));
}

TEST(Volume, CoarsensByMeansThatStayInPlace) {
  VoxelGrid grid;
  grid.size = {7, 4, 3};
  grid.steps = Vec3(0.3, 0.5, 2).asDiagonal();
  std::vector<float> values;
  for (std::size_t n = 0; n < grid.count(); ++n) values.push_back(static_cast<float>(n % 7));
  const Volume coarse = Volume(grid, values).coarsened(1);
  EXPECT_EQ(coarse.grid().size, (std::array<std::size_t, 3>{2, 2, 3}));
  EXPECT_NEAR(coarse.grid().steps(0, 0), 0.9, 1e-12);
  EXPECT_NEAR(coarse.grid().origin.x(), 0.3, 1e-12);
  EXPECT_EQ(coarse.value(0, 0, 0), 1);    // 0, 1, 2
  EXPECT_EQ(coarse.value(1, 1, 2), 4.5);  // 3, 4, 5 and 6, which is left over
}

}  // namespace
}  // namespace brachy
