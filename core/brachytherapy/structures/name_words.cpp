#include "core/brachytherapy/structures/name_words.h"

#include <array>
#include <cstdint>
#include <optional>

namespace brachy {
namespace {

/// The letters from U+00C0 to U+017F as one writes them without accents. Æ, Ä, Ö, Ø, Ü, Å, Œ, ß have two letters.
constexpr std::array<const char*, 192> kPlain = {
    "A",  "A",  "A",  "A",  "Ae", "Aa", "Ae", "C",  "E",  "E", "E",  "E", "I",  "I",  "I", "I", "D", "N",
    "O",  "O",  "O",  "O",  "Oe", "",   "Oe", "U",  "U",  "U", "Ue", "Y", "Th", "ss", "a", "a", "a", "a",
    "ae", "aa", "ae", "c",  "e",  "e",  "e",  "e",  "i",  "i", "i",  "i", "d",  "n",  "o", "o", "o", "o",
    "oe", "",   "oe", "u",  "u",  "u",  "ue", "y",  "th", "y", "A",  "a", "A",  "a",  "A", "a", "C", "c",
    "C",  "c",  "C",  "c",  "C",  "c",  "D",  "d",  "D",  "d", "E",  "e", "E",  "e",  "E", "e", "E", "e",
    "E",  "e",  "G",  "g",  "G",  "g",  "G",  "g",  "G",  "g", "H",  "h", "H",  "h",  "I", "i", "I", "i",
    "I",  "i",  "I",  "i",  "I",  "i",  "Ij", "ij", "J",  "j", "K",  "k", "k",  "L",  "l", "L", "l", "L",
    "l",  "L",  "l",  "L",  "l",  "N",  "n",  "N",  "n",  "N", "n",  "n", "N",  "n",  "O", "o", "O", "o",
    "Oe", "oe", "Oe", "oe", "R",  "r",  "R",  "r",  "R",  "r", "S",  "s", "S",  "s",  "S", "s", "S", "s",
    "T",  "t",  "T",  "t",  "T",  "t",  "U",  "u",  "U",  "u", "U",  "u", "U",  "u",  "U", "u", "U", "u",
    "W",  "w",  "Y",  "y",  "Y",  "Z",  "z",  "Z",  "z",  "Z", "z",  "s"};

/// The code point at `at`, which is advanced past it; nothing where the bytes are no UTF-8.
std::optional<std::uint32_t> next_code_point(std::string_view text, std::size_t& at) {
  const auto first = static_cast<unsigned char>(text[at]);
  const std::size_t length = first < 0x80 ? 1 : first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc2 ? 2 : 0;
  if (length == 0 || first > 0xf4 || at + length > text.size()) return std::nullopt;
  std::uint32_t code = length == 1 ? first : first & (0xffU >> (length + 1));
  for (std::size_t n = 1; n < length; ++n) {
    const auto byte = static_cast<unsigned char>(text[at + n]);
    if ((byte & 0xc0U) != 0x80) return std::nullopt;
    code = code << 6 | (byte & 0x3fU);
  }
  at += length;
  return code;
}

void append_utf8(std::string& text, std::uint32_t code) {
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xc0 | code >> 6);
    text += static_cast<char>(0x80 | (code & 0x3f));
  } else if (code < 0x10000) {
    text += static_cast<char>(0xe0 | code >> 12);
    text += static_cast<char>(0x80 | (code >> 6 & 0x3f));
    text += static_cast<char>(0x80 | (code & 0x3f));
  } else {
    text += static_cast<char>(0xf0 | code >> 18);
    text += static_cast<char>(0x80 | (code >> 12 & 0x3f));
    text += static_cast<char>(0x80 | (code >> 6 & 0x3f));
    text += static_cast<char>(0x80 | (code & 0x3f));
  }
}

/// Full-width letters of Japanese and Chinese systems as ASCII; parts of Korean syllables, as a Macintosh writes them
/// in names of files, as the syllable (Unicode, 3.12).
void append_composed(std::vector<std::uint32_t>& codes, std::uint32_t code) {
  constexpr std::uint32_t kSyllables = 0xac00, kVowels = 21, kEnds = 28;
  const std::uint32_t last = codes.empty() ? 0 : codes.back();
  if (code >= 0xff01 && code <= 0xff5e)
    codes.push_back(code - 0xfee0);
  else if (code >= 0x1161 && code <= 0x1175 && last >= 0x1100 && last <= 0x1112)
    codes.back() = kSyllables + ((last - 0x1100) * kVowels + code - 0x1161) * kEnds;
  else if (code > 0x11a7 && code <= 0x11c2 && last >= kSyllables && last <= 0xd7a3 &&
           (last - kSyllables) % kEnds == 0)
    codes.back() += code - 0x11a7;
  else
    codes.push_back(code);
}

std::vector<std::uint32_t> code_points(std::string_view text) {
  std::vector<std::uint32_t> codes;
  for (std::size_t at = 0; at < text.size();) {
    if (const auto code = next_code_point(text, at)) {
      append_composed(codes, *code);
      continue;
    }
    codes.clear();
    for (const char byte : text) codes.push_back(static_cast<unsigned char>(byte));
    break;
  }
  return codes;
}

