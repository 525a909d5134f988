#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/rigid_transform.h"

class DcmFileFormat;
class DcmItem;

namespace brachy {

/// A tag with its name, "Contour Data (3006,0050)".
struct DicomTag {
  unsigned short group, element;
  std::string text() const;
};

/// A DICOM data set, or an item of a sequence in one. Copies refer to the same item; valid as long as the file.
/// Errors name file and tag: UserError "FILE: Name (gggg,eeee): what; fix".
class DicomItem {
 public:
  DicomItem(DcmItem* item, std::string name) : item_(item), name_(std::move(name)) {}

  bool has(const DicomTag& tag) const;  ///< and it is not empty
  /// The first value without blanks around it, in UTF-8 whatever the data set's character set; empty where the item has
  /// none.
  std::string text(const DicomTag& tag) const;
  /// Whether `word` is one of the values of a code string.
  bool lists(const DicomTag& tag, std::string_view word) const;
  /// All values of a decimal string, integer string or number; empty where there is none. Errors: a value is no number.
  std::vector<double> numbers(const DicomTag& tag) const;
  /// As numbers, but exactly `count` values.
  std::vector<double> numbers(const DicomTag& tag, std::size_t count) const;
  double number(const DicomTag& tag) const { return numbers(tag, 1).front(); }
  std::optional<double> optional_number(const DicomTag& tag) const;
  /// A whole number within the range.
  std::size_t count(const DicomTag& tag, std::size_t least, std::size_t most) const;
  /// Three coordinates in LPS as a point in RAS, mm.
  Vec3 point(const DicomTag& tag) const;
  std::vector<DicomItem> sequence(const DicomTag& tag) const;

  /// The largest private elements of the item and of the items in it, three at most: "(300b,1040) of VENDOR"; empty:
  /// there are none.
  std::string private_data() const;

  [[noreturn]] void refuse(const DicomTag& tag, const std::string& what) const;
  const std::string& name() const { return name_; }
  DcmItem* item() const { return item_; }

 private:
  std::optional<std::string> raw_value(const DicomTag& tag) const;
  std::string in_utf8(std::string text) const;

  DcmItem* item_;
  std::string name_;
};

/// A file of DICOM part 10, of any transfer syntax but compressed video; also without its preamble or meta header, as
/// dicom_layout finds it. Threads: one.
class DicomFile {
 public:
  /// `name` stands for the file in errors. Errors: UserError where the bytes are no whole DICOM file.
  DicomFile(std::string_view bytes, const std::string& name);
  ~DicomFile();
  DicomFile(DicomFile&&) noexcept;

  DicomItem data() const;
  std::string modality() const;

  /// The voxels of an image, decompressed: the stored bits with their sign, frame by frame.
  struct Pixels {
    std::size_t rows = 0, columns = 0, frames = 0;
    std::vector<std::int64_t> values;
  };
  /// Errors: not one grey sample a pixel of 8, 16 or 32 bits; the stored bits lie beside it; the data is shorter than
  /// rows × columns × frames; a codec that is not here.
  Pixels pixels() const;

  /// The pixels of a segmentation as they are stored, decompressed: of one bit each, the least of a byte first and
  /// frames without a gap, or of eight.
  struct PackedPixels {
    std::size_t rows = 0, columns = 0, frames = 0, bits = 0;
    const std::uint8_t* bytes = nullptr;  ///< valid as long as the file
    std::uint8_t at(std::size_t n) const {
      return bits == 8 ? bytes[n] : static_cast<std::uint8_t>(bytes[n / 8] >> n % 8 & 1);
    }
  };
  /// Errors: as pixels, with 1 or 8 bits.
  PackedPixels packed_pixels() const;

 private:
  struct PixelElement;
  PixelElement pixel_element(std::initializer_list<std::size_t> widths, std::size_t most_count) const;

  std::unique_ptr<DcmFileFormat> file_;
  std::string name_;
  std::size_t file_bytes_;
};

/// x and y are reversed between LPS (DICOM) and RAS.
inline Vec3 ras_of_lps(const Vec3& p) {
  return {-p.x(), -p.y(), p.z()};
}

}  // namespace brachy
