#include "apps/score/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

struct Report : ::testing::Test {
  Plan plan = small_plan();
  Recording recording;
  std::vector<Structure> structures = {{"prostate", octahedron(25)}};

  Report() {
    recording.name = "run1";
    recording.seeds = small_seeds();
    recording.poses = NeedleTrajectories(
        {{0, Trajectory({straight(0, -5, -5, -40), straight(1, -5, -5, -10), straight(2, -5, -5, 0)})}});
    recording.forces = {force_at(0.5, 0, ContactState::kTouching, Vec3(0, 0, -5.5)),
                        force_at(1, 0, ContactState::kInserted, Vec3(0, 0, -3))};
  }
  Score score() const {
    return score_session(plan, kGrid, structures, {.spacing_mm = 2, .margin_mm = 2, .source = {}}, recording);
  }
  std::string html() const { return to_html(score(), plan, kGrid, structures); }
  nlohmann::json json() const { return nlohmann::json::parse(to_json(score())); }
};

TEST_F(Report, JsonHoldsTheSeedsErrors) {
  const auto json = this->json();
  EXPECT_EQ(json.at("recording"), "run1");
  EXPECT_EQ(json.at("plan"), "small");
  EXPECT_EQ(json.at("notice"), "For training and research. Not a medical device.");
  EXPECT_EQ(json.at("planned_seeds"), 3);
  const auto& seeds = json.at("seeds");
  EXPECT_EQ(seeds.at("dropped"), 3);
  EXPECT_TRUE(seeds.at("missing").empty());
  EXPECT_NEAR(seeds.at("rest_error").at("total_mm").at("mean").get<double>(), 8.0 / 3, 1e-12);
  EXPECT_NEAR(seeds.at("rest_error").at("axial_share").get<double>(), 0.75, 1e-12);
  const auto& first = seeds.at("each").at(0);
  EXPECT_EQ(first.at("hole"), "D4");
  EXPECT_NEAR(first.at("dropped_error").at("lateral_mm").get<double>(), 0.5, 1e-12);
  EXPECT_EQ(first.at("planned_mm"), (nlohmann::json{-15.0, -15.0, 12.75}));
  EXPECT_EQ(first.at("gland_motion_mm"), 2);
}

TEST_F(Report, JsonHoldsTheAssignmentByPositionBesideThatByNumber) {
  std::swap((*recording.seeds)[0].planned, (*recording.seeds)[1].planned);
  (*recording.seeds)[2].rest.x() += 100;
  const auto seeds = json().at("seeds");
  EXPECT_EQ(seeds.at("headline"), "2 of 3 placed, 1 missing, 1 extra; placed ones 4.0 mm mean");
  EXPECT_TRUE(seeds.at("missing").empty());
  EXPECT_EQ(seeds.at("each").at(0).at("planned"), 1);
  const auto& by_position = seeds.at("by_position");
  EXPECT_EQ(by_position.at("farthest_mm"), 10);
  EXPECT_EQ(by_position.at("placed"), 2);
  EXPECT_EQ(by_position.at("missing"), nlohmann::json{2});
  EXPECT_EQ(by_position.at("extra"), nlohmann::json{3});
  EXPECT_EQ(by_position.at("each").at(0).at("seed"), 1);
  EXPECT_EQ(by_position.at("each").at(0).at("planned"), 0);
  EXPECT_NEAR(by_position.at("each").at(0).at("rest_error").at("axial_mm").get<double>(), 3, 1e-12);
  EXPECT_NEAR(by_position.at("rest_error").at("lateral_mm").at("mean").get<double>(), 2, 1e-12);
}

TEST_F(Report, JsonHoldsNeedlesAndDose) {
  const auto json = this->json();
  const auto& needles = json.at("needles");
  EXPECT_EQ(needles.at("each").size(), 2u);
  EXPECT_EQ(needles.at("each").at(1).at("hole"), "F6");
  EXPECT_EQ(needles.at("each").at(1).at("path_in_tissue_mm"), 40);
  EXPECT_EQ(needles.at("each").at(1).at("punctures"), 1);
  EXPECT_EQ(needles.at("each").at(1).at("largest_force_n"), 5.5);
  EXPECT_TRUE(needles.at("each").at(0).at("largest_force_n").is_null());
  EXPECT_EQ(needles.at("total").at("punctures"), 1);
  const auto& dose = json.at("dose");
  for (const char* stage : {"plan", "dropped", "rest"}) {
    EXPECT_EQ(dose.at(stage).at("seeds"), 3);
    EXPECT_EQ(dose.at(stage).at("structures").at(0).at("name"), "prostate");
    EXPECT_EQ(dose.at(stage).at("structures").at(0).at("volume_share").size(), 301u);
    EXPECT_EQ(dose.at(stage).at("structures").at(0).at("volume_share").at(0), 1);
  }
  // The same list as the verdict's: the scene's, or the guidelines'.
  ASSERT_EQ(dose.at("goals").size(), default_dose_goals().size());
  EXPECT_EQ(dose.at("goals").at(0).at("figure"), "V100");
  EXPECT_EQ(dose.at("goals").at(0).at("stage"), "plan");
  EXPECT_EQ(dose.at("goals").at(0).at("above"), 95);
  EXPECT_EQ(dose.at("goals").at(0).at("rest"), false);
  EXPECT_EQ(dose.at("goals").at(1).at("figure"), "D90");
  EXPECT_EQ(dose.at("goals").at(1).at("above"), 145);
  EXPECT_TRUE(dose.at("goals").at(3).at("rest").is_null());  // no urethra
}

