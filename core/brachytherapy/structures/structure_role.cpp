#include "core/brachytherapy/structures/structure_role.h"

#include <algorithm>
#include <array>

#include "core/brachytherapy/structures/name_words.h"
#include "core/brachytherapy/structures/structure_names.h"

namespace brachy {
namespace {

struct RoleWord {
  StructureRole role;
  const char* word;
};
constexpr std::array kRoleWords = {RoleWord{StructureRole::kOther, "other"},
                                   RoleWord{StructureRole::kGland, "prostate"},
                                   RoleWord{StructureRole::kTarget, "target"},
                                   RoleWord{StructureRole::kUrethra, "urethra"},
                                   RoleWord{StructureRole::kRectum, "rectum"},
                                   RoleWord{StructureRole::kBladder, "bladder"},
                                   RoleWord{StructureRole::kPubicArch, "pubic_arch"},
                                   RoleWord{StructureRole::kSeminalVesicles, "seminal_vesicles"},
                                   RoleWord{StructureRole::kPenileBulb, "penile_bulb"},
                                   RoleWord{StructureRole::kFemoralHead, "femoral_head"},
                                   RoleWord{StructureRole::kBowel, "bowel"},
                                   RoleWord{StructureRole::kBody, "body"}};

using Words = std::vector<std::string>;

bool is_number(const std::string& word) {
  return word[0] >= '0' && word[0] <= '9';
}

Words without_numbers(Words words) {
  std::erase_if(words, is_number);
  return words;
}

/// Whether `words` has a run that reads `joined` in one piece.
bool has_run(const Words& words, const std::string& joined) {
  for (std::size_t first = 0; first < words.size(); ++first) {
    std::string run;
    for (std::size_t n = first; n < words.size() && run.size() < joined.size(); ++n) {
      run += words[n];
      if (run == joined) return true;
    }
  }
  return false;
}

constexpr std::size_t kLongWord = 5;  // bytes: "blase" in "blasenwand", but not "reto" in "retorno"

bool begins_with(const Words& words, const std::string& joined) {
  return joined.size() >= kLongWord &&
         std::ranges::any_of(words, [&](const std::string& word) { return word.starts_with(joined); });
}

/// A name in the two ways that it can be read: in words by capitals, or not.
struct ReadName {
  explicit ReadName(std::string_view name)
      : all(name_words(name)),
        camel(without_numbers(all)),
        plain(without_numbers(name_words(name, false))),
        joined(joined_words(camel)),
        has_numbers(camel.size() != all.size()) {}
  Words all, camel, plain;
  std::string joined;
  bool has_numbers;

