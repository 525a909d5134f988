// The triple buffer in a model checker: relacy runs a writer and a reader through interleavings and through all values
// that the C++ memory model allows each of them to see, and reports any read of a slot that is not ordered after its
// writes. A program of its own, because relacy's header defines `$` and other macros. Exit code 0 where the buffer is
// correct and every mutant is caught.

#include <atomic>
#include <cstdio>
#include <memory>
#include <optional>
#include <ostream>
#include <streambuf>
#include <string>

#include "core/realtime/triple_buffer.h"

// Names that relacy does not redefine.
constexpr auto kRelaxed = std::memory_order_relaxed, kAcquire = std::memory_order_acquire,
               kRelease = std::memory_order_release, kAcqRel = std::memory_order_acq_rel;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wshadow"
#include <relacy/relacy.hpp>
#pragma GCC diagnostic pop

namespace {

rl::memory_order to_relacy(std::memory_order order) {
  if (order == kRelaxed) return rl::mo_relaxed;
  if (order == kAcquire) return rl::mo_acquire;
  if (order == kRelease) return rl::mo_release;
  return order == kAcqRel ? rl::mo_acq_rel : rl::mo_seq_cst;
}

constexpr unsigned kWriter = 0, kReader = 1;  // threads, as relacy numbers them

/// A mutant's exchange, in one thread.
enum class Mutation { kNone, kNoRelease, kNoAcquire, kTorn };

template <class T, Mutation kMutation, unsigned kThread>
class CheckedAtomic {
 public:
  explicit CheckedAtomic(T value) : value_(value) {}
  T load(std::memory_order order) const { return value_.load(to_relacy(order), $); }
  T exchange(T value, std::memory_order order) {
    if (kMutation == Mutation::kNone || rl::thread_index() != kThread)
      return value_.exchange(value, to_relacy(order), $);
    if (kMutation == Mutation::kNoRelease) return value_.exchange(value, rl::mo_acquire, $);
    if (kMutation == Mutation::kNoAcquire) return value_.exchange(value, rl::mo_release, $);
    const T old = value_.load(rl::mo_acquire, $);
    value_.store(value, rl::mo_release, $);
    return old;
  }

 private:
  rl::atomic<T> value_;
};

template <Mutation kMutation, unsigned kThread>
struct Mutant {
  template <class T>
  using Atomic = CheckedAtomic<T, kMutation, kThread>;
};

/// A value of two halves; relacy knows who has written each, and whether the reader may look.
struct Halves {
  explicit Halves(int value = 0) {
    first($) = value;
    second($) = value;
  }
  Halves(const Halves& other) {
    first($) = static_cast<int>(other.first($));
    second($) = static_cast<int>(other.second($));
  }
  mutable rl::var<int> first, second;
};

constexpr int kPublishes = 6, kUpdates = 6;

template <template <class> class Atomic>
struct WriterAndReader : rl::test_suite<WriterAndReader<Atomic>, 2> {
  using Buffer = brachy::TripleBuffer<Halves, Atomic>;

  void before() {
    buffer = std::make_unique<Buffer>();
    writer.emplace(buffer->writer());
    reader.emplace(buffer->reader());
  }
  void thread(unsigned index) { index == kWriter ? write() : read(); }
  void after() {
    if (reader->update()) look();
    RL_ASSERT(seen == kPublishes);  // nothing newer was lost
  }

  void write() {
    for (int tick = 1; tick <= kPublishes; ++tick) {
      Halves& slot = writer->slot();
      slot.first($) = tick;
      slot.second($) = tick;
      writer->publish();
    }
  }
  void read() {
    for (int i = 0; i < kUpdates; ++i) {
      const bool is_fresh = reader->update();
      const int before_it = seen;
      look();
      RL_ASSERT(is_fresh ? seen > before_it : seen == before_it);
    }
  }
  void look() {
    const int first = reader->value().first($);
    const int second = reader->value().second($);
    RL_ASSERT(first == second);
    seen = first;
  }

  std::unique_ptr<Buffer> buffer;
  std::optional<typename Buffer::Writer> writer;
  std::optional<typename Buffer::Reader> reader;
  int seen = 0;  // by the reader alone, and after it
};

/// relacy's output, truncated to a fixed buffer: relacy replaces operator new, so that a growing stream would fail.
class Report : public std::streambuf {
 public:
  Report() { setp(text_, text_ + sizeof text_ - 1); }
  const char* text() {
    *pptr() = 0;
    return text_;
  }

 private:
  char text_[1 << 16];
};

/// Runs one buffer; true where the result is as expected.
template <template <class> class Atomic>
bool check(const char* name, bool is_sound) {
  static Report report;
  report = Report();
  std::ostream stream(&report);
  rl::test_params params;
  params.search_type = rl::fair_full_search_scheduler_type;
  params.output_stream = &stream;
  params.progress_stream = &stream;
  const bool holds = rl::simulate<WriterAndReader<Atomic>>(params);
  std::printf("%-36s %s after %llu executions%s%s\n", name, holds ? "holds" : "fails",
              static_cast<unsigned long long>(params.stop_iteration), holds ? "" : ": ",
              holds ? "" : rl::test_result_str(params.test_result));
  if (holds == is_sound) return true;
  std::printf("%s\n", report.text());
  return false;
}

}  // namespace

int main() {
  using enum Mutation;
  bool is_good = check<Mutant<kNone, kWriter>::Atomic>("the buffer", true);
  is_good &= check<Mutant<kNoRelease, kWriter>::Atomic>("mutant: publish without release", false);
  is_good &= check<Mutant<kNoAcquire, kWriter>::Atomic>("mutant: publish without acquire", false);
  is_good &= check<Mutant<kTorn, kWriter>::Atomic>("mutant: publish by load and store", false);
  is_good &= check<Mutant<kNoRelease, kReader>::Atomic>("mutant: update without release", false);
  is_good &= check<Mutant<kNoAcquire, kReader>::Atomic>("mutant: update without acquire", false);
  is_good &= check<Mutant<kTorn, kReader>::Atomic>("mutant: update by load and store", false);
  return is_good ? 0 : 1;
}
