#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// The first line of a file of seeds that fell, the ledger of a session: a row for each, in the order of falling.
/// `planned` is −1 for a seed that is not in the plan, `certified` 0, 1, or 2 for a seed that is fixed outside the
/// tissue, `source` its number, 6711; mm, world frame W.
inline constexpr std::string_view kSeedHeader =
    "seed,tick,t_s,needle,planned,certified,source,strength_u,x,y,z,ax,ay,az,"
    "rest_x,rest_y,rest_z,rest_ax,rest_ay,rest_az,gland_x,gland_y,gland_z";

/// One line without its end; numbers have enough digits that the same bits are read back. The present position is not
/// included.
std::string seed_row(const Seed& seed);

/// Parses such a text; `name` stands for the file in errors. Position and axis are those at rest. No rows: no seeds.
/// Throws UserError "name:line: what; fix" also where ids are not 1, 2, 3, ….
std::vector<Seed> parse_seeds(std::string_view text, const std::string& name);

/// parse_seeds of a file. Throws UserError, also where it is not a readable regular file.
std::vector<Seed> load_seeds(const std::filesystem::path& file);

/// Seeds that lie in a body: of such a ledger, or of a table for doses (dose_seed_file.h), whichever its first line
/// says. Of a table's seeds no more is known than where they are and what they hold: they are at rest there, of no
/// needle and of no plan. Throws UserError as load_seeds and load_dose_seeds.
std::vector<Seed> load_seeds_in_place(const std::filesystem::path& file);

/// Seeds that are there when a session starts: at rest, of no needle and no plan, numbered 1, 2, ….
std::vector<Seed> seeds_at_start(std::span<const DoseSeed> seeds);

/// Where they are at rest.
std::vector<DoseSeed> at_rest(std::span<const Seed> seeds);
/// Their middles, mm.
std::vector<Vec3> middles_of(std::span<const DoseSeed> seeds);

}  // namespace brachy
