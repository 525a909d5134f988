#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/daemon/loops/ultrasound_scanner.h"
#include "core/brachytherapy/structures/structure.h"
#include "core/realtime/deadline.h"
#include "core/realtime/hand_over.h"
#include "core/realtime/histogram.h"

namespace brachy {

/// Statistics of the ultrasound thread since start.
struct UltrasoundStatistics {
  Histogram image_ns;          ///< wall time of one new image, with its compression
  Histogram field_ns;          ///< and of its field, once for all views
  std::uint64_t images = 0;    ///< new ones
  std::uint64_t held = 0;      ///< times the last one stood: its field is not certified, or was not solved
  std::uint64_t overruns = 0;  ///< periods that passed while it was busy
};

/// Inputs and outputs of the ultrasound loop, for its thread only. All outlive the loop.
struct UltrasoundPorts {
  HandOver<ImagedTick>::Reader& ticks;
  HandOver<RunModel>::Reader& models;
  HandOver<ScannerSettings>::Reader& settings;
  std::array<HandOver<ScannedImage>::Writer*, UltrasoundScanner::kMostViews> images;
  HandOver<UltrasoundStatistics>::Writer& statistics;
  std::function<void(std::shared_ptr<const FrozenGland>)> on_freeze;  ///< before its image is published
  std::function<void()> on_images;                                    ///< something was published
  std::function<void(const std::string& why)> on_failure;             ///< there will be no images
};

/// Makes images at the scene's rate while somebody asks for them (ScannerSettings::demand), until `stop`. Where nobody
/// does it wakes up and does nothing; its tables, and `echoes` where null, are made at the first demand. Beside the
/// 200 Hz loop: it shares triple buffers with it only.
/// Threads: the ultrasound thread's whole life. Real-time: no, but no allocation for an image save what on_images does.
void run_ultrasound_loop(const std::stop_token& stop, Clock& clock, const Scene& scene,
                         const std::vector<Structure>& structures, std::shared_ptr<const EchoMap> echoes,
                         const RigidTransform& X_WR, const UltrasoundPorts& ports);

}  // namespace brachy
