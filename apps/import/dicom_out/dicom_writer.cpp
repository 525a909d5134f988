#include "apps/import/dicom_out/dicom_writer.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "apps/import/dicom/dicom_tags.h"
#include "apps/import/dicom/rt_structure.h"
#include "apps/import/labels/import_limits.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/version.h"
#include "core/geometry/volume/file_bytes.h"

namespace brachy {
namespace {

DcmTagKey dcm_key(const DicomTag& tag) {
  return {tag.group, tag.element};
}

void require_good(const OFCondition& condition, const DicomTag& tag) {
  if (condition.bad()) throw std::runtime_error(tag.text() + ": " + condition.text());
}

// FNV-1a, http://www.isthe.com/chongo/tech/comp/fnv/, with two offsets for 128 bits.
std::uint64_t fnv1a(std::string_view text, std::uint64_t hash) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

}  // namespace

std::string uid_of(std::string_view text) {
  // Two 63-bit halves, written one behind the other.
  const std::uint64_t high = fnv1a(text, 14695981039346656037U) >> 1,
                      low = fnv1a(text, 1099511628211U * 31) >> 1;
  return fmt::format("2.25.{}{:019}", high % 1'000'000'000'000'000'000U + 1,
                     low % 1'000'000'000'000'000'000U);
}

ExportIds make_ids(std::string_view content, const std::string& patient, const std::string& date) {
  const std::string base = uid_of(content);
  return {uid_of(base + "study"),
          uid_of(base + "frame"),
          uid_of(base + "structures"),
          uid_of(base + "plan"),
          uid_of(base + "dose"),
          patient,
          date,
          {}};
}

void take_study(const std::filesystem::path& file, ExportIds& ids) {
  const DicomFile dicom(file_bytes(file, kMostFileBytes), file.string());
  const DicomItem data = dicom.data();
  ids.study = data.text(tag::kStudyInstance);
  ids.frame =
      dicom.modality() == "RTSTRUCT" ? read_rt_structure(dicom).frame : data.text(tag::kFrameOfReference);
  if (ids.study.empty())
    data.refuse(tag::kStudyInstance, "is missing; give another file of the patient's study");
  if (ids.frame.empty())
    data.refuse(tag::kFrameOfReference, "is missing; give the RTSTRUCT or an image of the planning study");
  // Character set, study's date and time, accession number, referring physician, description; the patient; study ID.
  for (const DicomTag kept : {DicomTag{0x0008, 0x0005},
                              {0x0008, 0x0020},
                              {0x0008, 0x0030},
                              {0x0008, 0x0050},
                              {0x0008, 0x0090},
                              {0x0008, 0x1030},
                              {0x0010, 0x0010},
                              {0x0010, 0x0020},
                              {0x0010, 0x0030},
                              {0x0010, 0x0040},
                              {0x0020, 0x0010}})
    if (data.has(kept)) ids.own.emplace_back(kept, data.text(kept));
}

std::string decimal_string(double value) {
  if (value == 0) return "0";
  std::string text = exact_text(value);
  for (int digits = 16; text.size() > 16 && digits > 0; --digits)
    text = fmt::format("{:.{}g}", value, digits);
  return text;
}

std::string decimal_string(const Vec3& v) {
  const Vec3 lps = ras_of_lps(v);
  return decimal_string(lps.x()) + "\\" + decimal_string(lps.y()) + "\\" + decimal_string(lps.z());
}

DicomWriter& DicomWriter::put(const DicomTag& tag, const std::string& value) {
  require_good(item_->putAndInsertString(dcm_key(tag), value.c_str()), tag);
  return *this;
}

DicomWriter& DicomWriter::put_tag(const DicomTag& tag, const DicomTag& value) {
  auto pointer = std::make_unique<DcmAttributeTag>(dcm_key(tag));
  require_good(pointer->putTagVal(dcm_key(value)), tag);
  require_good(item_->insert(pointer.release(), true), tag);
  return *this;
}

DicomWriter& DicomWriter::put_word(const DicomTag& tag, unsigned short value) {
  require_good(item_->putAndInsertUint16(dcm_key(tag), value), tag);
  return *this;
}

DicomWriter DicomWriter::item(const DicomTag& sequence) {
  DcmItem* added = nullptr;
  require_good(item_->findOrCreateSequenceItem(dcm_key(sequence), added, -2), sequence);
  return DicomWriter(added);
}

void DicomWriter::put_pixels(const std::vector<std::uint32_t>& values, int bits) {
  std::vector<Uint16> words;
  words.reserve(values.size() * static_cast<std::size_t>(bits / 16));
  for (const std::uint32_t value : values) {
    words.push_back(static_cast<Uint16>(value & 0xffff));
    if (bits == 32) words.push_back(static_cast<Uint16>(value >> 16));
  }
  require_good(item_->putAndInsertUint16Array(DCM_PixelData, words.data(), words.size()), tag::kPixelData);
}

DicomObject::DicomObject(const ExportIds& ids, const std::string& sop_class, const std::string& sop_instance,
                         const std::string& modality)
    : file_(std::make_unique<DcmFileFormat>()) {
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  DicomWriter out = data();
  out.put(tag::kSopClass, sop_class).put(tag::kSopInstance, sop_instance).put(tag::kModality, modality);
  // Study date and time, accession number, referring physician, manufacturer, operators.
  for (const DicomTag empty :
       {DicomTag{0x0008, 0x0020}, {0x0008, 0x0030}, {0x0008, 0x0050}, {0x0008, 0x0090}, {0x0008, 0x1070}})
    out.put(empty, "");
  out.put({0x0008, 0x0005}, "ISO_IR 192").put({0x0008, 0x0070}, "brachyd");
  out.put({0x0010, 0x0010}, ids.patient).put({0x0010, 0x0020}, ids.patient);
  out.put({0x0010, 0x0030}, "").put({0x0010, 0x0040}, "");
  out.put({0x0018, 0x1020}, std::string(version()));
  out.put(tag::kStudyInstance, ids.study).put(tag::kSeriesInstance, uid_of(sop_instance + "series"));
  out.put({0x0020, 0x0010}, "").put({0x0020, 0x0011}, "1");
  out.put(tag::kFrameOfReference, ids.frame).put({0x0020, 0x1040}, "");
  for (const auto& [kept, value] : ids.own) out.put(kept, value);
}

DicomObject::~DicomObject() = default;

DicomWriter DicomObject::data() {
  return DicomWriter(file_->getDataset());
}

void DicomObject::save(const std::filesystem::path& file) {
  const OFCondition saved = file_->saveFile(file.c_str(), EXS_LittleEndianExplicit);
  if (saved.bad()) throw UserError(file.string() + ": cannot be written (" + saved.text() + ")");
}

}  // namespace brachy