TEST_F(Report, WhatIsNotKnownIsNullAndADash) {
  recording.seeds.reset();
  recording.poses.reset();
  recording.forces.clear();
  recording.remarks = {"seeds.csv is missing: nothing is known."};
  const auto json = this->json();
  EXPECT_TRUE(json.at("seeds").is_null());
  EXPECT_TRUE(json.at("needles").at("total").at("elapsed_time_s").is_null());
  EXPECT_TRUE(json.at("needles").at("each").at(0).at("passes").is_null());
  EXPECT_TRUE(json.at("dose").at("rest").is_null());
  EXPECT_FALSE(json.at("dose").at("plan").is_null());
  EXPECT_EQ(json.at("remarks").at(0), recording.remarks[0]);
  const std::string html = this->html();
  EXPECT_NE(html.find("<p>seeds.csv is missing: nothing is known.</p>"), html.npos);
  EXPECT_NE(html.find("<td>–</td>"), html.npos);
  EXPECT_EQ(count_of(html, "nan"), 0u);
  EXPECT_NE(to_text(score()).find("not known what fell"), std::string::npos);
}

TEST_F(Report, ThePageStandsAlone) {
  const std::string html = this->html();
  EXPECT_TRUE(html.starts_with("<!DOCTYPE html>"));
  EXPECT_TRUE(html.ends_with("</html>\n"));
  for (const char* absent : {"<script", "javascript:", "href", "src=", "url(", "@import", "onload", "<?xml"})
    EXPECT_EQ(count_of(html, absent), 0u) << absent;
  // The only addresses are the names of SVG's namespace.
  EXPECT_EQ(count_of(html, "http"), count_of(html, "xmlns=\"http://www.w3.org/2000/svg\""));
  const std::size_t slices = count_of(html, "aria-label=\"slice at z");
  EXPECT_GT(slices, 6u);                           // every 5 mm
  EXPECT_EQ(count_of(html, "<svg"), 4u + slices);  // histograms, two maps, errors
  for (const char* element : {"svg", "table", "tr", "td", "th", "div", "text", "h2", "p"})
    EXPECT_EQ(
        count_of(html, std::string("<") + element + ">") + count_of(html, std::string("<") + element + " "),
        count_of(html, std::string("</") + element + ">"))
        << element;
  EXPECT_NE(html.find("For training and research. Not a medical device."), html.npos);
  EXPECT_NE(html.find("@page"), html.npos);
  for (const char* nonsense : {"nan", "inf\"", "inf<", "-0.00<"})
    EXPECT_EQ(count_of(html, nonsense), 0u) << nonsense;
}

TEST_F(Report, ThePageShowsEverySeedAndNeedle) {
  (*recording.seeds)[1].rest += Vec3(0, 9, 0);
  const std::string html = this->html();
  EXPECT_NE(html.find("<td>missing</td><td>1</td><td>D4</td>"), html.npos);
  EXPECT_NE(html.find("<td>2</td><td>extra</td>"), html.npos);
  EXPECT_NE(
      html.find(
          "<td>1</td><td>0</td><td>D4</td><td>2.25</td><td>1.0</td><td>1.30</td><td>-1.20</td><td>0.50</td>"),
      html.npos);
  EXPECT_NE(html.find("<tr><td>F6</td><td>1</td><td>1</td><td>40.0</td>"), html.npos);
  EXPECT_NE(html.find("planned seeds placed, 1 missing, 1 extra"), html.npos);
}

TEST_F(Report, NamesAreTextNotMarkup) {
  plan.name = "<script>alert('x')</script>&\"";
  recording.name = "a<b>&\"c'";
  recording.remarks = {"<img src=x onerror=alert(1)>"};
  structures[0].name = "</svg><b>";
  const std::string html = this->html();
  EXPECT_EQ(count_of(html, "<script"), 0u);
  EXPECT_EQ(count_of(html, "<img"), 0u);
  EXPECT_EQ(count_of(html, "</svg><b>"), 0u);
  EXPECT_NE(html.find("&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;&quot;"), html.npos);
  EXPECT_NE(html.find("<title>Implant score: a&lt;b&gt;&amp;&quot;c&#39;</title>"), html.npos);
  EXPECT_EQ(json().at("plan"), plan.name);
}

TEST_F(Report, AFoldersNameNeedNotBeUtf8) {
  recording.name = "run\xff";
  EXPECT_TRUE(json().at("recording").get<std::string>().starts_with("run"));
}

TEST_F(Report, ASessionInWhichNothingFellIsStillDrawn) {
  recording.seeds = std::vector<Seed>();
  const std::string html = this->html();
  EXPECT_EQ(count_of(html, "<td>missing</td>"), 3u);
  EXPECT_EQ(count_of(html, "nan"), 0u);
  EXPECT_TRUE(json().at("seeds").at("rest_error").at("total_mm").at("mean").is_null());
}

TEST_F(Report, TheTextIsShortAndHasTheFigures) {
  const std::string text = to_text(score());
  EXPECT_LT(count_of(text, "\n"), 22u);
  EXPECT_NE(text.find("seeds: 3 of 3 placed, 0 missing, 0 extra; placed ones 2.7 mm mean"), text.npos)
      << text;
  EXPECT_NE(text.find("2.67"), text.npos) << text;
  EXPECT_NE(text.find("Not a medical device"), text.npos);
}

TEST_F(Report, IsTheSameEachTime) {
  EXPECT_EQ(html(), html());
  EXPECT_EQ(to_json(score()), to_json(score()));
}

}  // namespace
}  // namespace brachy
