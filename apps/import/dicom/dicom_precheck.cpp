#include "apps/import/dicom/dicom_precheck.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/volume/gzip.h"

namespace brachy {
namespace {

constexpr std::size_t kDeepest = 32, kMostUnpacked = std::size_t{512} << 20, kPiece = std::size_t{1} << 16;
constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr std::size_t kLongestIdentifier = 64;  // PS3.5, 9.1

/// How elements are written: PS3.5, chapter 7 and annex A.
struct Encoding {
  bool is_implicit = false, is_big_endian = false;
};

/// Where the walk is: in a data set or item, in a sequence of items, or in one of pixel fragments.
struct Level {
  enum class Kind : std::uint8_t { kItem, kSequence, kFragments } kind;
  std::size_t end;         ///< of the bytes
  bool has_length = true;  ///< else it ends with a delimiter
  Encoding encoding;
};

class StructureWalk {
 public:
  StructureWalk(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}
  /// The elements of group 2 from `at` on, in explicit little endian; where they end. `syntax`: (0002,0010).
  /// `is_length_right`: whether the header states its own length, if at all.
  std::size_t walk_meta(std::size_t at, std::string& syntax, bool& is_length_right);
  /// The data set; where it ends.
  std::size_t walk(std::size_t from, Encoding encoding);
  /// How the element at `at` is written; nothing where neither makes sense.
  std::optional<Encoding> guess(std::size_t at) const;

 private:
  struct Element {
    std::uint16_t group = 0, number = 0;
    char vr[3] = "";  ///< empty where there is none
    std::uint32_t length = 0;
    std::size_t value = 0;  ///< where it begins
  };
  [[noreturn]] void refuse(const Element& e, const std::string& what) const {
    char tag[16];
    std::snprintf(tag, sizeof tag, "(%04x,%04x)", e.group, e.number);
    throw UserError(name_ + ": " + tag + ": " + what + "; it is cut off or damaged, export it again");
  }
  std::uint32_t number(std::size_t at, std::size_t size, bool is_big_endian) const {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < size; ++k)
      value |= std::uint32_t{static_cast<unsigned char>(bytes_[at + (is_big_endian ? size - 1 - k : k)])}
               << 8 * k;
    return value;
  }
  Element element(std::size_t at, std::size_t end, Encoding encoding) const;
  void enter(std::vector<Level>& levels, Level::Kind kind, const Element& e, Encoding encoding) const;
  void step_into(std::vector<Level>& levels, std::size_t& at) const;

