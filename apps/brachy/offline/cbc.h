#pragma once

#include <string>

namespace brachy {

/// Solves a mixed integer programme (CPLEX's LP format) with COIN-OR's CBC in a process of its own, `cbc` on the PATH
/// (Debian: coinor-cbc), for at most `seconds` of wall time, and returns the text of the best solution found.
/// Errors: UserError where there is no cbc, or it found no solution in that time.
std::string solve_with_cbc(const std::string& programme, double seconds);

}  // namespace brachy
