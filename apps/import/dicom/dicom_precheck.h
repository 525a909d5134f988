#pragma once

#include <string>
#include <string_view>

namespace brachy {

/// Checks what DCMTK would trust, before it reads a file of DICOM part 10: every length lies within the file, so that
/// none asks for more memory than there is data; sequences are at most 32 deep, as DCMTK reads them by recursion; the
/// transfer syntax is named; a deflated data set unpacks to 512 MiB at most. `bytes` begin behind "DICM". Values are
/// not looked at.
/// Errors: UserError "name: what; fix". Threads: any, once DCMTK's dictionary is loaded.
void check_dicom_structure(std::string_view bytes, const std::string& name);

}  // namespace brachy
