#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "net/wire/messages.h"

namespace brachy::net {

/// The token in a file of exactly kTokenBytes. Throws UserError with the fix: not there, not a regular file, of another
/// size, another user's, or one that others may read.
Token load_token(const std::filesystem::path& file);

/// Makes one of random bytes, for its owner alone. Throws UserError: `file` is there already, or cannot be written.
void make_token(const std::filesystem::path& file);

/// 64 digits, as the viewer's address takes it.
std::string to_hex(const Token& token);
/// nullopt: not 64 digits.
std::optional<Token> from_hex(std::string_view hex);

}  // namespace brachy::net
