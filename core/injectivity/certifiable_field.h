#pragma once

#include <cstddef>

#include "core/injectivity/cell_field.h"

namespace brachy {

/// What the injectivity certificate needs of a field.
class CertifiableField {
 public:
  virtual ~CertifiableField() = default;

  /// The field cell by cell; valid until it is evaluated again. Real-time: does not allocate.
  virtual const CellField& cells() noexcept = 0;
  /// The most sources that cells() can have.
  virtual std::size_t max_sources() const = 0;
};

}  // namespace brachy
