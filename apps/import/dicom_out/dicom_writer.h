#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/import/dicom/dicom_file.h"

class DcmSequenceOfItems;

namespace brachy {

/// What all objects of an export share. UIDs are computed from the content, so that the same export has the same ones.
struct ExportIds {
  std::string study, frame;               ///< UIDs
  std::string structure_set, plan, dose;  ///< SOP instance UIDs
  std::string patient;                    ///< the scene's name: no person's
  std::string date;                       ///< YYYYMMDD of the sources' strength
  /// What the objects have of the patient's own study, in place of the defaults: a tag and its value.
  std::vector<std::pair<DicomTag, std::string>> own;
};
ExportIds make_ids(std::string_view content, const std::string& patient, const std::string& date);

/// Takes the patient, the study and the frame of reference of one of their files, so that the export belongs to them.
/// Errors: UserError "FILE: …" where it is no DICOM file or has no study or frame of reference.
void take_study(const std::filesystem::path& file, ExportIds& ids);

/// A UID below 2.25 (PS3.5, B.2) from a text.
std::string uid_of(std::string_view text);

/// A number as a decimal string: at most 16 characters, as many digits as fit.
std::string decimal_string(double value);
std::string decimal_string(const Vec3& v);  ///< LPS from RAS, with backslashes

/// Fills a data set or an item. Errors: std::runtime_error where DCMTK refuses a value, which is a programming error.
class DicomWriter {
 public:
  explicit DicomWriter(DcmItem* item) : item_(item) {}
  DicomWriter& put(const DicomTag& tag, const std::string& value);
  DicomWriter& put(const DicomTag& tag, double value) { return put(tag, decimal_string(value)); }
  DicomWriter& put_count(const DicomTag& tag, std::size_t value) { return put(tag, std::to_string(value)); }
  DicomWriter& put_tag(const DicomTag& tag, const DicomTag& value);  ///< of an attribute tag
  DicomWriter& put_word(const DicomTag& tag, unsigned short value);  ///< US
  /// One more item of a sequence.
  DicomWriter item(const DicomTag& sequence);
  void put_pixels(const std::vector<std::uint32_t>& values, int bits);
  DcmItem* get() const { return item_; }

 private:
  DcmItem* item_;
};

/// A new object: patient, study, series, equipment and SOP common. Write it with save().
class DicomObject {
 public:
  DicomObject(const ExportIds& ids, const std::string& sop_class, const std::string& sop_instance,
              const std::string& modality);
  ~DicomObject();
  DicomWriter data();
  /// Explicit VR little endian. Errors: UserError.
  void save(const std::filesystem::path& file);

 private:
  std::unique_ptr<DcmFileFormat> file_;
};

}  // namespace brachy
