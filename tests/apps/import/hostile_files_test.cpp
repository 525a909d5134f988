// Files that would take DCMTK or zlib far, refused before that: by one line, without the memory that they claim.
#include <gtest/gtest.h>

#include "apps/import/labels/label_nifti.h"
#include "apps/import/voxels/rt_dose.h"
#include "core/base/error.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"

namespace brachy {
namespace {

/// Little-endian explicit VR, as PS3.5 has it.
struct DicomBytes {
  std::string text;

  static std::string word(std::uint64_t value, std::size_t size) {
    std::string bytes;
    for (std::size_t k = 0; k < size; ++k) bytes += static_cast<char>(value >> (8 * k) & 0xFFU);
    return bytes;
  }
  DicomBytes& element(unsigned group, unsigned number, const char* vr, const std::string& value) {
    text += word(group, 2) + word(number, 2) + vr + word(value.size(), 2) + value;
    return *this;
  }
  DicomBytes& longer(unsigned group, unsigned number, const char* vr, std::uint32_t length,
                     const std::string& value) {
    text += word(group, 2) + word(number, 2) + vr + word(0, 2) + word(length, 4) + value;
    return *this;
  }
  DicomBytes& item(std::uint32_t length) {
    text += word(0xFFFE, 2) + word(0xE000, 2) + word(length, 4);
    return *this;
  }
};

std::string file_with(const std::string& data, const std::string& syntax = "1.2.840.10008.1.2.1",
                      const char* syntax_vr = "UI") {
  const std::string padded = syntax.size() % 2 == 0 ? syntax : syntax + '\0';
  const std::string uid = DicomBytes().element(2, 0x10, syntax_vr, padded).text;
  return std::string(128, '\0') + "DICM" +
         DicomBytes().element(2, 0, "UL", DicomBytes::word(uid.size(), 4)).text + uid + data;
}

void expect_dicom_refusal(const std::string& bytes, std::initializer_list<const char*> parts) {
  try {
    const DicomFile file(bytes, "f.dcm");
    (void)file.pixels();
    ADD_FAILURE() << "accepted";
  } catch (const UserError& e) {
    const std::string message = e.what();
    EXPECT_TRUE(message.starts_with("f.dcm: ")) << message;
    for (const char* part : parts)
      EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
  }
}

std::string modality_of(const std::string& bytes) {
  return DicomFile(bytes, "f.dcm").modality();
}

// Found by the fuzzer: DCMTK begins the data set where the length says, and takes the memory that stands there. The
// elements tell where it begins.
TEST(HostileDicom, FindsTheDataSetBehindAMetaHeaderOfAnotherLengthThanItSays) {
  const std::string whole = file_with(DicomBytes().element(0x0008, 0x0060, "CS", "RTDOSE").text);
  const std::size_t length_at = 132 + 8;
  for (const int by : {-2, 2, 100}) {
    std::string bytes = whole;
    bytes[length_at] = static_cast<char>(bytes[length_at] + by);
    EXPECT_EQ(modality_of(bytes), "RTDOSE");
  }
}

TEST(HostileDicom, RefusesATransferSyntaxThatOnlyDcmtkKnows) {
  const std::string data = DicomBytes().element(0x0008, 0x0060, "CS", "RTDOSE").text;
  EXPECT_EQ(modality_of(std::string(128, '\0') + "DICM" + data), "RTDOSE");
  expect_dicom_refusal(file_with(data, "Virtual Big Endian Implicit"), {"(0002,0010)", "export it as"});
}

TEST(HostileDicom, ReadsValuesOfAKindThatAProgramOnTheWayDidNotKnow) {
  EXPECT_EQ(modality_of(file_with(DicomBytes().element(8, 0x60, "??", "RTPLAN").text)), "RTPLAN");
  EXPECT_EQ(modality_of(file_with(DicomBytes().longer(8, 0x60, "UN", 6, "RTPLAN").text)), "RTPLAN");
  EXPECT_EQ(modality_of(file_with(DicomBytes().longer(8, 0x60, "OB", 6, "RTPLAN").text)), "RTPLAN");
  EXPECT_EQ(
      modality_of(file_with(DicomBytes().element(8, 0x60, "CS", "RTPLAN").text + std::string(77, '\0'))),
      "RTPLAN");
}

// Found by the fuzzer: DCMTK takes no TM for the transfer syntax, and reads deflated bytes as elements.
TEST(HostileDicom, RefusesAMetaHeaderWithoutOneTransferSyntaxOfItsKind) {
  const std::string data = DicomBytes().element(0x0008, 0x0060, "CS", "RTDOSE").text;
  for (const char* vr : {"TM", "SQ", "UN", "OB"})
    expect_dicom_refusal(file_with(data, "1.2.840.10008.1.2.1.99", vr), {"(0002,0010)", "export it again"});
  const std::string again = DicomBytes().element(2, 0x10, "UI", "1.2.840.10008.1.2.1.99").text;
  for (const std::string& first : {std::string("1.2.840.10008.1.2.1"), std::string(2, '\0')}) {
    std::string twice = file_with(again + data, first);
    twice[132 + 8] = static_cast<char>(twice[132 + 8] + static_cast<char>(again.size()));
    expect_dicom_refusal(twice, {"(0002,0010)", "is not one transfer syntax"});
  }
}

// Found by the fuzzer: a header with 530 characters of it stated 18, and DCMTK asked for 1.2 GB.
TEST(HostileDicom, RefusesATransferSyntaxThatIsTooLongForAnIdentifier) {
  const std::string data = DicomBytes().element(0x0008, 0x0060, "CS", "RTDOSE").text;
  for (const std::size_t size : {66, 256, 530})
    expect_dicom_refusal(file_with(data, std::string(size, '1')), {"(0002,0010)", "64 characters"});
}

TEST(HostileDicom, RefusesSequencesThatLieDeepInEachOther) {
  DicomBytes deep;
  for (int n = 0; n < 200'000; ++n) deep.longer(0x3006, 0x20, "SQ", 0xFFFFFFFF, "").item(0xFFFFFFFF);
  expect_dicom_refusal(file_with(deep.text), {"32 deep", "export it again"});
}

TEST(HostileDicom, RefusesLengthsBeyondTheFile) {
  expect_dicom_refusal(file_with(DicomBytes().longer(0x7FE0, 0x10, "OW", 0xFFFFFFF0, "ab").text),
                       {"(7fe0,0010)", "longer", "cut off"});
  expect_dicom_refusal(file_with(DicomBytes().longer(0x3006, 0x20, "SQ", 8, "").item(100).text + "12"),
                       {"longer"});
  expect_dicom_refusal(file_with(DicomBytes().longer(0x3006, 0x20, "SQ", 0xFFFFFFFF, "").text), {"no end"});
  expect_dicom_refusal(file_with(DicomBytes().element(8, 0x60, "a?", "RTPLAN").text),
                       {"(0008,0060)", "value representation"});
  expect_dicom_refusal(file_with("", "1.2.3"), {"(0002,0010)", "Transfer Syntax"});
}

TEST(HostileDicom, RefusesAFewBytesOfPixelsForMany) {
  const auto us = [](unsigned value) { return DicomBytes::word(value, 2); };
  DicomBytes data;
  data.element(0x28, 2, "US", us(1)).element(0x28, 4, "CS", "MONOCHROME2 ");
  data.element(0x28, 0x10, "US", us(16384)).element(0x28, 0x11, "US", us(16384));
  data.element(0x28, 0x100, "US", us(16)).element(0x28, 0x101, "US", us(16));
  data.element(0x28, 0x102, "US", us(15)).element(0x28, 0x103, "US", us(0));
  data.longer(0x7FE0, 0x10, "OB", 0xFFFFFFFF, "").item(0).item(4);
  data.text += "1234" + DicomBytes::word(0xFFFE, 2) + DicomBytes::word(0xE0DD, 2) + DicomBytes::word(0, 4);
  expect_dicom_refusal(file_with(data.text, "1.2.840.10008.1.2.5"), {"(7fe0,0010)", "short a file"});
}

/// The header of a NIfTI-1 map of bytes.
std::string nifti_header(std::int16_t i, std::int16_t j, std::int16_t k) {
  std::string header(352, '\0');
  const auto put = [&](std::size_t at, std::uint64_t value, std::size_t size) {
    header.replace(at, size, DicomBytes::word(value, size));
  };
  put(0, 348, 4);
  put(40, 3, 2);
  put(42, static_cast<std::uint64_t>(i), 2);
  put(44, static_cast<std::uint64_t>(j), 2);
  put(46, static_cast<std::uint64_t>(k), 2);
  put(70, 2, 2);
  put(108, std::bit_cast<std::uint32_t>(352.0F), 4);
  put(254, 1, 2);
  for (std::size_t a = 0; a < 3; ++a) put(280 + 20 * a, std::bit_cast<std::uint32_t>(1.0F), 4);
  return header;
}

TEST(HostileNifti, UnpacksNoMoreThanItsHeaderAsksFor) {
  const std::string zeros(std::size_t{1} << 26, '\0');
  const std::string bomb = test::gzipped(nifti_header(2, 1, 1) + std::string("\1\2", 2) + zeros, 9);
  const LabelMap map = parse_label_nifti(bomb, "m.nii.gz");  // what is behind the voxels is nobody's
  EXPECT_EQ(map.layers.front(), (std::vector<std::uint16_t>{1, 2}));
  EXPECT_THROW(parse_label_nifti(test::gzipped(nifti_header(800, 800, 800)), "m.nii.gz"), UserError);
  EXPECT_THROW(parse_label_nifti(test::gzipped(nifti_header(2, 1, 1)), "m.nii.gz"), UserError);
  EXPECT_THROW(parse_label_nifti(test::gzipped(nifti_header(2, 1, 1) + "ab").substr(0, 40), "m.nii.gz"),
               UserError);
  EXPECT_THROW(parse_label_nifti(nifti_header(30000, 30000, 30000), "m.nii"), UserError);
}

}  // namespace
}  // namespace brachy
