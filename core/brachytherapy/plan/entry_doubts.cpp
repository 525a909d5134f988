#include "core/brachytherapy/plan/entry_doubts.h"

#include <array>
#include <cmath>

#include "core/base/number_text.h"

namespace brachy {
namespace {

struct Customary {
  const char* nuclide;
  double half_life_days;
  double least_u, most_u;                        // of a seed
  double u_per_mci;                              // of apparent activity (TG-43U1)
  double boost_gy, alone_gy, least_gy, most_gy;  // with external beam, alone; what is accepted
};

constexpr std::array kCustomary = {Customary{"I-125", 59.4, 0.25, 1.2, 1.27, 110, 145, 90, 176},
                                   Customary{"Pd-103", 16.99, 1, 3.6, 1.293, 100, 125, 80, 138},
                                   Customary{"Cs-131", 9.69, 1.2, 4, 0.638, 85, 115, 70, 132}};

const Customary* find_customary(SourceModel model) {
  const Tg43Source& source = tg43_source(model);
  for (const Customary& c : kCustomary)
    if (source.is_permanent && std::abs(source.half_life_days - c.half_life_days) < 0.02 * c.half_life_days)
      return &c;
  return nullptr;
}

bool is_strength_of(const Customary& c, double u) {
  return u >= c.least_u && u <= c.most_u;
}

bool is_prescription_of(const Customary& c, double gy) {
  return gy >= c.least_gy && gy <= c.most_gy;
}

std::string strength_guess(const Customary& c, double u) {
  if (is_strength_of(c, u * 10) || is_strength_of(c, u / 10)) return "is the decimal point right?";
  if (is_strength_of(c, u * c.u_per_mci)) return "is it in mCi?";
  for (const Customary& other : kCustomary)
    if (&other != &c && is_strength_of(other, u)) return std::string("is it ") + other.nuclide + "'s?";
  return "check it";
}

std::string prescription_guess(const Customary& c, double gy) {
  if (is_prescription_of(c, gy * 10) || is_prescription_of(c, gy / 10)) return "is the decimal point right?";
  for (const Customary& other : kCustomary)
    if (&other != &c && is_prescription_of(other, gy)) return std::string("is it ") + other.nuclide + "'s?";
  return "check it";
}

}  // namespace

std::vector<std::string> entry_doubts(const Plan& plan) {
  const Customary* c = find_customary(plan.source);
  if (!c) return {};
  std::vector<std::string> doubts;
  const std::string source = std::string(to_string(plan.source)) + " (" + c->nuclide + ")";
  if (!is_strength_of(*c, plan.air_kerma_strength_u))
    doubts.push_back("the plan's seeds " + source + " have " + text_of(plan.air_kerma_strength_u) +
                     " U, and " + text_of(c->least_u) + " to " + text_of(c->most_u) +
                     " U are customary: " + strength_guess(*c, plan.air_kerma_strength_u));
  if (!is_prescription_of(*c, plan.prescription_gy))
    doubts.push_back("the plan prescribes " + text_of(plan.prescription_gy) + " Gy with " + source +
                     ", and " + text_of(c->alone_gy) + " Gy, or " + text_of(c->boost_gy) +
                     " with external beam, are customary: " + prescription_guess(*c, plan.prescription_gy));
  return doubts;
}

}  // namespace brachy
