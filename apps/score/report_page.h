#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "apps/charts/svg_chart.h"
#include "apps/score/score.h"
#include "haptics/trajectory/needle_metrics.h"

namespace brachy {

// What the pages of implants and of fractions share. Texts that come from files are escaped.

/// From the doctype to the body, of a page with that title in the browser.
std::string page_start(const std::string& title);
/// From the doctype to the first paragraph: `title`, whose session it was, and `sources`: "6711, 0.5 U each, 145 Gy".
std::string page_head(const char* title, const Score& score, const std::string& sources);

std::string html_cell(const std::string& text, const char* attributes = "");
template <class... Text>
std::string html_row(const Text&... cells) {
  return "<tr>" + (html_cell(cells) + ...) + "</tr>\n";
}
/// Headings may hold line breaks, and are the program's own: not escaped.
std::string html_table(const char* attributes, const std::vector<std::string>& headings,
                       const std::string& rows);
/// One of the figures at the top of a page.
std::string key_figure(const std::string& value, const std::string& what);

std::string remarks_section(const Score& score);
/// Whether the session passes its exercise, bound by bound; empty: it is of none.
std::string exercise_section(const Score& score);
std::string findings_section(const Score& score);
/// Time, path and speed of all needles, a paragraph.
std::string motion_text(const NeedleMetrics& motion);

}  // namespace brachy
