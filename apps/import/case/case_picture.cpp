#include "apps/import/case/case_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>

#include "apps/charts/gray_png.h"
#include "apps/charts/svg_chart.h"
#include "core/base/colour_text.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/geometry/contours/mesh_contours.h"
#include "core/geometry/volume/volume.h"

namespace brachy {
namespace {

constexpr double kPanelPx = 360, kGapPx = 16, kLinePx = 18;
constexpr double kAroundGlandMm = 45;   // organs beyond are cut off
constexpr double kSeedsWithinMm = 2.5;  // of a plane

/// A plane of the patient: what is to the right and up in the picture.
struct View {
  const char* title;
  Vec3 right, up;  // RAS
  Eigen::Index across;
  const char *left_letter, *right_letter, *up_letter, *down_letter;
};
const std::array<View, 3> kViews = {View{"transverse", -Vec3::UnitX(), Vec3::UnitY(), 2, "R", "L", "A", "P"},
                                    View{"sagittal", -Vec3::UnitY(), Vec3::UnitZ(), 0, "A", "P", "S", "I"},
                                    View{"coronal", -Vec3::UnitX(), Vec3::UnitZ(), 1, "R", "L", "S", "I"}};

/// A square of the world about a point, as pixels of a panel.
struct Window {
  Vec3 middle;
  double half_mm;

  double x_px(const View& view, const Vec3& p) const {
    return 0.5 * kPanelPx * (1 + view.right.dot(p - middle) / half_mm);
  }
  double y_px(const View& view, const Vec3& p) const {
    return 0.5 * kPanelPx * (1 - view.up.dot(p - middle) / half_mm);
  }
};

/// The image in a panel, from its second to its ninety-eighth percentile.
std::string background(const Volume& image, const View& view, const Window& window) {
  constexpr std::size_t kPixels = 240;
  std::vector<float> values(kPixels * kPixels, NAN), present;
  for (std::size_t row = 0; row < kPixels; ++row)
    for (std::size_t column = 0; column < kPixels; ++column) {
      const double u = (static_cast<double>(column) + 0.5) / kPixels * 2 - 1,
                   v = 1 - (static_cast<double>(row) + 0.5) / kPixels * 2;
      const Vec3 p = window.middle + window.half_mm * (u * view.right + v * view.up);
      if (!image.contains(p)) continue;
      if (const float value = image.at(p); std::isfinite(value)) {
        values[row * kPixels + column] = value;
        present.push_back(value);
      }
    }
  if (present.empty()) return {};
  const auto percentile = [&](double share) {
    const auto at =
        present.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(present.size() - 1));
    std::ranges::nth_element(present, at);
    return *at;
  };
  const float black = percentile(0.02), white = percentile(0.98);
  std::vector<std::uint8_t> pixels;
  for (const float value : values) {
    const float share = white > black ? (value - black) / (white - black) : 0.5F;
    pixels.push_back(
        std::isnan(value) ? 0 : static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0F, 1.0F))));
  }
  return fmt::format("<image width=\"{0}\" height=\"{0}\" href=\"data:image/png;base64,{1}\"/>\n", kPanelPx,
                     to_base64(to_png({kPixels, kPixels, pixels})));
}

/// Where a plane of the world cuts a surface, in RAS.
std::vector<std::vector<Vec3>> outlines(const SurfaceMesh& mesh, Eigen::Index across, double at_mm) {
  const Eigen::Index first = (across + 1) % 3, second = (across + 2) % 3;
  SurfaceMesh turned = mesh;
  for (Vec3& v : turned.vertices) v = Vec3(v[first], v[second], v[across]).eval();
  std::vector<std::vector<Vec3>> all;
  for (const Polygon& polygon : mesh_contours(turned, at_mm)) {
    std::vector<Vec3>& outline = all.emplace_back();
    for (const Vec2& p : polygon) {
      Vec3& v = outline.emplace_back();
      v[first] = p.x();
      v[second] = p.y();
      v[across] = at_mm;
    }
  }
  return all;
}

std::string text_of_picture(double x, double y, const std::string& text, const std::string& more) {
  return fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" font-family=\"sans-serif\" font-size=\"13\" {}>{}</text>\n", x, y,
      more, xml_escaped(text));
}

/// As many columns as fit beside each other at 13 px; a letter of more than two bytes may be as wide as two.
std::size_t columns_of(std::string_view text) {
  std::size_t columns = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    columns += byte >= 0xE0 ? 2 : (byte & 0xC0) == 0x80 ? 0 : 1;
  }
  return columns;
}

/// A paragraph from `y` on, which becomes that of its last line. Broken at blanks, where it is wider than the picture.
std::string paragraph(double x, double& y, const std::string& text, const std::string& more) {
  constexpr std::size_t kColumns = 140;
  std::string body, line;
  const auto end_line = [&] {
    body += text_of_picture(x, y += kLinePx, line, more);
    line.clear();
  };
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!line.empty() && columns_of(line) + 1 + columns_of(word) > kColumns) end_line();
    line += (line.empty() ? "" : " ") + word;
  }
  end_line();
  return body;
}

