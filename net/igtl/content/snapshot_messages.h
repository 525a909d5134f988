#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"
#include "net/igtl/codec/codec.h"
#include "net/igtl/content/needle_name.h"

namespace brachy::net::igtl {

/// The newest snapshot and the messages made of it: each is encoded once for each header version, when the first client
/// wants it, and shared by all. One thread.
class SnapshotMessages {
 public:
  /// Of one needle that is there. `force` is empty where the force is not known, `bent_tip` and `shape`
  /// where it is rigid, `error` without targets.
  struct Transforms {
    std::size_t needle = 0;
    Bytes pose, force, bent_tip, shape, error;
  };
  /// Changes with the seeds that POINT shows.
  struct SeedVersion {
    std::uint64_t run = 0, count = 0, last_tick = 0;
    bool operator==(const SeedVersion&) const = default;
  };

  /// `surface_name` is the device of POLYDATA; `targets`, the planned seeds at rest, mm.
  SnapshotMessages(const Tissue& tissue, std::string surface_name, Naming naming = {},
                   std::vector<Vec3> targets = {});

  /// A new snapshot, and when it was, UTC; what was encoded of the last one is forgotten (senders still hold what they
  /// send).
  void update(std::shared_ptr<const MeshState> state, std::int64_t utc_ns);

  const MeshState* state() const { return state_.get(); }  ///< null: none yet
  std::uint64_t encoded() const { return encoded_; }       ///< surfaces encoded since start

  // Precondition: state(). `version` is the header's, 1 or 2.
  std::shared_ptr<const Bytes> surface(std::uint16_t version);  ///< POLYDATA
  std::shared_ptr<const Bytes> seeds(std::uint16_t version);    ///< POINT "Seeds": where they are now
  const std::vector<Transforms>& transforms(std::uint16_t version);
  SeedVersion seed_version() const;

  // Any time.
  Bytes targets(std::uint16_t version) const;  ///< POINT "Targets"
  bool has_targets() const { return !targets_.empty(); }
  const Naming& naming() const { return naming_; }

 private:
  struct Encoded {
    std::shared_ptr<const Bytes> surface, seeds;
    std::optional<std::vector<Transforms>> transforms;
  };
  Encoded& of(std::uint16_t version) { return encoded_as_[version - 1u]; }

  Bytes shape_message(std::size_t needle, std::uint16_t version) const;
  Vec3 to_nearest_target(const NeedleState& needle) const;

  std::string surface_name_;
  Naming naming_;
  std::vector<Vec3> targets_;  // W
  std::size_t surface_count_;
  std::uint32_t triangle_count_;
  Bytes triangles_;
  std::shared_ptr<const MeshState> state_;
  std::uint64_t timestamp_ = 0;
  std::array<Encoded, 2> encoded_as_;  // by version
  std::uint64_t encoded_ = 0;
};

}  // namespace brachy::net::igtl
