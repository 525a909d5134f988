#include "apps/import/dicom/dicom_file.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcistrmb.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dcspchrs.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "apps/import/dicom/dicom_precheck.h"
#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/labels/import_limits.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/base/utf8.h"

namespace brachy {
namespace {

/// Of pixels: an empty image in JPEG-LS has some 1/4000 of its bytes.
constexpr std::size_t kMostCompression = 1 << 14;

DcmTagKey key_of(const DicomTag& tag) {
  return {tag.group, tag.element};
}

/// Once for the process: no messages of DCMTK's own, and the codecs.
void prepare_dcmtk() {
  static const bool is_ready = [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    dcmEnableUnknownVRConversion.set(OFTrue);  // UN of a known tag is what the tag says, sequences too
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    return true;
  }();
  (void)is_ready;
}

std::string_view without_blanks(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n\0");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(std::string_view(" \t\r\n\0", 5)) - first + 1);
}

/// Little-endian numbers as a decimal string with backslashes.
template <class Number>
std::string numbers_text(const std::string& raw) {
  std::string text;
  for (std::size_t at = 0; at + sizeof(Number) <= raw.size(); at += sizeof(Number)) {
    Number value{};
    std::memcpy(&value, raw.data() + at, sizeof value);
    text.append(text.empty() ? "" : "\\").append(exact_text(static_cast<double>(value)));
  }
  return text;
}

/// The bits of a word that are the value; those above may hold an overlay (PS3.5 before 2004, 8.1).
struct StoredValue {
  unsigned shift;
  std::uint32_t mask, sign;

