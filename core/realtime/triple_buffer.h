#pragma once

#include <array>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace brachy {

/// Hands values of T from one writer thread to one reader thread: the reader always gets the newest published
/// value, neither ever waits for the other, and no value is ever seen half written.
///
/// Three slots: the writer owns the back slot, the reader the front slot, and the middle slot has no owner.
/// Publishing swaps back and middle, updating swaps middle and front. The threads share only one atomic byte:
/// the middle slot's index and a bit for "published and not yet taken". The atomic is a template parameter,
/// so that a model checker can substitute its own. It must offer
///   AtomicTemplate<std::uint8_t>(initial),  load(std::memory_order),  exchange(value, std::memory_order);
/// checked reads and writes of the slots come from a T whose members the checker instruments.
///
/// Threads: one thread uses the Writer, one the Reader (it may be the same one); construct the buffer and
/// take both handles before the threads start. The buffer outlives its handles.
///
/// Real-time: slot, publish, update and value are wait-free: at most one load and one exchange, no allocation.
template <class T, template <class> class AtomicTemplate = std::atomic>
class TripleBuffer {
 public:
  class Writer;
  class Reader;

  /// All three slots start as copies of `initial`, so that the vectors in T are allocated once, before the
  /// real-time loop starts.
  explicit TripleBuffer(const T& initial = T()) : slots_{{{initial}, {initial}, {initial}}} {}
  TripleBuffer(const TripleBuffer&) = delete;
  TripleBuffer& operator=(const TripleBuffer&) = delete;

  /// The writer's handle; to be called once.
  Writer writer() {
    assert(!writer_taken_ && "a triple buffer has one writer");
    writer_taken_ = true;
    return Writer(*this);
  }

  /// The reader's handle; to be called once.
  Reader reader() {
    assert(!reader_taken_ && "a triple buffer has one reader");
    reader_taken_ = true;
    return Reader(*this);
  }

 private:
  static constexpr std::size_t kCacheLine = 64;  // x86-64 and most AArch64
  static constexpr std::uint8_t kIndexMask = 0b011;
  static constexpr std::uint8_t kFresh = 0b100;

  struct alignas(kCacheLine) Slot {
    T value;
  };

  static constexpr bool lock_free() {
    if constexpr (requires { AtomicTemplate<std::uint8_t>::is_always_lock_free; }) {
      return AtomicTemplate<std::uint8_t>::is_always_lock_free;
    }
    return true;  // a model checker's atomic
  }
  static_assert(lock_free(), "the hand-over must not hide a lock");

  std::array<Slot, 3> slots_;  // 0 starts as the back, 1 as the middle, 2 as the front
  alignas(kCacheLine) AtomicTemplate<std::uint8_t> middle_{1};
  alignas(kCacheLine) bool writer_taken_ = false;  // set-up only
  bool reader_taken_ = false;
};

/// The writing end of a TripleBuffer.
template <class T, template <class> class AtomicTemplate>
class TripleBuffer<T, AtomicTemplate>::Writer {
 public:
  Writer(Writer&& other) noexcept : buffer_(std::exchange(other.buffer_, nullptr)), back_(other.back_) {}
  Writer& operator=(Writer&&) = delete;

  /// The back slot, to be filled before the next publish. It holds an old value, not the last published one:
  /// the value of two publishes ago, the initial one, or an older one if the reader kept it for long (the
  /// slot for publish k + 1 contains k − 1 or older). Rewrite it completely, or track by tick which parts are
  /// outdated. The reference is invalid after publish.
  T& slot() { return buffer_->slots_[back_].value; }

  /// Makes the back slot the newest value. A published value that the reader has not taken is overwritten later.
  void publish() {
    // release: forbids the writes into the back slot from sinking below the exchange; the reader that takes the
    //   slot would see them half done.
    // acquire: forbids the writes into the new back slot from rising above the exchange. It may be the slot that
    //   the reader has just returned; the reader's reads of it, before its releasing exchange, must come first.
    // One exchange instead of a load and a store: between these two the reader could take the middle slot, and
    //   both ends would own it.
    const auto fresh = static_cast<std::uint8_t>(back_ | kFresh);
    back_ = buffer_->middle_.exchange(fresh, std::memory_order_acq_rel) & kIndexMask;
  }

 private:
  friend class TripleBuffer;
  explicit Writer(TripleBuffer& buffer) : buffer_(&buffer) {}

  TripleBuffer* buffer_;
  std::uint8_t back_ = 0;
};

/// The reading end of a TripleBuffer.
template <class T, template <class> class AtomicTemplate>
class TripleBuffer<T, AtomicTemplate>::Reader {
 public:
  Reader(Reader&& other) noexcept : buffer_(std::exchange(other.buffer_, nullptr)), front_(other.front_) {}
  Reader& operator=(Reader&&) = delete;

  /// Takes the newest value if one was published since the last update; true if so. References from value()
  /// are invalid after an update that returned true.
  bool update() {
    // relaxed: forbids nothing, and nothing needs forbidding: no slot is accessed because of this load. A stale
    //   "not fresh" delays the update to the next call; "fresh" stays true until this reader clears it.
    if ((buffer_->middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    // acquire: forbids the reads of the new front slot from rising above the exchange, before the writer's
    //   writes, which precede its releasing exchange.
    // release: forbids the reads of the returned slot from sinking below the exchange; the writer may fill it as
    //   soon as it owns it.
    front_ = buffer_->middle_.exchange(front_, std::memory_order_acq_rel) & kIndexMask;
    return true;
  }

  /// The value taken by the last successful update; the initial one before that.
  const T& value() const { return buffer_->slots_[front_].value; }

 private:
  friend class TripleBuffer;
  explicit Reader(TripleBuffer& buffer) : buffer_(&buffer) {}

  TripleBuffer* buffer_;
  std::uint8_t front_ = 2;
};

}  // namespace brachy
