#include "core/scene/choose_source.h"

#include "core/base/error.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/dose/source_file.h"

namespace brachy {

void choose_source(Scene& scene) {
  const bool is_hdr = scene.implant.is_hdr();
  if (scene.dose.source.empty() && !is_hdr) return;
  scene.seeds.source = scene.dose.source.empty() ? SourceModel::kMicroSelectronV2
                                                 : resolve_source(scene.dose.source, scene.directory);
  if (tg43_source(scene.seeds.source).is_permanent == is_hdr)
    throw UserError("dose.source is \"" + scene.dose.source + "\", " +
                    (is_hdr ? "a seed that stays, and implant.kind is \"hdr\"; use one of: "
                            : "a source that is withdrawn again, and implant.kind is \"ldr\"; use one of: ") +
                    source_names(!is_hdr));
}

}  // namespace brachy
