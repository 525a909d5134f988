#pragma once

#include <string>
#include <vector>

namespace brachy {

/// A line of a chart; a point that is not finite interrupts it.
struct ChartLine {
  std::string name{};            ///< in the legend; empty: not listed
  std::string colour{};          ///< an SVG colour
  std::string dashes{};          ///< lengths of dash and gap, px, "6 3"; empty: solid
  double width_px = 1.5;         ///< 0: its dots alone
  double dot_px = 0;             ///< radius of a dot at each point; 0: none
  bool arrows = false;           ///< an arrow head at the end of each of its pieces
  std::vector<double> x{}, y{};  ///< as many of each
};

/// One chart with its axes; both cover all points, y also 0 unless `equal_scale`.
struct Chart {
  std::string title{}, x_label{}, y_label{};  ///< labels with their units
  std::vector<ChartLine> lines{};
  double width_px = 820, height_px = 400;
  bool equal_scale = false;  ///< as many px for a unit of y as for one of x: a map
};

/// The charts below each other as one SVG document, without scripts, fonts or further files.
std::string to_svg(const std::vector<Chart>& charts);

/// A chart as an svg element to embed in an HTML page.
std::string to_svg_element(const Chart& chart);

/// Round values 1, 2 or 5 × 10ⁿ apart that lie in [least, most], about `count` of them; least < most, both finite.
std::vector<double> round_ticks(double least, double most, int count);

/// Text for XML or HTML, in elements and in attributes: markup escaped, control characters removed.
std::string xml_escaped(const std::string& text);

}  // namespace brachy
