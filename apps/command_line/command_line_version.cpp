// The text of --version.
#include <nlohmann/json.hpp>

#include "apps/command_line/build_facts.h"
#include "apps/command_line/command_line_parts.h"
#include "core/base/simd/simd_target.h"
#include "core/base/version.h"
#include "net/wire/messages.h"

namespace brachy {

std::string version_text(const std::string& program) {
  return program + " " + version() + ", protocol " + std::to_string(net::kProtocolVersion);
}

std::string version_json(const std::string& program) {
  const BuildFacts facts = build_facts();
  nlohmann::ordered_json targets = nlohmann::ordered_json::array(), libraries;
  for (const SimdTarget target :
       {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512})
    if (is_supported(target)) targets.push_back(to_string(target));
  for (const BuiltWith& library : facts.libraries) libraries[library.name] = library.version;
  const nlohmann::ordered_json json = {
      {"program", program},
      {"version", version()},
      {"protocol", net::kProtocolVersion},
      {"build", {{"type", facts.build_type}, {"compiler", facts.compiler}, {"flags", facts.flags}}},
      {"openmp", facts.has_openmp},
      {"nats", facts.has_nats},
      {"simd", {{"run_here", targets}, {"best", to_string(best_simd_target())}}},
      {"libraries", libraries}};
  return json.dump(1);
}

}  // namespace brachy
