#pragma once

#include <string>
#include <vector>

namespace brachy {

/// A line of a chart; a point that is not finite interrupts it.
struct ChartLine {
  std::string name;    ///< in the legend; empty: not there
  std::string colour;  ///< as SVG has it
  bool dashed = false;
  double width_px = 1.5;
  std::vector<double> x, y;  ///< as many of each
};

/// One chart with its axes; both take in all points, y also 0.
struct Chart {
  std::string title, x_label, y_label;  ///< labels with their units
  std::vector<ChartLine> lines;
};

/// The charts below each other as one SVG document, without any script, font or file of its own.
std::string to_svg(const std::vector<Chart>& charts);

/// Round values 1, 2 or 5 × 10ⁿ apart that lie in [least, most], about `count` of them; least < most, both finite.
std::vector<double> round_ticks(double least, double most, int count);

}  // namespace brachy