bool is_accented(std::uint32_t code) {
  return code >= 0xc0 && code < 0xc0 + kPlain.size() && code != 0xd7 && code != 0xf7;
}
bool is_combining(std::uint32_t code) {
  return code >= 0x300 && code <= 0x36f;
}
/// Dashes, quotes, blanks and punctuation beyond ASCII.
bool is_sign(std::uint32_t code) {
  return (code >= 0x80 && code < 0xc0) || code == 0xd7 || code == 0xf7 ||
         (code >= 0x2000 && code <= 0x206f) || (code >= 0x3000 && code <= 0x303f) ||
         (code >= 0xff00 && code <= 0xff0f);
}

/// Cyrillic and Greek capitals in lower case, their accents gone.
std::uint32_t lower_beyond_latin(std::uint32_t code) {
  if (code == 0x401 || code == 0x451) return 0x435;  // Ё as Е
  if (code == 0x419 || code == 0x439) return 0x438;  // Й as И
  if (code == 0x3c2) return 0x3c3;                   // ς ends words in small letters alone
  if (code >= 0x410 && code <= 0x42f) return code + 0x20;
  if (code >= 0x391 && code <= 0x3a9) return code + 0x20;
  constexpr std::array<std::array<std::uint32_t, 2>, 14> kTonos = {{{0x386, 0x3b1},
                                                                    {0x388, 0x3b5},
                                                                    {0x389, 0x3b7},
                                                                    {0x38a, 0x3b9},
                                                                    {0x38c, 0x3bf},
                                                                    {0x38e, 0x3c5},
                                                                    {0x38f, 0x3c9},
                                                                    {0x3ac, 0x3b1},
                                                                    {0x3ad, 0x3b5},
                                                                    {0x3ae, 0x3b7},
                                                                    {0x3af, 0x3b9},
                                                                    {0x3cc, 0x3bf},
                                                                    {0x3cd, 0x3c5},
                                                                    {0x3ce, 0x3c9}}};
  for (const auto& [with, bare] : kTonos)
    if (code == with) return bare;
  return code;
}

/// ae → a, oe → o, ue → u, aa → a: the spellings of ä, ö, ü and å.
std::string of_one_spelling(const std::string& word) {
  std::string one;
  for (const char c : word) {
    const char last = one.empty() ? '\0' : one.back();
    if (c == 'e' && (last == 'a' || last == 'o' || last == 'u')) continue;
    if (c == 'a' && last == 'a') continue;
    one += c;
  }
  return one;
}

}  // namespace

std::vector<std::string> name_words(std::string_view name, bool camel) {
  enum class Kind { kNone, kSmall, kCapital, kDigit };
  std::vector<std::string> words;
  std::string word;
  Kind last = Kind::kNone;
  std::size_t last_letters = 1;  // "Ae" of Ä are two
  const auto end_word = [&] {
    if (!word.empty()) words.push_back(of_one_spelling(word));
    word.clear();
  };
  for (const std::uint32_t code : code_points(name)) {
    if (is_combining(code)) continue;
    std::string letters;
    Kind kind = Kind::kNone;
    if (code < 0x80) {
      const auto c = static_cast<char>(code);
      if (c >= '0' && c <= '9') kind = Kind::kDigit;
      if (c >= 'a' && c <= 'z') kind = Kind::kSmall;
      if (c >= 'A' && c <= 'Z') kind = Kind::kCapital;
      letters = c;
    } else if (is_accented(code)) {
      letters = kPlain[code - 0xc0];
      kind = letters[0] >= 'A' && letters[0] <= 'Z' ? Kind::kCapital : Kind::kSmall;
    } else if (!is_sign(code)) {
      kind = Kind::kSmall;
      append_utf8(letters, lower_beyond_latin(code));
    }
    if (kind == Kind::kNone) {
      end_word();
      last = kind;
      continue;
    }
    if (last != Kind::kNone && (kind == Kind::kDigit) != (last == Kind::kDigit)) end_word();
    if (camel && kind == Kind::kCapital && last == Kind::kSmall) end_word();
    // "PTVProstate": the last capital begins the next word.
    if (camel && kind == Kind::kSmall && last == Kind::kCapital && word.size() > last_letters) {
      const std::string begins = word.substr(word.size() - last_letters);
      word.resize(word.size() - last_letters);
      end_word();
      word = begins;
    }
    last_letters = letters.size();
    for (const char c : letters) word += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    last = kind;
  }
  end_word();
  return words;
}

std::string joined_words(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += word;
  return all;
}

std::string without_accents(std::string_view name) {
  std::string plain;
  for (const std::uint32_t code : code_points(name)) {
    if (is_accented(code))
      plain += kPlain[code - 0xc0];
    else if (!is_combining(code))
      append_utf8(plain, code);
  }
  return plain;
}

}  // namespace brachy
