#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/charts/svg_chart.h"
#include "apps/score/report_sections.h"

namespace brachy {
namespace {

constexpr double kMarginMm = 6, kSeedMm = 0.9;
// From cold to hot, distinguishable by colour-blind readers too.
constexpr std::array kIsodoseColours = {"#56b4e9", "#0072b2", "#e69f00", "#b03000"};
constexpr const char *kProstateColour = "#222222", *kUrethraColour = "#cc79a7", *kOrganColour = "#8a5a2b";

struct Window {
  double left = 0, right = 0, bottom = 0, top = 0;

  // Seen from the feet, as slices are shown: the patient's right is on the left, anterior up.
  double x(double at) const { return right - at; }
  double y(double at) const { return top - at; }
};

// All slices have the same window, about the prostate.
Window window_of(const std::vector<AxialSlice>& slices) {
  Window w{1e9, -1e9, 1e9, -1e9};
  for (const AxialSlice& slice : slices)
    for (const AxialSlice::Outline& outline : slice.structures) {
      if (&outline != &slice.structures.front() || outline.name != "prostate") continue;
      for (const auto& p : outline.pieces) {
        w.left = std::min({w.left, p[0], p[2]});
        w.right = std::max({w.right, p[0], p[2]});
        w.bottom = std::min({w.bottom, p[1], p[3]});
        w.top = std::max({w.top, p[1], p[3]});
      }
    }
  return {w.left - kMarginMm, w.right + kMarginMm, w.bottom - 1.5 * kMarginMm, w.top + kMarginMm};
}

std::string outline(const OutlinePieces& pieces, const Window& w, const char* colour, double width_mm) {
  std::string path;
  for (const auto& p : pieces)
    path += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", w.x(p[0]), w.y(p[1]), w.x(p[2]), w.y(p[3]));
  return fmt::format("<path d=\"{}\" stroke=\"{}\" stroke-width=\"{}\" fill=\"none\"/>\n", path, colour,
                     width_mm);
}

const char* colour_of(const std::string& structure) {
  return structure == "prostate" ? kProstateColour : structure == "urethra" ? kUrethraColour : kOrganColour;
}

std::string picture(const AxialSlice& slice, const Window& w, std::span<const Vec3> planned,
                    std::span<const Vec3> delivered) {
  std::string out =
      fmt::format("<svg viewBox=\"0 0 {:.1f} {:.1f}\" role=\"img\" aria-label=\"slice at z = {:.0f} mm\">\n",
                  w.right - w.left, w.top - w.bottom, slice.z_mm);
  for (std::size_t level = 0; level < kIsodosePercent.size(); ++level)
    out += outline(slice.isodoses[level], w, kIsodoseColours[level], 0.35);
  for (const AxialSlice::Outline& structure : slice.structures)
    out += outline(structure.pieces, w, colour_of(structure.name), 0.6);
  const auto is_here = [&](const Vec3& p) { return std::abs(p.z() - slice.z_mm) <= 0.5 * kSliceSpacingMm; };
  for (const Vec3& p : planned)
    if (is_here(p))
      out += fmt::format(
          "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" fill=\"none\" stroke=\"#555\" "
          "stroke-width=\".3\"/>\n",
          w.x(p.x()), w.y(p.y()), kSeedMm);
  for (const Vec3& p : delivered)
    if (is_here(p))
      out += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" fill=\"#111\"/>\n", w.x(p.x()),
                         w.y(p.y()), 0.6 * kSeedMm);
  return out + fmt::format("<text x=\"1\" y=\"4\" font-size=\"3.4\">z = {:.0f}</text>\n</svg>\n", slice.z_mm);
}

std::string legend(const char* sources) {
  std::string out =
      "<p class=\"small\">Axial slices, base first, seen from the feet: the patient&rsquo;s right on the "
      "left. Outlines: prostate black, urethra pink, other organs brown. Isodoses ";
  for (std::size_t level = 0; level < kIsodosePercent.size(); ++level)
    out += fmt::format("{}<b style=\"color:{}\">{} %</b>", level ? ", " : "", kIsodoseColours[level],
                       kIsodosePercent[level]);
  return out +
         fmt::format(
             " of the prescription, of the {0} where they are at rest. Rings: planned {0}; dots: delivered "
             "ones, within half a slice&rsquo;s distance.</p>\n",
             sources);
}

}  // namespace

std::string slices_section(const std::vector<AxialSlice>& slices, const char* sources,
                           std::span<const Vec3> planned, std::span<const Vec3> delivered) {
  if (slices.empty()) return "";
  const Window w = window_of(slices);
  std::string out = "<h2>Slices</h2>\n<div class=\"slices\">\n";
  for (auto slice = slices.rbegin(); slice != slices.rend(); ++slice)
    out += picture(*slice, w, planned, delivered);
  return out + "</div>\n" + legend(sources);
}

}  // namespace brachy
