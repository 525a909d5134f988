// The triple buffer between two busy threads, with frames as large as the default scene's: torn_frames [SECONDS].
// Every frame read is checked completely: all of it is of one tick, and ticks do not decrease. A mutant whose exchange
// is a load and a store, with a yield in between, runs first and must be caught, as a check of the test itself. Exit
// code 0 only then.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "core/realtime/deadline.h"
#include "core/realtime/triple_buffer.h"

namespace {

constexpr std::size_t kPoints = 14'560;  // the default scene's

/// A frame whose every number is its tick.
using Frame = std::vector<std::uint32_t>;

template <class T>
class TornAtomic {
 public:
  explicit TornAtomic(T value) : value_(value) {}
  T load(std::memory_order order) const { return value_.load(order); }
  T exchange(T value, std::memory_order) {
    const T old = value_.load(std::memory_order_acquire);
    // Without this a busy machine may keep the two threads apart for as long as the mutant runs.
    std::this_thread::yield();
    value_.store(value, std::memory_order_release);
    return old;
  }

 private:
  std::atomic<T> value_;
};

struct Count {
  std::uint64_t published = 0, taken = 0, torn = 0, backwards = 0;
  bool is_good() const { return torn == 0 && backwards == 0; }
};

/// Publishes and takes for so long, or until `stops_when_caught` has what it wants.
template <template <class> class Atomic>
Count run(double seconds, bool stops_when_caught) {
  brachy::TripleBuffer<Frame, Atomic> buffer(Frame(3 * kPoints, 0));
  Count count;
  std::jthread writing([&, writer = buffer.writer()](const std::stop_token& stop) mutable {
    for (std::uint32_t tick = 1; !stop.stop_requested(); ++tick) {
      Frame& frame = writer.slot();
      // From both ends in turn, so that a half-written frame differs at either.
      if (tick % 2 == 0) {
        for (std::uint32_t& number : frame) number = tick;
      } else {
        for (std::size_t i = frame.size(); i-- > 0;) frame[i] = tick;
      }
      writer.publish();
      count.published = tick;
    }
  });
  auto reader = buffer.reader();
  std::uint32_t last = 0;
  const std::int64_t start_ns = brachy::monotonic_ns();
  const auto end_ns = start_ns + static_cast<std::int64_t>(1e9 * seconds);
  std::int64_t next_word_ns = start_ns + 60'000'000'000;
  for (std::int64_t now_ns = start_ns; now_ns < end_ns; now_ns = brachy::monotonic_ns()) {
    if (now_ns >= next_word_ns) {
      std::fprintf(stderr, "torn frames: %.0f of %.0f s, %llu frames taken\n",
                   1e-9 * static_cast<double>(now_ns - start_ns), seconds,
                   static_cast<unsigned long long>(count.taken));
      next_word_ns += 60'000'000'000;
    }
    if (!reader.update()) continue;
    ++count.taken;
    const Frame& frame = reader.value();
    const std::uint32_t tick = frame.front();
    std::uint32_t differing = 0;
    for (const std::uint32_t number : frame) differing |= number ^ tick;
    count.torn += differing != 0;
    count.backwards += tick <= last;
    last = tick;
    if (stops_when_caught && !count.is_good()) break;
  }
  writing.request_stop();
  writing.join();
  return count;
}

void print(const char* name, const Count& c) {
  std::printf("%s: %llu frames published, %llu taken, %llu torn, %llu out of order\n", name,
              static_cast<unsigned long long>(c.published), static_cast<unsigned long long>(c.taken),
              static_cast<unsigned long long>(c.torn), static_cast<unsigned long long>(c.backwards));
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 60;
  if (argc > 2 || !(seconds > 0)) {
    std::fprintf(stderr, "torn_frames [SECONDS]    default: 60\n");
    return 2;
  }
  constexpr double kMostSeconds = 600;  // tens of frames suffice, which take long on a busy machine
  const Count mutant = run<TornAtomic>(kMostSeconds, true);
  print("mutant without an exchange", mutant);
  const Count sound = run<std::atomic>(seconds, false);
  print("triple buffer", sound);
  return !mutant.is_good() && sound.is_good() && sound.taken > 0 ? 0 : 1;
}
