#pragma once

#include <string>
#include <string_view>

namespace brachy {

/// Where a file's data set lies, and how it is written.
struct DicomLayout {
  std::size_t begin = 0, end = 0;  ///< of the data set's bytes; behind it are at most zeros
  std::string transfer_syntax;
  bool is_plain = true;  ///< a file of DICOM part 10 that needs no other header
};

/// Whether the bytes begin as a DICOM file: "DICM" behind a preamble of 128 bytes, without one, or a meta header or
/// data set (group 0008) at once, as some programs write them.
bool begins_as_dicom(std::string_view bytes);

/// Checks what DCMTK would trust, before it reads a file: every length lies within the file, so that none asks for more
/// memory than there is data; sequences are at most 32 deep, as DCMTK reads them by recursion; a deflated data set
/// unpacks to 512 MiB at most. Values are not looked at. Where the transfer syntax is missing, or the first element is
/// written otherwise than it says, it is the little-endian one in which that element makes sense. A meta header may
/// state a wrong length, and zeros may follow the data set.
/// Errors: UserError "name: what; fix". Threads: any, once DCMTK's dictionary is loaded.
DicomLayout dicom_layout(std::string_view bytes, const std::string& name);

}  // namespace brachy