std::string panel(const ImportedCase& imported, const std::optional<Volume>& image, const View& view,
                  const Window& window, const std::vector<std::string>& colours, std::vector<bool>& is_cut) {
  std::string text = fmt::format("<rect width=\"{0}\" height=\"{0}\" fill=\"#000\"/>\n", kPanelPx);
  if (image) text += background(*image, view, window);
  for (std::size_t n = imported.structures.size(); n-- > 0;)
    for (const auto& outline :
         outlines(imported.structures[n].mesh, view.across, window.middle[view.across])) {
      is_cut[n] = true;
      text += fmt::format("<polygon fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" points=\"", colours[n],
                          n == 0 ? 2.5 : 1.5);
      for (const Vec3& p : outline)
        text += fmt::format("{:.2f},{:.2f} ", window.x_px(view, p), window.y_px(view, p));
      text += "\"/>\n";
    }
  for (const DoseSeed& seed : imported.seeds)
    if (std::abs(seed.position[view.across] - window.middle[view.across]) < kSeedsWithinMm)
      text += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"2.5\" fill=\"#fff\" stroke=\"#000\"/>\n",
                          window.x_px(view, seed.position), window.y_px(view, seed.position));
  const double end = kPanelPx - 6, middle = 0.5 * kPanelPx;
  const std::string white = "fill=\"#fff\"";
  text += text_of_picture(6, middle, view.left_letter, white);
  text += text_of_picture(end, middle, view.right_letter, white + " text-anchor=\"end\"");
  text += text_of_picture(middle, 15, view.up_letter, white + " text-anchor=\"middle\"");
  text += text_of_picture(middle, end, view.down_letter, white + " text-anchor=\"middle\"");
  const double ten_px = 10 * 0.5 * kPanelPx / window.half_mm;
  text += fmt::format("<path d=\"M6,{0} h{1:.2f}\" stroke=\"#fff\" stroke-width=\"2\"/>\n", end, ten_px);
  text += text_of_picture(10 + ten_px, end, "10 mm", white);
  text += text_of_picture(
      6, 15, fmt::format("{}, {:.1f} mm", view.title, std::round(10 * window.middle[view.across]) / 10 + 0.0),
      white);
  return text;
}

std::vector<std::string> colours_of(const ImportedCase& imported) {
  std::vector<std::string> colours;
  for (std::size_t n = 0; n < imported.structures.size(); ++n) {
    const auto& own = imported.structures[n].colour;
    colours.emplace_back(own ? hex_text(*own) : colour_text(distinct_colour(n)));
  }
  return colours;
}

}  // namespace

std::string picture_svg(const ImportedCase& imported) {
  const std::vector<StructurePlace> places = structure_places(as_structures(imported));
  const Vec3 size = places.front().max - places.front().min;
  const Window window{places.front().centroid, 0.5 * size.maxCoeff() + kAroundGlandMm};
  const std::vector<std::string> colours = colours_of(imported);
  std::vector<bool> is_cut(imported.structures.size(), false);
  std::optional<Volume> image;
  if (imported.volume) image.emplace(imported.volume->grid, imported.volume->values);

  std::string body;
  double y = kGapPx;
  for (const std::string& warning : imported.warnings)
    body += paragraph(kGapPx, y, "WARNING: " + warning, "fill=\"#b00000\"");
  y += kGapPx;
  for (std::size_t n = 0; n < kViews.size(); ++n) {
    const double x = kGapPx + static_cast<double>(n) * (kPanelPx + kGapPx);
    body += fmt::format("<svg x=\"{0:.1f}\" y=\"{1:.1f}\" width=\"{2}\" height=\"{2}\">\n", x, y, kPanelPx);
    body += panel(imported, image, kViews.at(n), window, colours, is_cut) + "</svg>\n";
  }
  y += kPanelPx + kGapPx;
  for (std::size_t n = 0; n < imported.structures.size(); ++n) {
    const ImportedStructure& s = imported.structures[n];
    body += fmt::format("<path d=\"M{:.1f},{:.1f} h24\" stroke=\"{}\" stroke-width=\"4\"/>\n", kGapPx,
                        y + kLinePx - 4, colours[n]);
    body += paragraph(
        kGapPx + 32, y,
        fmt::format("{} ({}), {:.2f} cc here, {:.2f} cc in the file{}{}{}", s.name, role_word(s.role),
                    s.surface_cc, s.source_cc, places[n].side.empty() ? "" : ", " + places[n].side,
                    is_cut[n] ? "" : " (not in these planes)",
                    s.notes.empty() ? "" : fmt::format("; {}", fmt::join(s.notes, "; "))),
        "fill=\"#222\"");
  }
  if (!imported.seeds.empty())
    body += text_of_picture(
        kGapPx + 32, y += kLinePx,
        fmt::format("{} seeds; shown: within {:g} mm of a plane", imported.seeds.size(), kSeedsWithinMm),
        "fill=\"#222\"");
  const double width = 4 * kGapPx + 3 * kPanelPx, height = y + kGapPx;
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
             "viewBox=\"0 0 {0:.0f} {1:.0f}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
             width, height) +
         body + "</svg>\n";
}

}  // namespace brachy
