#include "tests/fuzz/igtl_script.h"

#include <array>

#include "net/igtl/codec/codec.h"
#include "tests/net/igtl/igtl_peer.h"

namespace brachy::fuzz {
namespace {

constexpr std::array<const char*, 9> kTypes = {"TRANSFORM",  "GET_TRANS",   "GET_POLYDATA",
                                               "GET_STATUS", "GET_CAPABIL", "STT_TDATA",
                                               "STP_TDATA",  "STATUS",      "IMAGE"};
constexpr std::array<const char*, 6> kDevices = {
    "NeedleToRas", "Needle1ToRas", "NeedleTip0", "ForceToRas", "", "BentTipToRas"};

template <class Names>
std::string next_name(Script& script, const Names& names, std::size_t size) {
  const std::size_t which = script.u8();
  return which < names.size() ? names[which] : text_of(script.take(size));
}

}  // namespace

net::Bytes next_igtl_message(Script& script) {
  namespace igtl = net::igtl;
  const std::string type = next_name(script, kTypes, igtl::kTypeBytes);
  const std::string device = next_name(script, kDevices, igtl::kNameBytes);
  const auto version = script.u8();
  const auto flaws = script.u8();
  const auto body = script.piece();
  if (flaws & kNoHeader) return {body.begin(), body.end()};
  net::Bytes message = igtl::encode_empty(type, {1, device, 1});
  message[1] = std::byte{version};
  message.insert(message.end(), body.begin(), body.end());
  message = igtl::test::with_right_size_and_crc(std::move(message));
  if (flaws & kWrongCrc) message[igtl::kHeaderSize - 1] ^= std::byte{1};
  if (flaws & kWrongSize) message[igtl::kHeaderSize - 9] ^= std::byte{1};
  return message;
}

}  // namespace brachy::fuzz