  std::int64_t of(std::uint32_t word) const {
    const std::uint32_t value = word >> shift & mask;
    return std::int64_t{value} - 2 * std::int64_t{value & sign};
  }
};

/// Preamble and meta header of a file of part 10, with nothing but the transfer syntax (PS3.10, 7.1).
std::string header_of(std::string syntax) {
  if (syntax.size() % 2 != 0) syntax += '\0';
  const auto length = static_cast<char>(syntax.size());
  std::string header(128, '\0');
  header.append("DICM").append("\2\0\0\0UL\4\0", 8).append({static_cast<char>(8 + length), 0, 0, 0});
  return header.append("\2\0\x10\0UI", 6).append({length, 0}).append(syntax);
}

StoredValue stored_value(const DicomItem& data, std::size_t bits) {
  const std::size_t stored = data.has(tag::kBitsStored) ? data.count(tag::kBitsStored, 1, bits) : bits;
  const std::size_t high =
      data.has(tag::kHighBit) ? data.count(tag::kHighBit, stored - 1, bits - 1) : stored - 1;
  const bool is_signed = data.has(tag::kPixelRepresentation) && data.number(tag::kPixelRepresentation) == 1;
  const auto mask = static_cast<std::uint32_t>((std::uint64_t{1} << stored) - 1);
  return {static_cast<unsigned>(high + 1 - stored), mask, is_signed ? mask / 2 + 1 : 0};
}

}  // namespace

std::string DicomTag::text() const {
  char number[16];
  std::snprintf(number, sizeof number, " (%04x,%04x)", group, element);
  return std::string(DcmTag(key_of(*this)).getTagName()) + number;
}

std::string DicomItem::private_data() const {
  struct Found {
    std::uint32_t bytes;
    std::string text;
  };
  std::vector<Found> found;
  // A creator (gggg,0010 … gggg,00ff) names the elements of its block, (gggg,bb00 … gggg,bbff).
  const auto visit = [&](const auto& self, DcmItem& item) -> void {
    for (unsigned long n = 0; n < item.card(); ++n) {
      DcmElement* element = item.getElement(n);
      const std::uint16_t group = element->getGTag(), number = element->getETag();
      if (group % 2 == 1 && number > 0xff) {
        OFString creator;
        (void)item.findAndGetOFString(DcmTagKey(group, static_cast<std::uint16_t>(number >> 8)), creator);
        std::string text = DicomTag{group, number}.text();
        text = text.substr(text.rfind('('));
        if (!creator.empty()) text += " of " + one_short_line(std::string(creator.c_str()));
        found.push_back({element->getLength(), std::move(text)});
      } else if (auto* sequence = dynamic_cast<DcmSequenceOfItems*>(element); sequence && group % 2 == 0) {
        for (unsigned long k = 0; k < sequence->card(); ++k) self(self, *sequence->getItem(k));
      }
    }
  };
  visit(visit, *item_);
  std::ranges::stable_sort(found, std::greater<>(), &Found::bytes);
  std::string all;
  constexpr std::size_t kMost = 3;
  for (std::size_t n = 0, shown = 0; n < found.size() && shown < kMost; ++n) {
    if (all.find(found[n].text) != std::string::npos) continue;
    all += (all.empty() ? "" : ", ") + found[n].text;
    ++shown;
  }
  return all;
}

void DicomItem::refuse(const DicomTag& tag, const std::string& what) const {
  throw UserError(name_ + ": " + tag.text() + ": " + what);
}

bool DicomItem::has(const DicomTag& tag) const {
  return item_->tagExistsWithValue(key_of(tag));
}

// Values that are written as UN, OB or "??", which DCMTK gives as bytes in hex: a long value of a short kind (PS3.5,
// 6.2.2), or what a program on the way did not know. As the text of their numbers where the tag has binary ones.
std::optional<std::string> DicomItem::raw_value(const DicomTag& tag) const {
  DcmElement* element = nullptr;
  if (item_->findAndGetElement(key_of(tag), element).bad() || !element) return std::nullopt;
  const DcmEVR vr = element->getTag().getVR().getEVR();
  if (vr != EVR_UN && vr != EVR_OB && vr != EVR_UNKNOWN && vr != EVR_UNKNOWN2B) return std::nullopt;
  Uint8* bytes = nullptr;
  if (element->getUint8Array(bytes).bad() || !bytes) return std::string();
  const std::string raw(bytes, bytes + element->getLength());
  const DcmEVR meant = DcmTag(key_of(tag)).getEVR();
  if (meant == EVR_US || meant == EVR_xs) return numbers_text<std::uint16_t>(raw);
  if (meant == EVR_SS) return numbers_text<std::int16_t>(raw);
  if (meant == EVR_UL) return numbers_text<std::uint32_t>(raw);
  if (meant == EVR_SL) return numbers_text<std::int32_t>(raw);
  if (meant == EVR_FL) return numbers_text<float>(raw);
  if (meant == EVR_FD) return numbers_text<double>(raw);
  return raw;
}

// Of what is not ASCII. Many files state a set of one byte a letter, or none, and have UTF-8: of other texts hardly one
// is well-formed UTF-8, but of GB18030's some are. Without a statement Latin-1 is the likeliest.
std::string DicomItem::in_utf8(std::string text) const {
  constexpr char kEscape = 0x1b;
  if (std::ranges::all_of(text, [](char c) { return static_cast<signed char>(c) >= 0 && c != kEscape; }))
    return text;
  OFString stated;
  for (DcmObject* object = item_; object && stated.empty(); object = object->getParent())
    if (auto* item = dynamic_cast<DcmItem*>(object))
      (void)item->findAndGetOFStringArray(DCM_SpecificCharacterSet, stated, OFFalse);
  const bool is_of_bytes = stated.find("GB") == OFString_npos;
  if (is_of_bytes && is_printable(text)) return text;
  DcmSpecificCharacterSet from;
  OFString converted;
  for (const OFString& set : {stated, OFString("ISO_IR 100")})
    if (!set.empty() && from.selectCharacterSet(set).good() &&
        from.convertString(text.c_str(), text.size(), converted, "").good())
      return {converted.c_str(), converted.size()};
  return text;
}

std::string DicomItem::text(const DicomTag& tag) const {
  if (const auto unknown = raw_value(tag))
    return in_utf8(std::string(without_blanks(std::string_view(*unknown).substr(0, unknown->find('\\')))));
  OFString value;
  if (item_->findAndGetOFString(key_of(tag), value).bad()) return {};
  return in_utf8(std::string(without_blanks({value.c_str(), value.size()})));
}

bool DicomItem::lists(const DicomTag& tag, std::string_view word) const {
  OFString value;
  for (unsigned long n = 0; item_->findAndGetOFString(key_of(tag), value, n).good(); ++n)
    if (without_blanks({value.c_str(), value.size()}) == word) return true;
  return false;
}

std::vector<double> DicomItem::numbers(const DicomTag& tag) const {
  OFString of_binary;
  const std::optional<std::string> unknown = raw_value(tag);
  std::string_view rest;
  DcmElement* element = nullptr;
  char* text = nullptr;
  Uint32 length = 0;
  if (unknown) rest = *unknown;
  // The whole text: DCMTK's array of strings looks for each of n numbers from the front.
  else if (item_->findAndGetElement(key_of(tag), element).good() && element->getString(text, length).good())
    rest = {text ? text : "", text ? length : 0};
  else if (item_->findAndGetOFStringArray(key_of(tag), of_binary).good())
    rest = {of_binary.c_str(), of_binary.size()};
  else
    return {};
  std::vector<double> values;
  if (without_blanks(rest).empty()) return {};
  for (bool more = true; more;) {
    const auto end = rest.find('\\');
    more = end != std::string_view::npos;
    std::string_view word = without_blanks(rest.substr(0, end));
    if (more) rest.remove_prefix(end + 1);
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [at, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || at != word.data() + word.size() || !std::isfinite(value))
      refuse(tag,
             "\"" + one_short_line(std::string(word.substr(0, 32))) + "\" is no number; export it again");
    values.push_back(value);
  }
  return values;
}

std::vector<double> DicomItem::numbers(const DicomTag& tag, std::size_t count) const {
  std::vector<double> values = numbers(tag);
  if (values.empty()) refuse(tag, "is missing or empty; export it again");
  if (values.size() != count)
    refuse(tag, "has " + std::to_string(values.size()) + " values for " + std::to_string(count) +
                    "; export it again");
  return values;
}

std::optional<double> DicomItem::optional_number(const DicomTag& tag) const {
  if (!has(tag)) return std::nullopt;
  return number(tag);
}

std::size_t DicomItem::count(const DicomTag& tag, std::size_t least, std::size_t most) const {
  const double value = number(tag);
  if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)) ||
      value != std::floor(value))
    refuse(tag, "must be " + std::to_string(least) + " … " + std::to_string(most) + "; export it again");
  return static_cast<std::size_t>(value);
}

