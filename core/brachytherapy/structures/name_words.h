#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace brachy {

/// A structure's name in words of lower case without accents: "Urethra_Prostatc" → urethra, prostatc;
/// "PTVProstate+5mm" → ptv, prostate, 5, mm; "Harnröhre", "HARNROEHRE" → harnrohre. Words end at what is no letter or
/// digit, between letters and digits, and, with `camel`, where a capital follows a small letter. Text is UTF-8, or,
/// where it is not, Latin-1. Of ä, ae and a, and so for other letters, one is written, so that all spellings agree.
std::vector<std::string> name_words(std::string_view name, bool camel = true);

/// name_words in one piece: "urethraprostatc".
std::string joined_words(const std::vector<std::string>& words);

/// ASCII for a name that a file or a scene can have: accents go as a reader of the language would write them without
/// ("Harnröhre" → "Harnroehre", "pęcherz" → "pecherz"); other bytes stay.
std::string without_accents(std::string_view name);

}  // namespace brachy
