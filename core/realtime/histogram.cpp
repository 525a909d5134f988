#include "core/realtime/histogram.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace brachy {

static_assert(std::is_trivially_copyable_v<Histogram>);

std::uint64_t Histogram::middle_of(std::size_t bucket) {
  if (bucket < 2 * kSubCount) return bucket;
  const std::size_t shift = bucket / kSubCount - 1;
  const std::uint64_t lowest = (bucket - shift * kSubCount) << shift;
  return lowest + ((std::uint64_t{1} << shift) - 1) / 2;
}

std::int64_t Histogram::quantile(double q) const {
  if (count_ == 0) return 0;
  const double wanted = std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_) * (1 - 1e-15));
  const std::uint64_t rank = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(wanted), 1, count_);
  if (rank == count_) return max();
  std::uint64_t seen = 0;
  std::size_t bucket = 0;
  while ((seen += buckets_[bucket]) < rank) ++bucket;
  return std::min(static_cast<std::int64_t>(middle_of(bucket)), max());
}

double Histogram::mean() const {
  return count_ == 0 ? 0 : static_cast<double>(sum_ns_) / static_cast<double>(count_);
}

std::uint64_t Histogram::count_up_to(std::int64_t ns) const {
  if (ns < 0) return 0;
  if (ns >= kMaxNs) return count_;
  const std::size_t end = bucket_of(static_cast<std::uint64_t>(ns) + 1);  // the first that may hold more
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket < end; ++bucket) seen += buckets_[bucket];
  return seen;
}

void Histogram::merge(const Histogram& other) {
  for (std::size_t i = 0; i < kBuckets; ++i) buckets_[i] += other.buckets_[i];
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  max_ns_ = std::max(max_ns_, other.max_ns_);
}

Histogram Histogram::since(const Histogram& earlier) const {
  Histogram newer;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    newer.buckets_[i] = buckets_[i] - earlier.buckets_[i];
    if (newer.buckets_[i] > 0) newer.max_ns_ = middle_of(i);
  }
  newer.count_ = count_ - earlier.count_;
  newer.sum_ns_ = sum_ns_ - earlier.sum_ns_;
  if (max_ns_ > earlier.max_ns_) newer.max_ns_ = max_ns_;
  return newer;
}

}  // namespace brachy