Vec3 DicomItem::point(const DicomTag& tag) const {
  const std::vector<double> p = numbers(tag, 3);
  return ras_of_lps({p[0], p[1], p[2]});
}

std::vector<DicomItem> DicomItem::sequence(const DicomTag& tag) const {
  std::vector<DicomItem> items;
  DcmSequenceOfItems* sequence = nullptr;
  if (item_->findAndGetSequence(key_of(tag), sequence).bad() || !sequence) return items;
  // Through the list once: getItem(n) begins at the front each time.
  for (DcmObject* object = sequence->nextInContainer(nullptr); object;
       object = sequence->nextInContainer(object))
    if (auto* item = dynamic_cast<DcmItem*>(object)) items.emplace_back(item, name_);
  return items;
}

DicomFile::DicomFile(std::string_view bytes, const std::string& name)
    : file_(std::make_unique<DcmFileFormat>()), name_(name), file_bytes_(bytes.size()) {
  prepare_dcmtk();
  if (!begins_as_dicom(bytes))
    throw UserError(name + ": is no DICOM file: it has no DICM at byte 128; export it as DICOM part 10");
  if (bytes.size() > kMostFileBytes) throw UserError(name + ": is over 2 GB; export fewer frames");
  const DicomLayout layout = dicom_layout(bytes, name);
  std::string rewritten;
  if (layout.is_plain) {
    bytes = bytes.substr(0, layout.end);
  } else {
    rewritten = header_of(layout.transfer_syntax);
    rewritten.append(bytes.substr(layout.begin, layout.end - layout.begin));
    bytes = rewritten;
  }
  DcmInputBufferStream stream;
  stream.setBuffer(bytes.data(), static_cast<offile_off_t>(bytes.size()));
  stream.setEos();
  file_->transferInit();
  const OFCondition read = file_->read(stream, EXS_Unknown, EGL_noChange, DCM_MaxReadLength);
  file_->transferEnd();
  if (read.bad())
    throw UserError(name + ": cannot be read as DICOM (" + read.text() +
                    "); it is cut off or damaged, export it again");
  // What is cut off at the end of an element looks whole: the last one tells by the bytes that are left.
  if (!file_->getDataset() || file_->getDataset()->card() == 0)
    throw UserError(name + ": holds no data set; it is cut off, export it again");
}

DicomFile::~DicomFile() = default;
DicomFile::DicomFile(DicomFile&&) noexcept = default;

DicomItem DicomFile::data() const {
  return {file_->getDataset(), name_};
}

std::string DicomFile::modality() const {
  return data().text(tag::kModality);
}

struct DicomFile::PixelElement {
  std::size_t rows = 0, columns = 0, frames = 0, bits = 0, count = 0;
  bool was_big_endian = false;
  DcmElement* element = nullptr;  ///< of at least count · bits
};

