#pragma once

#include <stdexcept>
#include <string>

namespace brachy {

/// The user's input cannot be used. The message is one line that names the file, the place in it and the fix.
/// The programs print it and exit with code 2. Programming errors assert instead.
class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace brachy
