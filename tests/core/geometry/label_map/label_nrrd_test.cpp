// Label maps and segmentations in NRRD: segments, layers, types, and what is refused.
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/geometry/label_map/label_nrrd.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"

namespace brachy {
namespace {

using test::NrrdText;

void expect_label_refusal(const std::string& bytes, std::initializer_list<const char*> parts,
                          const NrrdLimits& limits = kLabelLimits) {
  try {
    parse_label_nrrd(bytes, "m.nrrd", limits);
    ADD_FAILURE() << "accepted: " << bytes;
  } catch (const UserError& e) {
    const std::string message = e.what();
    EXPECT_TRUE(message.starts_with("m.nrrd: ")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    for (const char* part : parts)
      EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
  }
}

NrrdText two_layers(const char* sizes, const char* directions) {
  NrrdText text;
  text.dimension = "4";
  text.sizes = sizes;
  text.directions = directions;
  return text;
}

TEST(LabelNrrd, MakesASegmentOfEachValueWhereTheHeaderNamesNone) {
  NrrdText text;
  text.sizes = "2 2 1";
  const LabelMap map = parse_label_nrrd(text.header() + std::string("\0\7\3\7", 4), "m.nrrd");
  ASSERT_EQ(map.segments.size(), 2u);
  EXPECT_EQ(map.segments[0].value, 3);
  EXPECT_EQ(map.segments[1].value, 7);
  EXPECT_EQ(map.layers.front(), (std::vector<std::uint16_t>{0, 7, 3, 7}));
}

TEST(LabelNrrd, ReadsSegmentsWithNameColourValueAndLayerFromEitherOrderOfAxes) {
  const std::string keys =
      "Segment0_ID:=a\nSegment0_Name:=Prostate: CTV\nSegment0_Color:=0.5 0.25 2\nSegment0_LabelValue:=4\n"
      "Segment0_Layer:=1\nSegment1_ID:=b\n";
  for (const bool are_last : {false, true}) {
    NrrdText text = are_last ? two_layers("2 1 1 2", "(1,0,0) (0,2,0) (0,0,3) none")
                             : two_layers("2 2 1 1", "none (1,0,0) (0,2,0) (0,0,3)");
    text.more = keys + "Segment1_Layer:=0\n";
    // Layer by layer {1, 9}, {0, 4}; voxel by voxel {1, 0}, {9, 4}.
    const std::string data = are_last ? std::string("\1\t\0\4", 4) : std::string("\1\0\t\4", 4);
    const LabelMap map = parse_label_nrrd(text.header() + data, "m.nrrd");
    ASSERT_EQ(map.layers.size(), 2u);
    EXPECT_EQ(map.layers[0], (std::vector<std::uint16_t>{1, 9}));
    EXPECT_EQ(map.layers[1], (std::vector<std::uint16_t>{0, 4}));
    ASSERT_EQ(map.segments.size(), 2u);
    EXPECT_EQ(map.segments[0].name, "Prostate: CTV");
    EXPECT_EQ(map.segments[0].value, 4);
    EXPECT_EQ(map.segments[0].layer, 1u);
    EXPECT_EQ(map.segments[0].colour, (std::array<double, 3>{0.5, 0.25, 1}));
    EXPECT_EQ(map.segments[1].value, 1);
    EXPECT_EQ(map.grid.size, (std::array<std::size_t, 3>{2, 1, 1}));
    EXPECT_EQ(map.grid.steps(1, 1), 2);
  }
  // Before Slicer 4.11 a layer for each segment.
  NrrdText old = two_layers("2 2 1 1", "none (1,0,0) (0,2,0) (0,0,3)");
  old.more = "Segment0_ID:=a\nSegment1_ID:=b\n";
  EXPECT_EQ(parse_label_nrrd(old.header() + std::string("\1\0\0\1", 4), "m.nrrd").segments[1].layer, 1u);
}

TEST(LabelNrrd, ReadsWholeNumbersOfEveryTypeRawCompressedAndAsText) {
  NrrdText text;
  text.sizes = "2 1 1";
  text.more = "endian: big\n";
  const std::vector<std::uint16_t> expected = {258, 0};
  const auto labels = [&](const char* type, const std::string& data) {
    text.type = type;
    return parse_label_nrrd(text.header() + data, "m.nrrd").layers.front();
  };
  EXPECT_EQ(labels("int64", test::words<std::uint64_t>({258, 0}, true)), expected);
  EXPECT_EQ(labels("unsigned long long", test::words<std::uint64_t>({258, 0}, true)), expected);
  EXPECT_EQ(labels("int", test::words<std::uint32_t>({258, 0}, true)), expected);
  EXPECT_EQ(labels("double", test::words<std::uint64_t>({std::bit_cast<std::uint64_t>(258.0), 0}, true)),
            expected);
  text.encoding = "gzip";
  EXPECT_EQ(labels("short", test::gzipped(test::words<std::uint16_t>({258, 0}, true))), expected);
  text.encoding = "ascii";
  EXPECT_EQ(labels("ushort", "258 0\n"), expected);
}

TEST(LabelNrrd, RefusesImagesAndDamagedSegmentsInOneLineWithTheFix) {
  NrrdText text;
  text.sizes = "2 1 1";
  text.more = "endian: little\n";
  text.type = "short";
  expect_label_refusal(text.header() + test::words<std::uint16_t>({1, 0xFFFF}, false),
                       {"-1", "image", "give a segmentation"});
  text.type = "float";
  expect_label_refusal(
      text.header() + test::words<std::uint32_t>({std::bit_cast<std::uint32_t>(0.5F), 0}, false),
      {"0.5", "image"});
  text.type = "uint32";
  expect_label_refusal(text.header() + test::words<std::uint32_t>({65536, 0}, false), {"65536", "image"});
  text.type = "uint8";
  const auto with = [&](const std::string& keys) {
    text.more = "Segment0_ID:=a\n" + keys;
    return text.header() + std::string(2, '\1');
  };
  expect_label_refusal(with("Segment0_LabelValue:=x\n"), {"Segment0_LabelValue:=x", "save it again"});
  expect_label_refusal(with("Segment0_LabelValue:=65536\n"), {"Segment0_LabelValue", "65535"});
  expect_label_refusal(with("Segment0_LabelValue:=1.5\n"), {"Segment0_LabelValue", "whole"});
  expect_label_refusal(with("Segment0_Layer:=1\n"), {"Segment0_Layer", "1 layers"});
  expect_label_refusal(with("Segment0_Color:=1 nan 0\n"), {"Segment0_Color", "no list of numbers"});
  // Nearer to a plane than a surface can be made in, although a volume may be.
  text.directions = "(1,0,0) (0,1,0) (1,1,0.05)";
  expect_label_refusal(with(""), {"space directions", "in a plane"});
}

TEST(LabelNrrd, RefusesLayersWithoutAnAxisOrAKeyOfTheirOwn) {
  const std::string data(4, '\1');
  expect_label_refusal(two_layers("2 2 1 1", "(1,0,0) none (0,1,0) (0,0,1)").header() + data,
                       {"space directions", "none"});
  expect_label_refusal(two_layers("2 2 1", "none (1,0,0) (0,1,0) (0,0,1)").header() + data,
                       {"sizes", "four"});
  NrrdText more = two_layers("65 1 1 1", "none (1,0,0) (0,1,0) (0,0,1)");
  expect_label_refusal(more.header() + std::string(65, '\1'), {"64 layers", "fewer"});
  NrrdText fewer = two_layers("2 2 1 1", "none (1,0,0) (0,1,0) (0,0,1)");
  fewer.more = "Segment0_ID:=a\nSegment1_ID:=b\nSegment2_ID:=c\n";
  expect_label_refusal(fewer.header() + data, {"Segment2_Layer", "2 layers"});
  fewer.dimension = "5";
  expect_label_refusal(fewer.header() + data, {"dimension: 5", "layers"});
}

TEST(LabelNrrd, TakesNoMemoryForMoreThanItsLimitOrItsBytesCanHold) {
  NrrdText text;
  text.encoding = "gzip";
  text.sizes = "1024 1024 512";
  expect_label_refusal(text.header() + test::gzipped("few"), {"compressed bytes"});
  expect_label_refusal(text.header() + test::gzipped("few"), {"crop"}, {.max_values = 100});
  text.sizes = "2 1 1";
  expect_label_refusal(text.header() + test::gzipped(std::string(1 << 20, '\0')), {"more bytes"});
}

}  // namespace
}  // namespace brachy
