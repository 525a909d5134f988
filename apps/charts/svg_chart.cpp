#include "apps/charts/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace brachy {
namespace {

constexpr double kLeft = 70, kRight = 20, kTop = 62, kBottom = 52;  // margins around its axes
constexpr double kNear = 0.5;                                       // px: nearer points are omitted
constexpr const char* kFont = "font-family=\"sans-serif\" fill=\"#222\"";

/// From values to px along one axis.
struct Axis {
  double least = INFINITY, most = -INFINITY;
  double from_px = 0, to_px = 0;

  void take_in(double value) {
    if (!std::isfinite(value)) return;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  void close(double margin) {
    if (!(least <= most)) least = 0, most = 0;
    const double pad = most > least ? margin * (most - least) : 1;
    least -= pad;
    most += pad;
  }
  double px_per_unit() const { return std::abs(to_px - from_px) / (most - least); }
  /// Extends the range on both sides until a unit has `px` pixels.
  void loosen(double px) {
    const double pad = 0.5 * (std::abs(to_px - from_px) / px - (most - least));
    least -= pad;
    most += pad;
  }
  double operator()(double value) const {
    return from_px + (value - least) / (most - least) * (to_px - from_px);
  }
};

std::string text_at(double x, double y, const std::string& text, const char* anchor, int size,
                    const std::string& more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\" {}{}>{}</text>\n",
                     x, y, size, anchor, kFont, more, xml_escaped(text));
}

std::string segment(double x1, double y1, double x2, double y2, const std::string& style) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1, x2, y2,
                     style);
}

std::string stroke(const ChartLine& line) {
  return fmt::format("stroke=\"{}\" stroke-width=\"{}\"{}", xml_escaped(line.colour), line.width_px,
                     line.dashes.empty() ? "" : " stroke-dasharray=\"" + xml_escaped(line.dashes) + "\"");
}

/// An arrow head at (x, y) px for a line from (from_x, from_y); none where the line is shorter than the head.
std::string arrow_head(const ChartLine& line, double from_x, double from_y, double x, double y) {
  constexpr double kLong = 5, kWide = 2.2;
  const double dx = x - from_x, dy = y - from_y, length = std::hypot(dx, dy);
  if (length < kLong) return "";
  const double ux = dx / length, uy = dy / length, base_x = x - kLong * ux, base_y = y - kLong * uy;
  return fmt::format("<path fill=\"{}\" d=\"M{:.2f},{:.2f} L{:.2f},{:.2f} L{:.2f},{:.2f} Z\"/>\n",
                     xml_escaped(line.colour), x, y, base_x - kWide * uy, base_y + kWide * ux,
                     base_x + kWide * uy, base_y - kWide * ux);
}

std::string polylines(const ChartLine& line, const Axis& x, const Axis& y) {
  const std::string opening =
      "<polyline fill=\"none\" stroke-linejoin=\"round\" " + stroke(line) + " points=\"";
  std::string out, head;
  bool open = false;
  double last_x = 0, last_y = 0;
  const auto add_point = [&](double px, double py) {
    if (open && line.arrows) head = arrow_head(line, last_x, last_y, px, py);
    out += fmt::format("{:.2f},{:.2f} ", last_x = px, last_y = py);
  };
  const auto close = [&] {
    if (std::exchange(open, false)) out += "\"/>\n" + std::exchange(head, "");
  };
  for (std::size_t i = 0; i < line.x.size(); ++i) {
    if (!std::isfinite(line.x[i]) || !std::isfinite(line.y[i])) {
      close();
      continue;
    }
    const double px = x(line.x[i]), py = y(line.y[i]);
    const bool ends =
        i + 1 == line.x.size() || !std::isfinite(line.x[i + 1]) || !std::isfinite(line.y[i + 1]);
    if (open && !ends && std::hypot(px - last_x, py - last_y) < kNear) continue;
    if (!open) out += opening;
    add_point(px, py);
    open = true;
  }
  close();
  return out;
}

std::string dot(const ChartLine& line, double x_px, double y_px) {
  return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" fill=\"{}\"/>\n", x_px, y_px, line.dot_px,
                     xml_escaped(line.colour));
}

std::string dots(const ChartLine& line, const Axis& x, const Axis& y) {
  std::string out;
  for (std::size_t i = 0; i < line.x.size(); ++i)
    if (std::isfinite(line.x[i]) && std::isfinite(line.y[i])) out += dot(line, x(line.x[i]), y(line.y[i]));
  return out;
}

