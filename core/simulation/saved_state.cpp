#include "core/simulation/simulator.h"
#include "core/simulation/tick_state.h"

namespace brachy {
namespace {

// Of another version the members are others.
constexpr std::uint64_t kFormat = 0x3430545352424f31;

}  // namespace

void Simulator::save(std::vector<std::byte>& bytes) const {
  StateWriter writer(bytes);
  writer(kFormat, model_->digest, *this);
  field_->save(writer, landmarks().settled_revision());
}

void Simulator::restore(std::span<const std::byte> state) {
  StateReader reader(state);
  std::uint64_t format = 0, digest = 0;
  reader(format);
  if (format != kFormat) throw UserError("the saved state is of another version of brachyd");
  reader(digest);
  if (digest != model_->digest) throw UserError("the saved state is another scene's");
  reader(*this);
  field_->restore(reader, landmarks().last_settled());
  if (reader.bytes_left() > 0) throw UserError("the saved state goes on after its end");
}

}  // namespace brachy
