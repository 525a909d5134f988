// What acts on a hand, beside the device: any models, tips, forces and times. See tests/haptics/any_input_test.cpp.
#include <algorithm>

#include "haptics/force/local_force.h"
#include "haptics/force/received_force.h"
#include "tests/fuzz/fuzzing.h"
#include "tests/haptics/any_number.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  test::AnyNumber number([&] {
    std::uint64_t bits = 0;
    for (int i = 0; i < 4; ++i) bits = bits << 16 | script.u16();
    return bits;
  });
  constexpr double kMaxForceN = 3.3;
  LocalForce local({.max_force_n = kMaxForceN});
  ReceivedForce received(kMaxForceN);
  Vec3 last = Vec3::Zero(), last_received = Vec3::Zero();
  std::int64_t now_ns = 0;
  const auto feel = [](Vec3& before, const Vec3& force_n) {
    EXPECT_TRUE(force_n.allFinite());
    EXPECT_LE(force_n.norm(), kMaxForceN * (1 + 1e-12));
    EXPECT_LE((force_n - before).norm(), kMaxSlewNPerMs + 1e-12);
    before = force_n;
  };
  while (!script.is_over()) {
    switch (script.u8() % 8) {
      case 0:
        local.take(number.model(), number.any_time(), now_ns);
        break;
      case 1:
        received.take(number.any_vector(), script.u16(), script.u8() % 2 != 0, now_ns);
        break;
      case 2:
        received.arm();
        break;
      case 3:
        now_ns = number.any_time();
        break;
      default:
        if (now_ns < INT64_MAX - 100'000'000) now_ns += 1000 * std::int64_t{script.u16()};
    }
    feel(last, local.evaluate(number.place(), now_ns).force_n);
    feel(last_received, received.evaluate(now_ns));
  }
  return 0;
}

}  // namespace brachy::fuzz