std::string axes(const Chart& chart, const Axis& x, const Axis& y) {
  std::string out;
  for (double value : round_ticks(x.least, x.most, chart.width_px < 600 ? 6 : 10)) {
    out += segment(x(value), y.from_px, x(value), y.to_px, "stroke=\"#e4e4e4\"");
    out += text_at(x(value), y.from_px + 18, fmt::format("{:g}", value), "middle", 12);
  }
  for (double value : round_ticks(y.least, y.most, 7)) {
    out += segment(x.from_px, y(value), x.to_px, y(value),
                   value == 0 ? "stroke=\"#888\"" : "stroke=\"#e4e4e4\"");
    out += text_at(x.from_px - 7, y(value) + 4, fmt::format("{:g}", value), "end", 12);
  }
  out += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#444\"/>\n",
      x.from_px, y.to_px, x.to_px - x.from_px, y.from_px - y.to_px);
  const double middle = 0.5 * (y.from_px + y.to_px);
  out += text_at(0.5 * (x.from_px + x.to_px), y.from_px + 40, chart.x_label, "middle", 13);
  return out + text_at(18, middle, chart.y_label, "middle", 13,
                       fmt::format(" transform=\"rotate(-90 18 {:.1f})\"", middle));
}

/// The legend, in one row above the axes, or in two if one is too short.
std::string legend(const Chart& chart, double top) {
  struct Entry {
    const ChartLine& line;
    double x;
    int row;
  };
  std::vector<Entry> entries;
  double x = kLeft;
  int rows = 1;
  for (const ChartLine& line : chart.lines) {
    if (line.name.empty()) continue;
    const double width = 46 + 6.2 * static_cast<double>(line.name.size());
    if (x > kLeft && x + width > chart.width_px) {
      x = kLeft;
      ++rows;
    }
    entries.push_back({line, x, rows - 1});
    x += width;
  }
  std::string out;
  for (const Entry& e : entries) {
    const double y = top + 44 + 15 * (e.row - 0.5 * (rows - 1));
    if (e.line.width_px > 0) out += segment(e.x, y, e.x + 26, y, stroke(e.line));
    if (e.line.dot_px > 0) out += dot(e.line, e.x + 13, y);
    out += text_at(e.x + 32, y + 4, e.line.name, "start", 12);
  }
  return out;
}

std::string panel(const Chart& chart, double top) {
  Axis x, y;
  for (const ChartLine& line : chart.lines) {
    for (double value : line.x) x.take_in(value);
    for (double value : line.y) y.take_in(value);
  }
  if (!chart.equal_scale) y.take_in(0);
  x.close(0.02);
  y.close(0.05);
  x.from_px = kLeft, x.to_px = chart.width_px - kRight;
  y.from_px = top + chart.height_px - kBottom, y.to_px = top + kTop;
  if (chart.equal_scale) {
    const double px = std::min(x.px_per_unit(), y.px_per_unit());
    x.loosen(px);
    y.loosen(px);
  }
  std::string out = text_at(kLeft, top + 24, chart.title, "start", 15) + axes(chart, x, y);
  for (const ChartLine& line : chart.lines) {
    if (line.width_px > 0) out += polylines(line, x, y);
    if (line.dot_px > 0) out += dots(line, x, y);
  }
  return out + legend(chart, top);
}

std::string opening(double width, double height) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width, height);
}

}  // namespace

std::vector<double> round_ticks(double least, double most, int count) {
  const double raw = (most - least) / count, unit = std::pow(10, std::floor(std::log10(raw)));
  const double ratio = raw / unit;
  const double step = unit * (ratio <= 1 ? 1 : ratio <= 2 ? 2 : ratio <= 5 ? 5 : 10);
  std::vector<double> ticks;
  // Multiples of the step, not sums of it: 0 stays 0.
  for (double k = std::ceil(least / step); k * step <= most; ++k) ticks.push_back(k == 0 ? 0 : k * step);
  return ticks;
}

std::string to_svg(const std::vector<Chart>& charts) {
  double width = 0, height = 0;
  for (const Chart& chart : charts) {
    width = std::max(width, chart.width_px);
    height += chart.height_px;
  }
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + opening(width, height);
  double top = 0;
  for (const Chart& chart : charts) {
    out += panel(chart, top);
    top += chart.height_px;
  }
  return out + "</svg>\n";
}

std::string to_svg_element(const Chart& chart) {
  return opening(chart.width_px, chart.height_px) + panel(chart, 0) + "</svg>\n";
}

std::string xml_escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else if (static_cast<unsigned char>(c) >= ' ')
      out += c;
  }
  return out;
}

}  // namespace brachy
