#include "apps/import/case/case_roles.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/brachytherapy/structures/name_words.h"

namespace brachy {
namespace {

using Structures = std::vector<ImportedStructure>;
using Role = StructureRole;

const std::string& file_name(const ImportedStructure& s) {
  return s.file_name.empty() ? s.name : s.file_name;
}

std::string listed(const Structures& all, const std::vector<std::size_t>& which) {
  constexpr std::size_t kMost = 12;
  std::string text;
  for (std::size_t n = 0; n < std::min(which.size(), kMost); ++n)
    text += fmt::format("{}\"{}\" ({:.3g} cc)", n == 0 ? "" : ", ", one_short_line(file_name(all[which[n]])),
                        all[which[n]].surface_cc);
  return which.size() > kMost ? text + ", …" : text;
}

std::vector<std::size_t> all_of(const Structures& all) {
  std::vector<std::size_t> which(all.size());
  for (std::size_t n = 0; n < which.size(); ++n) which[n] = n;
  return which;
}

/// The structure with that name in the file or the scene; then with the same words, whatever their case and separators.
std::size_t named(const Structures& all, const std::string& name, const std::string& option) {
  const std::string words = joined_words(name_words(name));
  for (int way = 0; way < 3; ++way) {
    std::vector<std::size_t> found;
    for (std::size_t n = 0; n < all.size(); ++n)
      if (way == 0   ? all[n].file_name == name
          : way == 1 ? all[n].name == name
                     : !words.empty() && joined_words(name_words(file_name(all[n]))) == words)
        found.push_back(n);
    if (found.size() > 1)
      throw UserError(option + ": \"" + one_short_line(name) + "\" is the name of several: " +
                      listed(all, found) + "; give the name that import.json has");
    if (!found.empty()) return found.front();
  }
  throw UserError(option + ": there is no structure \"" + one_short_line(name) + "\"; choose from " +
                  listed(all, all_of(all)));
}

std::string option_for(StructureRole role) {
  return role == Role::kGland ? "--gland \"NAME\"" : "--role " + std::string(role_word(role)) + "=\"NAME\"";
}

/// The structures of these that fit `role` best by their names; a role that is given does not count.
std::vector<std::size_t> best_for(const Structures& all, const std::vector<bool>& is_given,
                                  StructureRole role) {
  std::vector<std::string> names;
  for (std::size_t n = 0; n < all.size(); ++n)
    names.push_back(is_given[n] ? std::string() : file_name(all[n]));
  return best_named(names, role);
}

void take_given(const ImportOptions& options, Structures& all, std::vector<bool>& is_given) {
  const auto give = [&](StructureRole role, const std::string& name, const std::string& option) {
    const std::size_t n = named(all, name, option);
    if (is_given[n])
      throw UserError(option + ": \"" + one_short_line(name) + "\" has a role already; give it one");
    if (is_unique(role))
      for (std::size_t other = 0; other < all.size(); ++other)
        if (is_given[other] && all[other].role == role)
          throw UserError(option + ": two structures cannot be the " + role_word(role) + "; name one");
    all[n].role = role;
    is_given[n] = true;
  };
  if (!options.gland.empty()) give(Role::kGland, options.gland, "--gland");
  for (const std::string& text : options.roles) {
    const std::size_t equals = text.find('=');
    const auto role = role_of_word(text.substr(0, equals));
    if (equals == std::string::npos || !role) {
      std::string words;
      for (const std::string& word : role_words()) words.append(words.empty() ? "" : ", ").append(word);
      throw UserError("--role " + one_short_line(text) + ": must be ROLE=NAME, with a role of " + words);
    }
    give(*role, text.substr(equals + 1), "--role " + std::string(role_word(*role)));
  }
}

bool is_number(const std::string& word) {
  return word[0] >= '0' && word[0] <= '9';
}

/// Words of TotalSegmentator's names and the like, which are no person's; and numbers.
bool is_body_word(const std::string& word) {
  static constexpr std::array kWords = {
      "left",       "right",   "hip",        "sacrum",     "femur",   "gluteus",  "maximus",
      "medius",     "minimus", "iliac",      "artery",     "vena",    "vein",     "iliopsoas",
      "autochthon", "small",   "bowel",      "colon",      "kidney",  "gland",    "vertebra",
      "vertebrae",  "spinal",  "cord",       "skin",       "muscle",  "muscles",  "head",
      "wall",       "spleen",  "liver",      "duodenum",   "aorta",   "inferior", "superior",
      "cava",       "body",    "trunc",      "urinary",    "seminal", "vesicle",  "vesicles",
      "penile",     "bulb",    "pubic",      "symphysis",  "anal",    "canal",    "sphincter",
      "levator",    "ani",     "obturator",  "lymph",      "node",    "nodes",    "neurovascular",
      "bundle",     "zone",    "peripheral", "transition", "central", "lesion",   "tumor",
      "tumour"};
  return is_number(word) || std::ranges::any_of(kWords, [&](const char* known) {
           return word == joined_words(name_words(known));
         });
}

/// Whether the name is of the body, and neither a prostate's nor a target's.
bool is_another_organ(const std::string& name) {
  const std::vector<std::string> words = name_words(name);
  const StructureRole role = role_of_name(name).role;
  if (role == Role::kGland || role == Role::kTarget) return false;
  return role != Role::kOther ||
         (std::ranges::all_of(words, is_body_word) && !std::ranges::all_of(words, is_number));
}

std::size_t find_gland(const ImportedCase& imported, const std::vector<bool>& is_given) {
  const Structures& all = imported.structures;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (all[n].role == Role::kGland) return n;
  const std::vector<std::size_t> best = best_for(all, is_given, Role::kGland);
  if (best.size() == 1) return best.front();
  if (best.size() > 1)
    throw UserError("which structure is the prostate? " + listed(all, best) + "; choose with " +
                    option_for(Role::kGland));
  if (all.size() == 1 && !is_another_organ(file_name(all.front()))) return 0;
  throw UserError("no structure is called as a prostate or a target is; the file has " +
                  listed(all, all_of(all)) + "; choose with " + option_for(Role::kGland));
}

void find_organ(ImportedCase& imported, const std::vector<bool>& is_given, StructureRole role) {
  Structures& all = imported.structures;
  if (std::ranges::any_of(all, [&](const auto& s) { return s.role == role; })) return;
  const std::vector<std::size_t> best = best_for(all, is_given, role);
  if (best.empty()) return;
  const bool is_part = role_of_name(file_name(all[best.front()])).fit == NamedRole::kPart;
  if (best.size() > 1 && !is_part)
    throw UserError("which structure is the " + std::string(role_word(role)) + "? " + listed(all, best) +
                    "; choose with " + option_for(role));
  if (best.size() > 1) {
    imported.left.push_back("none of " + listed(all, best) + " is taken for the " + role_word(role) + "; " +
                            option_for(role) + " chooses one");
    return;
  }
  ImportedStructure& organ = all[best.front()];
  organ.role = role;
  if (is_part)
    organ.notes.push_back("may be a part of the " + std::string(role_word(role)) + ", and is taken for it");
}

}  // namespace

std::vector<Structure> as_structures(const ImportedCase& imported) {
  std::vector<Structure> all;
  for (const ImportedStructure& s : imported.structures)
    all.push_back({is_unique(s.role) ? role_word(s.role) : s.name, s.mesh, s.role, file_name(s)});
  return all;
}

void assign_roles(const ImportOptions& options, ImportedCase& imported) {
  Structures& all = imported.structures;
  std::vector<bool> is_given(all.size(), false);
  take_given(options, all, is_given);
  const std::size_t gland = find_gland(imported, is_given);
  const StructureRole called = role_of_name(file_name(all[gland])).role;
  if (!is_given[gland] && called != Role::kGland && !all[gland].file_name.empty())
    imported.warnings.push_back(
        "\"" + file_name(all[gland]) + "\" is " +
        (called == Role::kTarget ? "a target, not an organ," : "not called as a prostate is,") +
        " and is taken for the prostate as there is no other; " + option_for(Role::kGland) +
        (all.size() > 1 ? " chooses another" : " says that it is"));
  all[gland].role = Role::kGland;
  is_given[gland] = true;
  for (const StructureRole role : {Role::kUrethra, Role::kRectum, Role::kBladder, Role::kPubicArch})
    find_organ(imported, is_given, role);
  for (std::size_t n = 0; n < all.size(); ++n)
    if (const StructureRole role = role_of_name(file_name(all[n])).role; !is_given[n] && !is_unique(role))
      all[n].role = role;
  std::rotate(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(gland),
              all.begin() + static_cast<std::ptrdiff_t>(gland) + 1);
  ImportedStructure& first = all.front();
  if (first.name == role_word(Role::kGland)) return;
  // The scene's own word, which names the file of the tissue's surface.
  first.notes.push_back("is the gland, called \"prostate\" in the scene; in the file \"" + first.name + "\"");
  const auto is_used = [&](const std::string& name) {
    return std::ranges::any_of(all, [&](const ImportedStructure& s) { return s.name == name; });
  };
  for (ImportedStructure& other : all)
    if (other.name == role_word(Role::kGland)) {
      other.name = "prostate_other";
      for (int number = 2; std::ranges::count(all, other.name, &ImportedStructure::name) > 1; ++number)
        other.name = "prostate_other_" + std::to_string(number);
    }
  if (!is_used(role_word(Role::kGland))) first.name = role_word(Role::kGland);
}

std::string organ_in_file_name(const std::string& file) {
  const std::string name = std::filesystem::path(file).filename().string();
  const std::string stem = name.substr(0, name.find('.'));
  const NamedRole role = role_of_name(stem);
  std::vector<std::string> words = name_words(stem);
  const bool is_of_body = std::ranges::all_of(words, [](const std::string& word) {
    return is_body_word(word) || role_of_name(word).role != Role::kOther;
  });
  if (is_of_body && !words.empty()) return stem;
  if (role.role == Role::kOther || role.role == Role::kTarget || role.fit == NamedRole::kPart) return {};
  // The rest may be a person's name.
  const BodySide side = side_of_name(stem);
  return std::string(role_word(role.role)) + (side == BodySide::kLeft    ? "_left"
                                              : side == BodySide::kRight ? "_right"
                                                                         : "");
}

}  // namespace brachy