  std::string_view bytes_;
  const std::string& name_;
};

StructureWalk::Element StructureWalk::element(std::size_t at, std::size_t end, Encoding encoding) const {
  Element e;
  if (end - at < 8)
    throw UserError(name_ + ": an element has no whole tag and length; it is cut off, export it again");
  e.group = static_cast<std::uint16_t>(number(at, 2, encoding.is_big_endian));
  e.number = static_cast<std::uint16_t>(number(at + 2, 2, encoding.is_big_endian));
  if (encoding.is_implicit || e.group == 0xfffe) {
    e.length = number(at + 4, 4, encoding.is_big_endian);
    e.value = at + 8;
    return e;
  }
  e.vr[0] = bytes_[at + 4];
  e.vr[1] = bytes_[at + 5];
  const DcmVR vr(e.vr);
  // "??" is what DCMTK wrote for a value that it did not know; letters may be those of a later standard.
  const auto is_capital = [](char c) { return c >= 'A' && c <= 'Z'; };
  if (!vr.isStandard() && !(is_capital(e.vr[0]) && is_capital(e.vr[1])) && std::string_view(e.vr) != "??")
    refuse(e, "has no value representation of the standard");
  if (!vr.usesExtendedLengthEncoding()) {
    e.length = number(at + 6, 2, encoding.is_big_endian);
    e.value = at + 8;
    return e;
  }
  if (end - at < 12) refuse(e, "has no whole length");
  e.length = number(at + 8, 4, encoding.is_big_endian);
  e.value = at + 12;
  return e;
}

std::size_t StructureWalk::walk_meta(std::size_t at, std::string& syntax, bool& is_length_right) {
  std::optional<std::size_t> stated_end;
  bool has_syntax = false;
  while (bytes_.size() - at >= 8 && number(at, 2, false) == 2) {
    const Element e = element(at, bytes_.size(), {});
    if (e.length > bytes_.size() - e.value) refuse(e, "is longer than the file");
    // What DCMTK would not take for the transfer syntax, or would read as more elements.
    const std::string_view vr = e.vr;
    if (vr == "SQ" || vr == "UN") refuse(e, "does not belong in the meta header");
    if (e.number == 0x0010) {
      // An empty one before the other too: DCMTK takes the first.
      if (vr != "UI" || has_syntax) refuse(e, "is not one transfer syntax");
      has_syntax = true;
      syntax = bytes_.substr(e.value, e.length);
      while (!syntax.empty() && (syntax.back() == '\0' || syntax.back() == ' ')) syntax.pop_back();
      if (syntax.size() > kLongestIdentifier) refuse(e, "is longer than an identifier, 64 characters");
    }
    at = e.value + e.length;
    if (e.number != 0) continue;
    if (e.length != 4 || stated_end) refuse(e, "is not the length of the meta header");
    stated_end = at + number(e.value, 4, false);
  }
  is_length_right = !stated_end || *stated_end == at;
  return at;
}

std::optional<Encoding> StructureWalk::guess(std::size_t at) const {
  if (bytes_.size() < at + 8) return std::nullopt;
  const bool is_big_endian = number(at, 2, false) > 0xff && number(at, 2, true) <= 0xff;
  const char vr[3] = {bytes_[at + 4], bytes_[at + 5], 0};
  if (DcmVR(vr).isStandard()) return Encoding{false, is_big_endian};
  if (number(at + 4, 4, is_big_endian) <= bytes_.size() - at - 8 && !is_big_endian)
    return Encoding{true, false};
  return std::nullopt;
}

void StructureWalk::enter(std::vector<Level>& levels, Level::Kind kind, const Element& e,
                          Encoding encoding) const {
  if (levels.size() >= kDeepest) refuse(e, "sequences lie more than 32 deep in each other");
  const std::size_t end = levels.back().end;
  levels.push_back(
      {kind, e.length == kUndefined ? end : e.value + e.length, e.length != kUndefined, encoding});
}

void StructureWalk::step_into(std::vector<Level>& levels, std::size_t& at) const {
  const Level level = levels.back();
  const Element e = element(at, level.end, level.encoding);
  at = e.value;
  const bool is_undefined = e.length == kUndefined;
  if (!is_undefined && e.length > level.end - e.value) refuse(e, "is longer than what it is in");
  if (e.group == 0xfffe && (e.number == 0xe0dd || e.number == 0xe00d)) {
    const bool is_of_items = e.number == 0xe00d;
    if (e.length != 0 || level.has_length || is_of_items != (level.kind == Level::Kind::kItem))
      refuse(e, "a delimiter stands where there is none");
    levels.pop_back();
    return;
  }
  if (level.kind != Level::Kind::kItem) {
    if (e.group != 0xfffe || e.number != 0xe000) refuse(e, "stands where a sequence's item must");
    if (level.kind == Level::Kind::kSequence) {
      enter(levels, Level::Kind::kItem, e, level.encoding);
      return;
    }
    if (is_undefined) refuse(e, "a fragment of pixels has no length");
    at += e.length;
    return;
  }
  if (e.group == 0xfffe) refuse(e, "an item stands outside of a sequence");
  const std::string_view vr = e.vr;
  const bool is_sequence =
      vr.empty() ? DcmTag(e.group, e.number).getEVR() == EVR_SQ || is_undefined : vr == "SQ";
  if (is_sequence) {
    enter(levels, Level::Kind::kSequence, e, level.encoding);
  } else if (vr == "UN" && (is_undefined || DcmTag(e.group, e.number).getEVR() == EVR_SQ)) {
    enter(levels, Level::Kind::kSequence, e, {true, false});  // PS3.5, 6.2.2
  } else if (is_undefined) {
    if (e.group != 0x7fe0 || (vr != "OB" && vr != "OW")) refuse(e, "has no length");
    enter(levels, Level::Kind::kFragments, e, level.encoding);
  } else {
    at += e.length;
  }
}

std::size_t StructureWalk::walk(std::size_t from, Encoding encoding) {
  std::vector<Level> levels = {{Level::Kind::kItem, bytes_.size(), true, encoding}};
  std::size_t at = from;
  while (true) {
    while (!levels.empty() && levels.back().has_length && at == levels.back().end) levels.pop_back();
    if (levels.empty()) return at;
    if (levels.size() == 1 && bytes_.find_first_not_of('\0', at) == std::string_view::npos) return at;
    if (at == levels.back().end)
      throw UserError(name_ + ": a sequence has no end; it is cut off, export it again");
    step_into(levels, at);
  }
}

std::string unpacked(std::string_view bytes, const std::string& name) {
  GzipReader reader(bytes, GzipReader::Format::kRawDeflate);
  std::string all, piece(kPiece, '\0');
  while (true) {
    const auto got = reader.read(piece);
    if (!got) throw UserError(name + ": its deflated data set is damaged or cut short; export it again");
    all.append(piece, 0, *got);
    if (all.size() > kMostUnpacked)
      throw UserError(name + ": its deflated data set is over 512 MiB; export it uncompressed");
    if (*got < piece.size()) return all;
  }
}

}  // namespace

