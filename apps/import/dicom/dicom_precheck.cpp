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
  /// The elements of group 2, in explicit little endian; where they end. `syntax`: (0002,0010).
  std::size_t walk_meta(std::string& syntax);
  void walk(std::size_t from, Encoding encoding);

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
  if (!vr.isStandard()) refuse(e, "has no value representation of the standard");
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

std::size_t StructureWalk::walk_meta(std::string& syntax) {
  std::size_t at = 0;
  Element length;
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
    }
    at = e.value + e.length;
    if (e.number != 0) continue;
    if (e.length != 4 || stated_end) refuse(e, "is not the length of the meta header");
    stated_end = at + number(e.value, 4, false);
    length = e;
  }
  // DCMTK takes the meta header to be as long as it says: else it reads another data set than is walked here.
  if (stated_end && *stated_end != at) refuse(length, "is not the length of the meta header");
  return at;
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
  } else if (is_undefined && vr == "UN") {
    enter(levels, Level::Kind::kSequence, e, {true, false});  // PS3.5, 6.2.2
  } else if (is_undefined) {
    if (e.group != 0x7fe0 || (vr != "OB" && vr != "OW")) refuse(e, "has no length");
    enter(levels, Level::Kind::kFragments, e, level.encoding);
  } else {
    at += e.length;
  }
}

void StructureWalk::walk(std::size_t from, Encoding encoding) {
  std::vector<Level> levels = {{Level::Kind::kItem, bytes_.size(), true, encoding}};
  std::size_t at = from;
  while (true) {
    while (!levels.empty() && levels.back().has_length && at == levels.back().end) levels.pop_back();
    if (levels.empty()) return;
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

void check_dicom_structure(std::string_view bytes, const std::string& name) {
  std::string syntax;
  StructureWalk walk(bytes, name);
  const std::size_t begin = walk.walk_meta(syntax);
  if (syntax == UID_DeflatedExplicitVRLittleEndianTransferSyntax) {
    const std::string data = unpacked(bytes.substr(begin), name);
    StructureWalk(data, name).walk(0, {});
    return;
  }
  const DcmXfer xfer(syntax.c_str());
  // Its table has entries beside the standard's, one without a UID.
  if (xfer.getXfer() == EXS_Unknown || !syntax.starts_with("1.2.840.10008.1.2"))
    throw UserError(name +
                    ": Transfer Syntax UID (0002,0010): is missing or not known; export it as explicit VR "
                    "little endian");
  walk.walk(begin, {xfer.isImplicitVR() != OFFalse, xfer.getByteOrder() == EBO_BigEndian});
}

}  // namespace brachy
