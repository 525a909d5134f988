#include "core/simulation/simulator.h"
#include "core/simulation/tick_state.h"

namespace brachy {
namespace {

// Of another version the members are others.
constexpr std::uint64_t kFormat = 0x3130545352424f31;

}  // namespace

void Simulator::save(std::vector<std::byte>& bytes) const {
  StateWriter writer(bytes);
  writer(kFormat, tissue().size(), instruments_.states().size(), model_->max_landmarks());
  const_cast<Simulator*>(this)->list_state(writer);
  field_->save(writer, landmarks().settled_revision());
}

void Simulator::restore(std::span<const std::byte> state) {
  StateReader reader(state);
  std::uint64_t format = 0;
  std::size_t points = 0, instruments = 0, most_landmarks = 0;
  reader(format);
  if (format != kFormat) throw UserError("the saved state is of another version of brachyd");
  reader(points, instruments, most_landmarks);
  if (points != tissue().size() || instruments != instruments_.states().size() ||
      most_landmarks != model_->max_landmarks())
    throw UserError("the saved state is another scene's");
  list_state(reader);
  field_->restore(reader, landmarks().last_settled());
  if (reader.bytes_left() > 0) throw UserError("the saved state goes on after its end");
}

}  // namespace brachy
