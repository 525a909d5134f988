#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace brachy {

/// Log-linear histogram of durations in ns: each octave is cut into 32 buckets of equal width. Values below
/// 64 ns have a bucket each; above, a bucket is at most 1/32 of its values wide. A quantile is the middle of
/// a bucket: its error is at most 1/64 (1.6 %) of the value. count, mean and max are exact.
///
/// Values are clamped to [0, kMaxNs] (137 s): a negative one counts as 0.
/// Threads: one; a plain value. To read it while it is filled, copy it through a TripleBuffer (8 kB).
///
/// Real-time: record is O(1), without allocation or branches on the data beyond the clamp; quantile walks the
/// buckets.
class Histogram {
 public:
  static constexpr int kSubBits = 5;  ///< 2^5 buckets an octave
  static constexpr int kMaxBits = 37;
  static constexpr std::int64_t kMaxNs = (std::int64_t{1} << kMaxBits) - 1;
  static constexpr double kRelativeError = 1.0 / (2 << kSubBits);  ///< of a quantile

  void record(std::int64_t ns) {
    const auto value = static_cast<std::uint64_t>(ns < 0 ? 0 : ns > kMaxNs ? kMaxNs : ns);
    ++buckets_[bucket_of(value)];
    ++count_;
    sum_ns_ += value;
    if (value > max_ns_) max_ns_ = value;
  }

  /// The middle of the smallest bucket that at least q·count records (and at least one) do not exceed, q
  /// clamped to [0, 1]; the exact maximum for the last record. 0 if empty.
  std::int64_t quantile(double q) const;

  std::uint64_t count() const { return count_; }
  std::int64_t max() const { return static_cast<std::int64_t>(max_ns_); }  ///< ns; 0 if empty
  double mean() const;                                                     ///< ns; 0 if empty
  std::uint64_t sum() const { return sum_ns_; }                            ///< ns
  /// Records of at most `ns`, to within a bucket (1/32 of the value) unless `ns` is the end of a bucket.
  std::uint64_t count_up_to(std::int64_t ns) const;

  /// Adds the records of another one.
  void merge(const Histogram& other);
  /// The records made after `earlier`, an older copy of this one. Their maximum is exact where it is the
  /// greatest of all, else the middle of its bucket.
  Histogram since(const Histogram& earlier) const;
  void clear() { *this = Histogram(); }

  bool operator==(const Histogram&) const = default;

 private:
  static constexpr std::uint64_t kSubCount = 1u << kSubBits;
  static constexpr std::size_t kBuckets = (kMaxBits - kSubBits + 1) * kSubCount;

  /// Values below 32 are their own index; with e the highest bit, the octave [2^e, 2^(e+1)) has the next 32.
  static constexpr std::size_t bucket_of(std::uint64_t value) {
    if (value < kSubCount) return value;
    const int shift = std::bit_width(value) - 1 - kSubBits;
    return static_cast<std::size_t>(shift) * kSubCount + (value >> shift);
  }
  static std::uint64_t middle_of(std::size_t bucket);

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::uint64_t sum_ns_ = 0;
  std::uint64_t max_ns_ = 0;
};

}  // namespace brachy
