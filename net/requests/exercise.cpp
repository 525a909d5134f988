// EXERCISE: an operator begins an attempt at an exercise.
#include "net/requests/request.h"
#include "net/wire/fields.h"

namespace brachy::net {

void fields(auto& archive, MaybeConst<ExerciseMessage> auto& message) {
  archive.text(message.file, kMaxTextBytes);
  archive.text(message.trainee, kMaxNameBytes);
  archive.sections();
}
BRACHY_CODEC(ExerciseMessage);

Refusal handle_exercise(const IncomingRequest& request) {
  constexpr Rate kExercises{"exercises", 1, 2};
  ExerciseMessage exercise;
  if (auto refusal = request.decode(exercise)) return refusal;
  if (auto refusal = request.refuse_others("EXERCISE")) return refusal;
  if (!request.pass(kExercises))
    return request.refuse(ErrorCode::kExerciseRefused, "more than one EXERCISE a second");
  return request.call(exercise, ErrorCode::kExerciseRefused, "this server has no exercises");
}

}  // namespace brachy::net
