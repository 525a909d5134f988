#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"
#include "net/igtl/codec.h"

namespace brachy::net::igtl {

/// The newest snapshot and the messages made of it: each is encoded once for each header version, when the first client
/// wants it, and shared by all. One thread.
class SnapshotMessages {
 public:
  /// Of one needle that is there. `force` is empty where the force is not known, `bent_tip` where it is straight.
  struct Transforms {
    std::size_t needle = 0;
    Bytes pose, force, bent_tip;
  };

  /// `surface_name` is the device of POLYDATA.
  SnapshotMessages(const Tissue& tissue, std::string surface_name);

  /// A new snapshot, and when it was, UTC; what was encoded of the last one is forgotten (senders still hold what they
  /// send).
  void update(std::shared_ptr<const MeshState> state, std::int64_t utc_ns);

  const MeshState* state() const { return state_.get(); }  ///< null: none yet
  std::uint64_t encoded() const { return encoded_; }       ///< surfaces encoded since start

  // Precondition: state(). `version` is the header's, 1 or 2.
  std::shared_ptr<const Bytes> surface(std::uint16_t version);   ///< POLYDATA
  std::shared_ptr<const Bytes> tracking(std::uint16_t version);  ///< TDATA: all needles that are there
  const std::vector<Transforms>& transforms(std::uint16_t version);

 private:
  struct Encoded {
    std::shared_ptr<const Bytes> surface, tracking;
    std::optional<std::vector<Transforms>> transforms;
  };
  Encoded& of(std::uint16_t version) { return encoded_as_[version - 1u]; }

  std::string surface_name_;
  std::size_t surface_count_;
  std::uint32_t triangle_count_;
  Bytes triangles_;
  std::shared_ptr<const MeshState> state_;
  std::uint64_t timestamp_ = 0;
  std::array<Encoded, 2> encoded_as_;  // by version
  std::uint64_t encoded_ = 0;
};

}  // namespace brachy::net::igtl
