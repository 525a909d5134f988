#include "apps/terminal/bars.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace brachy {
namespace {

constexpr std::array<const char*, 8> kPartialBlocks = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
constexpr std::array<const char*, 8> kHeights = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};

std::string repeated(const char* piece, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += piece;
  return text;
}

}  // namespace

std::string bar(double share, std::size_t columns) {
  share = std::isnan(share) ? 0 : std::clamp(share, 0.0, 1.0);
  const auto eighths = static_cast<std::size_t>(std::lround(share * 8 * static_cast<double>(columns)));
  const std::size_t full = eighths / 8, rest = eighths % 8;
  return repeated("█", full) + kPartialBlocks[rest] + std::string(columns - full - (rest > 0), ' ');
}

std::string centred_bar(double share, std::size_t columns) {
  share = std::isnan(share) ? 0 : std::clamp(share, -1.0, 1.0);
  const std::size_t side = columns / 2;
  if (share >= 0) return std::string(side, ' ') + "│" + bar(share, side);
  // Blocks that end on the right have no eighths, only halves.
  const auto halves = static_cast<std::size_t>(std::lround(-share * 2 * static_cast<double>(side)));
  const std::size_t full = halves / 2, rest = halves % 2;
  return std::string(side - full - rest, ' ') + (rest ? "▐" : "") + repeated("█", full) + "│" +
         std::string(side, ' ');
}

void ValueHistory::add(double t_s, double value, bool is_marked) {
  if (t_s < last_s_) columns_.clear();
  if (columns_.empty() || t_s - last_s_ >= kColumnS) {
    // No value for some time: gaps, at most as many as columns are kept.
    const double passed = columns_.empty() ? 1 : std::min((t_s - last_s_) / kColumnS, double{kLongest});
    for (double gap = 2; gap <= passed; ++gap) columns_.push_back({std::nan(""), false});
    columns_.push_back({value, is_marked});
    last_s_ = columns_.size() == 1 ? t_s : last_s_ + kColumnS * std::floor((t_s - last_s_) / kColumnS);
    while (columns_.size() > kLongest) columns_.pop_front();
    return;
  }
  Column& last = columns_.back();
  if (std::isnan(last.value) || std::abs(value) > std::abs(last.value)) last.value = value;
  last.is_marked |= is_marked;
}

std::string ValueHistory::sparkline(std::size_t columns, double low, double high) const {
  const std::size_t count = std::min(columns, columns_.size());
  std::string text(columns - count, ' ');
  for (std::size_t i = columns_.size() - count; i < columns_.size(); ++i) {
    const Column& column = columns_[i];
    const double share = high > low ? std::clamp((column.value - low) / (high - low), 0.0, 1.0) : 0;
    if (column.is_marked)
      text += "▼";
    else if (!std::isfinite(column.value))
      text += ' ';
    else
      text += kHeights[std::min<std::size_t>(7, static_cast<std::size_t>(8 * share))];
  }
  return text;
}

double ValueHistory::smallest() const {
  double result = std::numeric_limits<double>::quiet_NaN();
  for (const Column& column : columns_) result = std::fmin(result, column.value);
  return result;
}

double ValueHistory::largest() const {
  double result = std::numeric_limits<double>::quiet_NaN();
  for (const Column& column : columns_) result = std::fmax(result, column.value);
  return result;
}

}  // namespace brachy
