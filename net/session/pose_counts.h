#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "net/wire/messages.h"

namespace brachy::net {

/// Poses received over the network since start: accepted, and refused by code.
class PoseCounts {
 public:
  void accept() { ++accepted_; }
  void refuse(std::uint16_t code, const std::string& text) {
    if (refused_.size() >= kMaxCodes && !refused_.contains(code)) code = kOtherCode;
    PoseRefusals& refusals = refused_[code];
    refusals.code = code;
    refusals.text = text;
    ++refusals.count;
  }

  /// Adds these counts to those already in `state`.
  void add_to(StateMessage& state) const {
    state.poses_accepted += accepted_;
    for (const auto& [code, refusals] : refused_) {
      bool known = false;
      for (PoseRefusals& there : state.refusals) {
        if (there.code != code) continue;
        there.count += refusals.count;
        there.text = refusals.text;
        known = true;
      }
      if (!known) state.refusals.push_back(refusals);
    }
  }

 private:
  static constexpr std::size_t kMaxCodes = 32;  // STATE stays small whatever the daemon's codes are
  static constexpr std::uint16_t kOtherCode = 0xFFFF;
  std::uint64_t accepted_ = 0;
  std::map<std::uint16_t, PoseRefusals> refused_;
};

}  // namespace brachy::net
