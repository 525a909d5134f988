#include "core/realtime/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

namespace brachy {
namespace {

/// The record that at least q·n records do not exceed, from the sorted records themselves.
std::int64_t exact_quantile(const std::vector<std::int64_t>& sorted, double q) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size()) - 1e-9));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

void expect_quantiles_within_bound(std::vector<std::int64_t> records) {
  Histogram histogram;
  for (std::int64_t ns : records) histogram.record(ns);
  std::sort(records.begin(), records.end());
  for (double q : {0.0, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    const std::int64_t exact = exact_quantile(records, q);
    EXPECT_LE(std::abs(histogram.quantile(q) - exact), Histogram::kRelativeError * static_cast<double>(exact))
        << "q = " << q << ", exact " << exact;
  }
}

TEST(Histogram, IsTriviallyCopyableSoThatATripleBufferHandsItOver) {
  EXPECT_TRUE(std::is_trivially_copyable_v<Histogram>);
  EXPECT_LT(sizeof(Histogram), 9000u);
}

TEST(Histogram, EmptyHasZeros) {
  const Histogram histogram;
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.quantile(0.5), 0);
  EXPECT_EQ(histogram.max(), 0);
  EXPECT_EQ(histogram.mean(), 0);
}

TEST(Histogram, ValuesBelow64AreExact) {
  for (std::int64_t ns = 0; ns < 64; ++ns) {
    Histogram histogram;
    histogram.record(ns);
    histogram.record(1000);
    EXPECT_EQ(histogram.quantile(0.5), ns);
  }
}

TEST(Histogram, QuantilesOfOneValueAreThatValue) {
  Histogram histogram;
  histogram.record(123'456'789);
  for (double q : {0.0, 0.5, 1.0}) EXPECT_EQ(histogram.quantile(q), 123'456'789);
}

TEST(Histogram, QuantilesStayWithinTheBoundForLogUniformTimes) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(0, 36.9);
  std::vector<std::int64_t> records(100'000);
  for (auto& ns : records) ns = static_cast<std::int64_t>(std::exp2(exponent(random)));
  expect_quantiles_within_bound(records);
}

TEST(Histogram, QuantilesStayWithinTheBoundForTickTimesWithATail) {
  std::mt19937_64 random(2);
  std::lognormal_distribution<double> tick_ns(std::log(300e3), 0.4);
  std::vector<std::int64_t> records(50'000);
  for (auto& ns : records) ns = static_cast<std::int64_t>(tick_ns(random));
  for (std::size_t i = 0; i < 40; ++i) records[i] = 8'000'000 + static_cast<std::int64_t>(i) * 100'000;
  expect_quantiles_within_bound(records);
}

TEST(Histogram, EdgesOfEveryOctaveStayWithinTheBound) {
  for (int bits = 0; bits < Histogram::kMaxBits; ++bits) {
    for (std::int64_t ns :
         {(std::int64_t{1} << bits) - 1, std::int64_t{1} << bits, (std::int64_t{1} << bits) + 1}) {
      Histogram histogram;
      histogram.record(ns);
      histogram.record(Histogram::kMaxNs);
      EXPECT_LE(std::abs(histogram.quantile(0.5) - ns), Histogram::kRelativeError * static_cast<double>(ns))
          << ns;
    }
  }
}

TEST(Histogram, CountMeanAndMaxAreExact) {
  Histogram histogram;
  for (std::int64_t ns : {1'000'003, 2'000'000, 5'999'997}) histogram.record(ns);
  EXPECT_EQ(histogram.count(), 3u);
  EXPECT_EQ(histogram.mean(), 3'000'000);
  EXPECT_EQ(histogram.max(), 5'999'997);
  EXPECT_EQ(histogram.quantile(1), 5'999'997);
}

TEST(Histogram, ClampsWhatIsOutOfRange) {
  Histogram histogram;
  histogram.record(-5);
  EXPECT_EQ(histogram.max(), 0);
  histogram.record(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(histogram.max(), Histogram::kMaxNs);
  EXPECT_EQ(histogram.quantile(-1), 0);
  EXPECT_EQ(histogram.quantile(2), Histogram::kMaxNs);
}

TEST(Histogram, SinceHoldsWhatWasRecordedLater) {
  Histogram all, later;
  for (int i = 0; i < 500; ++i) all.record(1000 + 7 * i);
  const Histogram earlier = all;
  for (int i = 0; i < 300; ++i) {
    all.record(2000 + 11 * i);
    later.record(2000 + 11 * i);
  }
  EXPECT_EQ(all.since(earlier), later);  // its maximum is that of all
  EXPECT_EQ(all.since(all), Histogram());
}

TEST(Histogram, SinceKnowsALesserMaximumWithinItsBucket) {
  Histogram all;
  all.record(1'000'000);
  const Histogram earlier = all;
  all.record(50'000);
  EXPECT_NEAR(static_cast<double>(all.since(earlier).max()), 50'000, 50'000 * Histogram::kRelativeError);
}

TEST(Histogram, MergingEqualsRecordingAllInOne) {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<std::int64_t> ns(0, 50'000'000);
  Histogram a, b, all;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t value = ns(random);
    (i % 3 == 0 ? a : b).record(value);
    all.record(value);
  }
  a.merge(b);
  EXPECT_EQ(a, all);
  a.clear();
  EXPECT_EQ(a, Histogram());
}

TEST(Histogram, CountsUpToATimeToWithinABucket) {
  Histogram histogram;
  for (std::int64_t us = 1; us <= 1000; ++us) histogram.record(1000 * us);
  EXPECT_EQ(histogram.count_up_to(-1), 0u);
  EXPECT_EQ(histogram.count_up_to(Histogram::kMaxNs), 1000u);
  EXPECT_EQ(histogram.sum(), 1000u * 500'500u);
  std::uint64_t last = 0;
  for (std::int64_t us = 1; us <= 1100; ++us) {
    const std::uint64_t count = histogram.count_up_to(1000 * us);
    EXPECT_GE(count, last) << us;
    EXPECT_LE(count, static_cast<std::uint64_t>(us)) << "no record beyond it";
    EXPECT_GE(static_cast<double>(count), std::min(1000.0, (1 - 1.0 / 32) * static_cast<double>(us) - 1))
        << us;
    last = count;
  }
  EXPECT_EQ(histogram.count_up_to((1 << 19) - 1), 524u) << "a bucket's end: exact";
}

}  // namespace
}  // namespace brachy
