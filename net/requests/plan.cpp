// PLAN: the plan in use, and an operator's request to change it.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kPlanNeedleBytes = 20;  // at least

}  // namespace

void fields(auto& archive, MaybeConst<PlanMessage> auto& message) {
  archive.u16(message.kind);
  archive.u16_bits(message.is_optimising);
  archive.u32(message.change);
  archive.f64(message.air_kerma_strength_u);
  archive.text(message.by, kMaxTextBytes);
  const std::uint16_t count = archive.u16_count(message.needles);
  archive.check(count <= PlanMessage::kMostNeedles, "a plan has too many needles");
  archive.reserved(2);
  archive.items(message.needles, count, kPlanNeedleBytes, [&](auto& needle) {
    archive.u16(needle.number);
    archive.u16_bits(needle.is_begun);
    archive.u32(needle.first_seed);
    archive.f64(needle.depth_mm);
    archive.text(needle.hole, kMaxNameBytes);
    archive.text(needle.train, kMaxTextBytes);
  });
  archive.sections();
}
BRACHY_CODEC(PlanMessage);

Refusal handle_plan(const IncomingRequest& request) {
  PlanMessage plan;
  if (auto refusal = request.decode(plan)) return refusal;
  if (auto refusal = request.refuse_others("PLAN")) return refusal;
  if (auto refusal = request.refuse_changes(ErrorCode::kPlanRefused)) return refusal;
  return request.call(std::move(plan), ErrorCode::kPlanRefused, "this server has no plan");
}

}  // namespace brachy::net
