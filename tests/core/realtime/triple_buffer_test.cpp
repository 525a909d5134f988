#include "core/realtime/triple_buffer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <latch>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace brachy {
namespace {

#if defined(__SANITIZE_THREAD__)
constexpr bool kThreadSanitizer = true;
#elif defined(__has_feature)
constexpr bool kThreadSanitizer = __has_feature(thread_sanitizer);
#else
constexpr bool kThreadSanitizer = false;
#endif

/// Publishes in the torn test; BRACHY_TORN_PUBLISHES asks for more (a soak) or fewer.
std::uint64_t torn_publishes() {
  if (const char* count = std::getenv("BRACHY_TORN_PUBLISHES")) return std::strtoull(count, nullptr, 10);
  return kThreadSanitizer ? 20'000 : 1'000'000;
}

TEST(TripleBuffer, ReaderHasTheInitialValueBeforeAnythingIsPublished) {
  TripleBuffer<int> buffer(7);
  auto reader = buffer.reader();
  EXPECT_FALSE(reader.update());
  EXPECT_EQ(reader.value(), 7);
}

TEST(TripleBuffer, EverySlotStartsAsACopyOfTheInitialValue) {
  TripleBuffer<std::vector<int>> buffer(std::vector<int>(100, 1));
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  for (int tick = 0; tick < 6; ++tick) {
    EXPECT_EQ(writer.slot().size(), 100u);
    writer.publish();
    if (tick % 2 == 0) reader.update();
    EXPECT_EQ(reader.value().size(), 100u);
  }
}

TEST(TripleBuffer, AnUnpublishedSlotIsNotSeen) {
  TripleBuffer<int> buffer(0);
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  writer.slot() = 1;
  EXPECT_FALSE(reader.update());
  EXPECT_EQ(reader.value(), 0);
}

TEST(TripleBuffer, APublishedValueIsFreshOnce) {
  TripleBuffer<int> buffer(0);
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  writer.slot() = 1;
  writer.publish();
  EXPECT_TRUE(reader.update());
  EXPECT_EQ(reader.value(), 1);
  EXPECT_FALSE(reader.update());
  EXPECT_EQ(reader.value(), 1);
}

TEST(TripleBuffer, ReaderSkipsToTheNewestOfManyPublishes) {
  TripleBuffer<int> buffer(0);
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  for (int last : {1, 2, 3, 8, 100}) {
    for (int tick = 1; tick <= last; ++tick) {
      writer.slot() = tick;
      writer.publish();
    }
    EXPECT_TRUE(reader.update());
    EXPECT_EQ(reader.value(), last);
    EXPECT_FALSE(reader.update());
  }
}

TEST(TripleBuffer, ReadersValueStaysWhileTheWriterGoesOn) {
  TripleBuffer<int> buffer(0);
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  writer.slot() = 1;
  writer.publish();
  reader.update();
  const int& held = reader.value();
  for (int tick = 2; tick < 10; ++tick) {
    writer.slot() = tick;
    writer.publish();
    EXPECT_EQ(held, 1);
  }
}

TEST(TripleBuffer, TheSlotToFillIsTwoPublishesBehindOrOlder) {
  TripleBuffer<int> buffer(0);
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  for (int tick = 1; tick < 50; ++tick) {
    EXPECT_LE(writer.slot(), std::max(0, tick - 2));
    writer.slot() = tick;
    writer.publish();
    if (tick % 7 == 0 || tick % 5 == 0) reader.update();
  }
}

TEST(TripleBuffer, NoInterleavingOfTheTwoEndsTearsAValue) {
  // Every order in which 4 publishes (first half, second half, publish) and 3 readings (update, first half,
  // second half) can be mixed: 293,930 of them.
  struct Pair {
    int first = 0, second = 0;
  };
  constexpr unsigned kWrites = 12, kReads = 9, kSteps = kWrites + kReads;
  std::uint64_t schedules = 0;
  for (unsigned schedule = 0; schedule < 1u << kSteps; ++schedule) {
    if (__builtin_popcount(schedule) != static_cast<int>(kReads)) continue;
    ++schedules;
    TripleBuffer<Pair> buffer;
    auto writer = buffer.writer();
    auto reader = buffer.reader();
    unsigned writes = 0, reads = 0;
    int published = 0, first = 0, newest_at_update = 0;
    for (unsigned step = 0; step < kSteps; ++step) {
      if (schedule >> step & 1) {
        const unsigned phase = reads++ % 3;
        if (phase == 0) {
          reader.update();
          newest_at_update = published;
        } else if (phase == 1) {
          first = reader.value().first;
        } else {
          ASSERT_EQ(first, reader.value().second) << schedule;
          ASSERT_EQ(first, newest_at_update) << schedule;
        }
      } else {
        const unsigned phase = writes++ % 3;
        if (phase == 0) writer.slot().first = published + 1;
        if (phase == 1) writer.slot().second = published + 1;
        if (phase == 2) {
          writer.publish();
          ++published;
        }
      }
    }
  }
  EXPECT_EQ(schedules, 293'930u);
}

/// An atomic as a model checker would substitute: it runs a hook between the reader's check and its exchange.
template <class T>
class HookedAtomic {
 public:
  static inline std::function<void()> after_load;
  explicit HookedAtomic(T value) : value_(value) {}
  T load(std::memory_order) const {
    const T value = value_;
    if (after_load) after_load();
    return value;
  }
  T exchange(T value, std::memory_order) { return std::exchange(value_, value); }

 private:
  T value_;
};

TEST(TripleBuffer, APublishBetweenTheReadersCheckAndItsSwapIsTaken) {
  TripleBuffer<int, HookedAtomic> buffer(0);
  auto writer = buffer.writer();
  auto reader = buffer.reader();
  auto publish = [&](int tick) {
    writer.slot() = tick;
    writer.publish();
  };
  publish(1);
  HookedAtomic<std::uint8_t>::after_load = [&] { publish(2); };
  EXPECT_TRUE(reader.update());
  EXPECT_EQ(reader.value(), 2);
  EXPECT_FALSE(reader.update());  // not fresh when looked at: publish 2 again comes after the check
  HookedAtomic<std::uint8_t>::after_load = nullptr;
  EXPECT_TRUE(reader.update());
  EXPECT_EQ(reader.value(), 2);
}

TEST(TripleBuffer, HandlesMoveToTheirThreads) {
  TripleBuffer<int> buffer(0);
  std::thread([writer = buffer.writer()]() mutable {
    writer.slot() = 5;
    writer.publish();
  }).join();
  std::thread([reader = buffer.reader()]() mutable {
    EXPECT_TRUE(reader.update());
    EXPECT_EQ(reader.value(), 5);
  }).join();
}

TEST(TripleBuffer, NoValueIsTornAndNoTickGoesBackAcrossThreads) {
  const std::uint64_t publishes = torn_publishes();
  TripleBuffer<std::vector<std::uint64_t>> buffer(std::vector<std::uint64_t>(512, 0));
  std::latch start(2);
  std::thread writing([&, writer = buffer.writer()]() mutable {
    start.arrive_and_wait();
    for (std::uint64_t tick = 1; tick <= publishes; ++tick) {
      for (std::uint64_t& word : writer.slot()) word = tick;
      writer.publish();
    }
  });
  auto reader = buffer.reader();
  std::uint64_t last = 0, taken = 0, torn = 0, backwards = 0;
  start.arrive_and_wait();
  while (last < publishes) {
    if (!reader.update()) {
      std::this_thread::yield();  // on one core the writer must make progress
      continue;
    }
    ++taken;
    const std::uint64_t tick = reader.value().front();
    std::uint64_t differing = 0;
    for (std::uint64_t word : reader.value()) differing |= word ^ tick;
    if (differing != 0) ++torn;
    if (tick <= last) ++backwards;
    last = std::max(last, tick);
  }
  writing.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
  EXPECT_EQ(last, publishes);
  RecordProperty("taken", std::to_string(taken));
}

}  // namespace
}  // namespace brachy
