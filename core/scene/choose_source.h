#pragma once

#include "core/scene/scene.h"

namespace brachy {

/// Makes `seeds.source`, which the rest of the program uses, the source that `dose.source` names; mhdr-v2 for HDR where
/// it names none. A source file is read. Threads: as resolve_source. Errors: UserError as resolve_source's; also for a
/// seed that stays in a scene of HDR, and the other way round.
void choose_source(Scene& scene);

}  // namespace brachy