  /// As a word, or a long one as several.
  bool has(const std::string& word) const {
    const auto is_among = [&](const Words& words) { return std::ranges::find(words, word) != words.end(); };
    if (is_among(camel) || is_among(plain)) return true;
    return word.size() >= kLongWord && (has_run(camel, word) || has_run(plain, word));
  }
  bool has_any(const std::vector<std::string>& words) const {
    return std::ranges::any_of(words, [&](const std::string& word) { return has(word); });
  }
};

/// CTV, target, PTV, GTV, which come in this order where a file has no gland.
std::optional<std::uint8_t> target_fit(const ReadName& name) {
  const StructureNames& table = name_table();
  for (std::size_t fit = 0; fit < table.targets.size(); ++fit)
    for (const std::string& word : table.targets[fit])
      if (name.has(word) ||
          (word.size() == 3 && word.ends_with("tv") &&
           std::ranges::any_of(name.plain, [&](const std::string& w) { return w.starts_with(word); })))
        return static_cast<std::uint8_t>(fit);
  return std::nullopt;
}

bool is_aid(const ReadName& name, std::string_view text) {
  if (text.find('%') != std::string_view::npos) return true;
  // TG-263: "z" begins the name of what only optimisation uses.
  if (!name.all.empty() && (name.all.front() == "z" || name.all.front() == "zz" || name.all.front() == "zzz"))
    return true;
  return name.has_any(name_table().aids);
}

/// The organs that a name tells of, in the table's order.
std::vector<StructureRole> roles_in(const ReadName& name) {
  std::vector<StructureRole> found;
  for (const StructureNames::Organ& organ : name_table().organs)
    for (const std::string& word : organ.names)
      if (name.has(word) || begins_with(name.camel, word) || begins_with(name.plain, word)) {
        if (std::ranges::find(found, organ.role) == found.end()) found.push_back(organ.role);
        break;
      }
  return found;
}

}  // namespace

const char* role_word(StructureRole role) {
  return std::ranges::find(kRoleWords, role, &RoleWord::role)->word;
}

std::optional<StructureRole> role_of_word(std::string_view word) {
  const auto found =
      std::ranges::find(kRoleWords, word, [](const RoleWord& r) { return std::string_view(r.word); });
  return found == kRoleWords.end() ? std::nullopt : std::optional(found->role);
}

std::vector<std::string> role_words() {
  std::vector<std::string> words;
  for (const RoleWord& r : kRoleWords) words.emplace_back(r.word);
  return words;
}

bool is_unique(StructureRole role) {
  using enum StructureRole;
  return role == kGland || role == kUrethra || role == kRectum || role == kBladder || role == kPubicArch;
}

NamedRole role_of_name(std::string_view text) {
  using enum StructureRole;
  const ReadName name(text);
  const StructureNames& table = name_table();
  if (name.joined.empty()) return {};
  for (const StructureNames::Organ& organ : table.organs)
    if (std::ranges::find(organ.names, name.joined) != organ.names.end())
      return {organ.role, name.has_numbers ? NamedRole::kContained : NamedRole::kExact};
  const auto target = target_fit(name);
  if (is_aid(name, text)) return {};
  if (name.has_any(table.others)) return {};
  const std::vector<StructureRole> roles = roles_in(name);
  if (target) {
    // "Rectum-PTV" is none; "CTV_Prostate" comes before "CTV".
    if (!roles.empty() && roles.front() != kGland) return {};
    return {kTarget, static_cast<std::uint8_t>(2 * *target + (roles.empty() ? 1 : 0))};
  }
  if (roles.empty()) return {};
  const bool has_gland = roles.front() == kGland;
  // "Urethra_Prostate" is the urethra in the gland, "Prostate-Urethra" the gland without it.
  if (has_gland && roles.size() > 1 && roles[1] == kUrethra) {
    if (text.find('-') != std::string_view::npos) return {};
    return {kUrethra, NamedRole::kContained};
  }
  if (roles.size() > 1) return {roles.front(), NamedRole::kPart};
  const bool is_part =
      name.has_any(table.parts) || (is_unique(roles.front()) && side_of_name(text) != BodySide::kNone);
  return {roles.front(), is_part ? NamedRole::kPart : NamedRole::kContained};
}

std::vector<std::size_t> best_named(const std::vector<std::string>& names, StructureRole role) {
  std::vector<std::size_t> best;
  std::uint8_t least = UINT8_MAX;
  for (std::size_t n = 0; n < names.size(); ++n) {
    const NamedRole named = role_of_name(names[n]);
    if (named.role != role || named.fit > least) continue;
    if (named.fit < least) best.clear();
    least = named.fit;
    best.push_back(n);
  }
  if (best.empty() && role == StructureRole::kGland) return best_named(names, StructureRole::kTarget);
  return best;
}

BodySide side_of_name(std::string_view text) {
  const StructureNames& table = name_table();
  const Words words = name_words(text);
  bool is_left = false, is_right = false;
  for (std::size_t n = 0; n < words.size(); ++n) {
    // "L5" is a vertebra.
    if (words[n].size() == 1 && n + 1 < words.size() && is_number(words[n + 1])) continue;
    if (words[n] == "der" && n + 1 < words.size()) continue;  // German's article, or Spanish's right
    is_left |= std::ranges::find(table.left, words[n]) != table.left.end();
    is_right |= std::ranges::find(table.right, words[n]) != table.right.end();
  }
  if (is_left == is_right) return BodySide::kNone;
  return is_left ? BodySide::kLeft : BodySide::kRight;
}

}  // namespace brachy
