#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/command_line/options.h"
#include "core/scene/scene.h"
#include "haptics/devices/switched_device.h"

namespace brachy::net {
struct BrokerOptions;
class ServedFiles;
struct ServerOptions;
namespace igtl {
struct IgtlOptions;
}
}  // namespace brachy::net

namespace brachy {

struct Tissue;

// From a scene to the parts of a daemon. All throw UserError for files that the scene names and that are
// missing or invalid.

/// Loads the tissue and logs its size and repairs.
Tissue load_simulated_tissue(const Scene& scene);

/// One device per needle id; needles in the scene's trajectory have a script.
std::vector<std::unique_ptr<SwitchedDevice>> make_devices(const Scene& scene, const Tissue& tissue,
                                                          std::size_t count);

net::ServerOptions server_options(const Scene& scene, const DaemonOptions& options, std::size_t needles);

/// nullopt: off.
std::optional<net::igtl::IgtlOptions> igtl_options(const Scene& scene, const DaemonOptions& options);

/// nullopt: off.
std::optional<net::BrokerOptions> broker_options(const Scene& scene, const DaemonOptions& options);

/// The viewer's files for browsers; logs a warning if the viewer is not built.
net::ServedFiles served_viewer();

}  // namespace brachy
