#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/options.h"
#include "core/scene/scene.h"
#include "core/tissue/tissue.h"
#include "haptics/switched_device.h"
#include "net/broker/broker_options.h"
#include "net/http/served_files.h"
#include "net/igtl/igtl_server.h"
#include "net/server_options.h"

namespace brachy {

// From a scene to the parts of a daemon. All throw UserError for what the scene names and is not there or not good.

/// The scene that the options name, with what they and `auto` put in its place; logs what was chosen.
Scene read_scene(const DaemonOptions& options);

/// Loads the tissue and says what it found.
Tissue load_simulated_tissue(const Scene& scene);

/// By needle id; those that the scene's trajectory moves have a script.
std::vector<std::unique_ptr<SwitchedDevice>> make_devices(const Scene& scene, const Tissue& tissue,
                                                          std::size_t count);

net::ServerOptions server_options(const Scene& scene, const DaemonOptions& options, std::size_t needles);

/// nullopt: off.
std::optional<net::igtl::IgtlOptions> igtl_options(const Scene& scene, const DaemonOptions& options);

/// nullopt: off.
std::optional<net::BrokerOptions> broker_options(const Scene& scene, const DaemonOptions& options);

/// What browsers get; says so where the viewer is not built.
net::ServedFiles served_viewer();

}  // namespace brachy
