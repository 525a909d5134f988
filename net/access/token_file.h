#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "net/wire/messages.h"

namespace brachy::net {

/// Reads the token in a file of exactly kTokenBytes. Throws UserError with the fix: the file does not exist, is not
/// regular, has another size, belongs to another user, or is readable by others.
Token load_token(const std::filesystem::path& file);

/// Writes a token of random bytes, readable by its owner alone. Throws UserError: `file` exists or cannot be written.
void make_token(const std::filesystem::path& file);

/// 64 hexadecimal digits, as in the viewer's address.
std::string to_hex(const Token& token);
/// nullopt: not 64 digits.
std::optional<Token> from_hex(std::string_view hex);

}  // namespace brachy::net