bool begins_as_dicom(std::string_view bytes) {
  if (bytes.size() > 132 && bytes.substr(128, 4) == "DICM") return true;
  if (bytes.size() < 16) return false;
  if (bytes.starts_with("DICM")) return true;
  const std::string name;
  const StructureWalk walk(bytes, name);
  const auto first = walk.guess(0);
  const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(bytes[n]); };
  const unsigned group = byte(0) | byte(1) << 8U, element = byte(2) | byte(3) << 8U;
  if (group == 2) return first && !first->is_implicit && element < 0x0200;
  return group == 8 && first && element <= 0x0070 && (!first->is_implicit || (byte(6) == 0 && byte(7) == 0));
}

DicomLayout dicom_layout(std::string_view bytes, const std::string& name) {
  StructureWalk walk(bytes, name);
  const bool has_preamble = bytes.size() > 132 && bytes.substr(128, 4) == "DICM";
  DicomLayout layout;
  bool is_length_right = true;
  layout.begin = walk.walk_meta(has_preamble ? 132 : (bytes.starts_with("DICM") ? 4 : 0),
                                layout.transfer_syntax, is_length_right);
  layout.end = bytes.size();
  layout.is_plain = has_preamble && is_length_right;
  std::string& syntax = layout.transfer_syntax;
  if (syntax == UID_DeflatedExplicitVRLittleEndianTransferSyntax) {
    const std::string data = unpacked(bytes.substr(layout.begin), name);
    StructureWalk(data, name).walk(0, {});
    return layout;
  }
  const bool is_little =
      syntax == UID_LittleEndianImplicitTransferSyntax || syntax == UID_LittleEndianExplicitTransferSyntax;
  if (const auto own = walk.guess(layout.begin);
      own && (syntax.empty() || (is_little && !own->is_big_endian))) {
    const std::string found = own->is_big_endian ? UID_BigEndianExplicitTransferSyntax
                              : own->is_implicit ? UID_LittleEndianImplicitTransferSyntax
                                                 : UID_LittleEndianExplicitTransferSyntax;
    layout.is_plain = layout.is_plain && syntax == found;
    syntax = found;
  }
  const DcmXfer xfer(syntax.c_str());
  // Its table has entries beside the standard's, one without a UID.
  if (xfer.getXfer() == EXS_Unknown || !syntax.starts_with("1.2.840.10008.1.2"))
    throw UserError(name +
                    ": Transfer Syntax UID (0002,0010): is missing or not known; export it as explicit VR "
                    "little endian");
  layout.end =
      walk.walk(layout.begin, {xfer.isImplicitVR() != OFFalse, xfer.getByteOrder() == EBO_BigEndian});
  return layout;
}

}  // namespace brachy
