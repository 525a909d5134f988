#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Which source a seed is; values go over the wire: append only. From kFirstOfFiles on they are those of source files
/// (core/brachytherapy/dose/source_file.h), numbered by each process as it reads them.
enum class SourceModel : std::uint16_t {
  kAmersham6711 = 1,       ///< I-125, Amersham/GE OncoSeed 6711; "6711"
  kTheraSeed200 = 2,       ///< Pd-103, Theragenics TheraSeed 200; "200"
  kIsoRayCs1 = 3,          ///< Cs-131, IsoRay CS-1 Rev2; "cs1-rev2"
  kMicroSelectronV2 = 4,   ///< Ir-192 HDR, Nucletron mHDR-v2; "mhdr-v2"
  kGammaMedPlusHdr = 5,    ///< Ir-192 HDR, Varian GammaMed Plus; "gammamed-hdr"
  kFlexisource = 6,        ///< Ir-192 HDR, Isodose Control (Elekta) Flexisource; "flexisource"
  kSpecM19 = 7,            ///< Ir-192 HDR, SPEC M-19; "spec-m-19"
  kVs2000 = 8,             ///< Ir-192 HDR, Varian VariSource VS2000; "vs2000"
  kVariSourceClassic = 9,  ///< Ir-192 HDR, Varian VariSource, 1 cm; "varisource"
  kGammaMedPlusPdr = 10,   ///< Ir-192 PDR, Varian GammaMed Plus; "gammamed-pdr"
  kFirstOfFiles = 1000,
};

/// A seed as a source of dose: position, direction, strength.
struct DoseSeed {
  Vec3 position;  ///< its centre, mm, world frame W
  /// unit, along its length; of a source on a cable away from the cable, of others either way (Tg43Source)
  Vec3 axis;
  SourceModel source = SourceModel::kAmersham6711;
  double air_kerma_strength_u = 0;  ///< at the time of implantation; 1 U = 1 cGy cm²/h
};

}  // namespace brachy