/// Of one grey sample a pixel, decompressed.
DicomFile::PixelElement DicomFile::pixel_element(std::initializer_list<std::size_t> widths,
                                                 std::size_t most_count) const {
  const DicomItem data = this->data();
  PixelElement pixels;
  pixels.rows = data.count(tag::kRows, 1, 65535);
  pixels.columns = data.count(tag::kColumns, 1, 65535);
  pixels.frames = data.has(tag::kFrames) ? data.count(tag::kFrames, 1, 1'000'000) : 1;
  if (data.has(tag::kSamples) && data.number(tag::kSamples) != 1)
    data.refuse(tag::kSamples, "must be 1, a grey image; export it without colour");
  pixels.bits = data.count(tag::kBitsAllocated, 1, 32);
  if (std::ranges::find(widths, pixels.bits) == widths.end()) {
    std::string all;
    for (const std::size_t width : widths)
      all += (all.empty() ? "" : width == *(widths.end() - 1) ? " or " : ", ") + std::to_string(width);
    data.refuse(tag::kBitsAllocated, "must be " + all + "; export it again");
  }
  pixels.count = pixels.rows * pixels.columns * pixels.frames;
  const std::size_t bytes = (pixels.count * pixels.bits + 7) / 8;
  if (pixels.count > most_count)
    data.refuse(tag::kRows, "rows × columns × frames are over 2^29 voxels; crop the grid");
  DcmDataset& set = *file_->getDataset();
  // DCMTK takes memory for all pixels before it decompresses the first.
  if (bytes / kMostCompression > file_bytes_)
    data.refuse(tag::kPixelData, "cannot hold rows × columns × frames in so short a file; export it again");
  pixels.was_big_endian = DcmXfer(set.getOriginalXfer()).getByteOrder() == EBO_BigEndian;
  if (set.chooseRepresentation(EXS_LittleEndianExplicit, nullptr).bad())
    data.refuse(tag::kPixelData, "is compressed in a way that is not read here; export it uncompressed");
  if (set.findAndGetElement(DCM_PixelData, pixels.element).bad() || !pixels.element)
    data.refuse(tag::kPixelData, "is missing; export it with its pixels");
  if (pixels.element->getLength() < bytes)
    data.refuse(tag::kPixelData, "has " + std::to_string(pixels.element->getLength()) + " bytes for " +
                                     std::to_string(bytes) + "; it is cut off, export it again");
  return pixels;
}

DicomFile::PackedPixels DicomFile::packed_pixels() const {
  const PixelElement from = pixel_element({1, 8}, 8 * kMostFileBytes);
  PackedPixels pixels{from.rows, from.columns, from.frames, from.bits, nullptr};
  Uint8* bytes = nullptr;
  if (from.element->getUint8Array(bytes).bad() || !bytes)
    data().refuse(tag::kPixelData, "cannot be read; export it again");
  pixels.bytes = bytes;
  return pixels;
}

DicomFile::Pixels DicomFile::pixels() const {
  const DicomItem data = this->data();
  const PixelElement from = pixel_element({8, 16, 32}, kMostVoxels);
  const std::size_t bits = from.bits, count = from.count;
  DcmElement* const element = from.element;
  const bool was_big_endian = from.was_big_endian;
  Pixels pixels;
  pixels.rows = from.rows;
  pixels.columns = from.columns;
  pixels.frames = from.frames;
  pixels.values.resize(count);
  const StoredValue stored = stored_value(data, bits);
  if (bits == 8) {
    Uint8* bytes = nullptr;
    if (element->getUint8Array(bytes).bad() || !bytes)
      data.refuse(tag::kPixelData, "cannot be read; export it again");
    for (std::size_t n = 0; n < count; ++n) pixels.values[n] = stored.of(bytes[n]);
    return pixels;
  }
  Uint16* words = nullptr;
  if (element->getUint16Array(words).bad() || !words)
    data.refuse(tag::kPixelData, "cannot be read; export it again");
  for (std::size_t n = 0; n < count; ++n) {
    if (bits == 16) {
      pixels.values[n] = stored.of(words[n]);
      continue;
    }
    // DCMTK swaps words of 16 bits alone: of a big-endian file the upper word still comes first.
    const std::uint32_t first = words[2 * n], second = words[2 * n + 1];
    pixels.values[n] = stored.of(was_big_endian ? first << 16 | second : second << 16 | first);
  }
  return pixels;
}

}  // namespace brachy
