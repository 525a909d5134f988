#pragma once

#include <stdexcept>
#include <string>

namespace brachy {

/// What the user gave cannot be used: the message is one line that names the file, the place in it and the fix.
/// The programs print it and exit with 2. A developer's bug asserts instead.
class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace brachy
