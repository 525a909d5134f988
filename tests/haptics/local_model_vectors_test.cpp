#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "haptics/force/local_force.h"
#include "haptics/force/received_force.h"
#include "test_paths.h"
#include "tests/haptics/any_number.h"

// The test vectors of LOCAL_MODEL (net/PROTOCOL.md): local_model_vectors.json holds what a device receives and where
// its tip is, and the force that LocalForce gives. They are for those who write the device's side again, in another
// language. To generate them again after a change of LocalForce that is meant:
//   BRACHY_WRITE_VECTORS=1 build/release/bin/haptics_tests --gtest_filter='LocalModelVectors.*'

namespace brachy {
namespace {

using Json = nlohmann::json;
using test::next_time;
using test::numbers;

constexpr const char* kVectorsFile = BRACHY_SOURCE_DIR "/tests/haptics/local_model_vectors.json";
constexpr std::int64_t kMillisecond = 1'000'000;
constexpr double kNoBound = std::numeric_limits<double>::infinity();

/// JSON has no infinity and no NaN: they are the strings "inf", "-inf" and "nan".
Json json_of(double number) {
  if (std::isnan(number)) return "nan";
  if (std::isinf(number)) return number > 0 ? "inf" : "-inf";
  return number;
}
Json json_of(const Vec3& v) {
  return Json::array({json_of(v.x()), json_of(v.y()), json_of(v.z())});
}
double number_of(const Json& json) {
  if (!json.is_string()) return json.get<double>();
  if (json == "nan") return std::nan("");
  return json == "inf" ? kNoBound : -kNoBound;
}
Vec3 vector_of(const Json& json) {
  return {number_of(json.at(0)), number_of(json.at(1)), number_of(json.at(2))};
}

Json json_of(const LocalContactModel& m) {
  return {{"contact", int{m.in_contact} | int{m.is_capsule} << 1 | int{m.is_stuck} << 2},
          {"reference_tip", json_of(m.reference_tip)},
          {"contact_point", json_of(m.contact_point)},
          {"axis", json_of(m.axis)},
          {"axial_stiffness_n_per_mm", json_of(m.axial_stiffness_n_per_mm)},
          {"axial_min_n", json_of(m.axial_min_n)},
          {"axial_max_n", json_of(m.axial_max_n)},
          {"after_puncture_n", json_of(m.after_puncture_n)},
          {"lateral_n", json_of(m.lateral_n)},
          {"lateral_stiffness_n_per_mm", json_of(m.lateral_stiffness_n_per_mm)},
          {"time_to_live_s", json_of(m.time_to_live_s)}};
}
LocalContactModel model_of(const Json& json) {
  LocalContactModel m;
  const int contact = json.at("contact");
  m.in_contact = contact & 1;
  m.is_capsule = contact & 2;
  m.is_stuck = contact & 4;
  m.reference_tip = vector_of(json.at("reference_tip"));
  m.contact_point = vector_of(json.at("contact_point"));
  m.axis = vector_of(json.at("axis"));
  m.axial_stiffness_n_per_mm = number_of(json.at("axial_stiffness_n_per_mm"));
  m.axial_min_n = number_of(json.at("axial_min_n"));
  m.axial_max_n = number_of(json.at("axial_max_n"));
  m.after_puncture_n = number_of(json.at("after_puncture_n"));
  m.lateral_n = vector_of(json.at("lateral_n"));
  m.lateral_stiffness_n_per_mm = number_of(json.at("lateral_stiffness_n_per_mm"));
  m.time_to_live_s = number_of(json.at("time_to_live_s"));
  return m;
}

/// What the device's side gives after one step: written into the file, or compared with it.
Json result_of(LocalForce& local, const Json& step) {
  const std::int64_t now_ns = step.at("now_ns");
  if (step.contains("model")) {
    const Json& stamp = step.at("pose_stamp_ns");
    const std::int64_t pose_stamp_ns = stamp.is_null() ? LocalForce::kUnknown : stamp.get<std::int64_t>();
    const bool is_taken = local.take(model_of(step.at("model")), pose_stamp_ns, now_ns);
    return {{"taken", is_taken}, {"contact_point", json_of(local.model().contact_point)}};
  }
  const Vec3 tip = vector_of(step.at("tip"));
  const DeviceForce force = local.evaluate(tip, now_ns);
  Json result = {{"force_n", json_of(force.force_n)},
                 {"flags", force.flags},
                 {"contact_point", json_of(local.model().contact_point)}};
  if (step.contains("about"))
    result["moment_nmm"] = json_of(force.moment_about(vector_of(step.at("about")), tip));
  return result;
}

/// The same of a device that renders FORCE: what comes in a step, and the force rendered after it.
Json result_of(ReceivedForce& received, const Json& step) {
  const std::int64_t now_ns = step.at("now_ns");
  Json result;
  if (step.contains("received_n"))
    result["taken"] =
        received.take(vector_of(step.at("received_n")), step.at("valid_ms").get<std::uint32_t>(),
                      step.at("is_latched").get<bool>(), now_ns);
  if (step.contains("lost")) received.lose();
  if (step.contains("armed")) received.arm();
  result["force_n"] = json_of(received.evaluate(now_ns));
  result["is_latched"] = received.is_latched();
  return result;
}

LocalForce device_of(const Json& vector) {
  return LocalForce({number_of(vector.at("max_force_n")), number_of(vector.at("max_stiffness_n_per_mm"))});
}

/// One test vector while it is written: what happens at the device, step by step.
class VectorWriter {
 public:
  VectorWriter(const char* name, const char* shows, const ForceLimits& limits = {})
      : vector_{{"name", name},
                {"shows", shows},
                {"max_force_n", json_of(limits.max_force_n)},
                {"max_stiffness_n_per_mm", json_of(limits.max_stiffness_n_per_mm)},
                {"steps", Json::array()}} {}

  VectorWriter& step(Json step) {
    vector_["steps"].push_back(std::move(step));
    return *this;
  }
  VectorWriter& model(std::int64_t ms, const LocalContactModel& model, Json pose_stamp_ns = nullptr) {
    vector_["steps"].push_back(
        {{"now_ns", ms * kMillisecond}, {"model", json_of(model)}, {"pose_stamp_ns", pose_stamp_ns}});
    return *this;
  }
  VectorWriter& tip(std::int64_t ms, const Vec3& tip) {
    vector_["steps"].push_back({{"now_ns", ms * kMillisecond}, {"tip", json_of(tip)}});
    return *this;
  }
  /// The same, and the force's moment about a point.
  VectorWriter& tip(std::int64_t ms, const Vec3& tip, const Vec3& about) {
    this->tip(ms, tip);
    vector_["steps"].back()["about"] = json_of(about);
    return *this;
  }
  /// At rest there for `count` milliseconds, until the slew limit no longer holds.
  VectorWriter& hold(std::int64_t from_ms, int count, const Vec3& at) {
    for (int i = 0; i < count; ++i) tip(from_ms + i, at);
    return *this;
  }
  Json finish() {
    LocalForce local = device_of(vector_);
    for (Json& step : vector_["steps"]) step["result"] = result_of(local, step);
    return vector_;
  }
  /// Of a device that renders FORCE.
  Json finish_received() {
    vector_.erase("max_stiffness_n_per_mm");
    ReceivedForce received(number_of(vector_.at("max_force_n")));
    for (Json& step : vector_["steps"]) step["result"] = result_of(received, step);
    return vector_;
  }

 private:
  Json vector_;
};

/// Tissue that sticks: 1 N of friction, 0.5 N of cutting, contact point at the origin.
LocalContactModel sticking_tissue() {
  LocalContactModel m;
  m.tick = 1;
  m.in_contact = true;
  m.axial_stiffness_n_per_mm = 0.8;
  m.axial_min_n = -1;
  m.axial_max_n = 1.5;
  m.after_puncture_n = 1.5;
  m.lateral_stiffness_n_per_mm = 0.5;
  return m;
}

LocalContactModel capsule() {
  LocalContactModel m;
  m.tick = 1;
  m.is_capsule = true;
  m.is_stuck = false;
  m.axial_stiffness_n_per_mm = 0.8;
  m.axial_max_n = 1.2;
  m.after_puncture_n = 0.3;
  m.reference_tip = Vec3(0, 0, -5);
  return m;
}

LocalContactModel oblique_tissue() {
  LocalContactModel m = sticking_tissue();
  m.axis = Vec3(2, -3, 6) / 7.0;
  m.reference_tip = Vec3(12.5, -7.25, 30.125);
  m.contact_point = m.reference_tip - 0.625 * m.axis;
  m.lateral_n = 0.25 * Vec3(3, 2, 0) / std::sqrt(13.0);
  return m;
}

/// FORCEs for a device that renders them.
Json make_received_vectors() {
  Json all = Json::array();
  const auto force = [](std::int64_t ms, const Vec3& force_n, unsigned valid_ms, bool is_latched = false) {
    return Json{{"now_ns", ms * kMillisecond},
                {"received_n", json_of(force_n)},
                {"valid_ms", valid_ms},
                {"is_latched", is_latched}};
  };
  const auto cycle = [](std::int64_t ms) { return Json{{"now_ns", ms * kMillisecond}}; };
  VectorWriter valid("valid_ms",
                     "a force stands for its valid_ms, 50 ms where it states none, then it is latched");
  std::int64_t ms = 0;
  for (const unsigned valid_ms : {20u, 0u, 200u}) {
    valid.step(force(ms, Vec3(0.5, -0.25, 1.125), valid_ms));
    for (int i = 0; i < 12; ++i) valid.step(cycle(ms += 10));
    Json arm = cycle(++ms);
    arm["armed"] = true;
    valid.step(arm);
  }
  all.push_back(valid.finish_received());
  VectorWriter latch("latch", "a latch of the server's that was ended lets the force in over 0.5 s");
  for (int i = 0; i < 40; ++i) latch.step(force(i * 20, Vec3(0, 0, -2), 50, i < 5));
  Json lost = cycle(801);
  lost["lost"] = true;
  latch.step(lost);
  for (int i = 802; i < 812; ++i) latch.step(force(i, Vec3(0, 0, -2), 50));
  all.push_back(latch.finish_received());
  for (const double limit : {std::nan(""), -1.0, 0.0, -kNoBound, 2.0})
    all.push_back(VectorWriter("limit",
                               "the whole vector is scaled; a limit that is no number above 0 gives no force",
                               {limit, kNoBound})
                      .step(force(0, Vec3(-3, 0, 5), 50))
                      .step(cycle(1))
                      .step(cycle(2))
                      .step(cycle(9))
                      .finish_received());
  auto number = numbers(46);
  VectorWriter any("any_input", "forces and times of every class of numbers");
  std::int64_t now_ns = 0;
  for (int i = 0; i < 150; ++i) {
    now_ns = next_time(number, now_ns);
    Json step = {{"now_ns", now_ns}};
    if (number.below(3) != 0) {
      step["received_n"] = json_of(number.place());
      step["valid_ms"] = number.below(4) == 0 ? 0xFFFFFFFFu : static_cast<unsigned>(number.below(100));
      step["is_latched"] = number.below(20) == 0;
    }
    if (number.below(10) == 0) step["armed"] = true;
    any.step(step);
  }
  all.push_back(any.finish_received());
  return all;
}

Json make_vectors() {
  const Vec3 z = Vec3::UnitZ(), x = Vec3::UnitX();
  Json all = Json::array();
  all.push_back(
      VectorWriter("axial", "sticks, slips at 1.5 N, falls at once where the needle turns, slips at -1 N")
          .model(0, sticking_tissue())
          .hold(0, 5, 0.5 * z)
          .hold(5, 5, 1.5 * z)
          .hold(10, 5, 4 * z)
          .hold(15, 5, 3.5 * z)
          .hold(20, 5, 2.125 * z)
          .hold(25, 8, -1 * z)
          .hold(33, 3, -0.5 * z)
          .finish());
  LocalContactModel aside = sticking_tissue();
  aside.reference_tip = Vec3(1, 0, 0.5);
  aside.lateral_n = Vec3(-0.2, 0.1, 0);
  all.push_back(VectorWriter("lateral", "a spring across the shaft about reference_tip, from lateral_n on")
                    .model(0, aside)
                    .hold(0, 3, aside.reference_tip)
                    .hold(3, 3, Vec3(1.4, 0, 0.5))
                    .hold(6, 3, Vec3(1.4, -0.3, 0.625))
                    .finish());
  const Vec3 tip = Vec3(12.75, -7, 30.25);
  all.push_back(VectorWriter("oblique", "all parts, of a shaft that lies along no axis of W, and moments")
                    .model(0, oblique_tissue())
                    .hold(0, 4, oblique_tissue().reference_tip)
                    .hold(4, 4, tip)
                    .tip(8, tip, tip)
                    .tip(9, tip, Vec3(tip - 200 * oblique_tissue().axis))
                    .finish());
  all.push_back(
      VectorWriter(
          "slew",
          "0.5 N/ms at most, by the caller's clock, and none in a first cycle; a pause counts as 1 ms")
          .model(0, sticking_tissue())
          .tip(0, 1.75 * z)
          .tip(1, 1.75 * z)
          .tip(3, 1.75 * z)
          .tip(3, 1.75 * z)
          .tip(4, 1.75 * z)
          .tip(5, 1.75 * z)
          .tip(6, -1 * z)
          .tip(40, -1 * z)
          .finish());
  LocalContactModel strong = sticking_tissue();
  strong.axial_max_n = kNoBound;
  strong.axial_min_n = -kNoBound;
  all.push_back(VectorWriter("max_force", "the whole vector is scaled to max_force_n; bounds may be infinite",
                             {2, kNoBound})
                    .model(0, strong)
                    .hold(0, 8, Vec3(-3, 0, 5))
                    .hold(8, 12, Vec3(-3, 0, -5))
                    .finish());
  LocalContactModel stiff = oblique_tissue();
  stiff.axial_stiffness_n_per_mm = 4;
  stiff.lateral_stiffness_n_per_mm = 2;
  VectorWriter limited("max_stiffness",
                       "stiffnesses above the limit are cut, the slip force stays, the contact point is kept "
                       "from model to model",
                       {3.3, 0.5});
  for (int i = 0; i < 6; ++i) {
    stiff.reference_tip = oblique_tissue().reference_tip + 0.75 * i * stiff.axis;
    stiff.contact_point = stiff.reference_tip - 0.375 * stiff.axis;
    limited.model(5 * i, stiff, 5 * i * kMillisecond).hold(5 * i, 5, stiff.reference_tip + 0.125 * x);
  }
  all.push_back(limited.finish());
  all.push_back(
      VectorWriter("capsule",
                   "only pushes, stays when the needle leaves, gives way at 1.2 N, 0.3 N from then on")
          .model(0, capsule())
          .hold(0, 2, -1 * z)
          .hold(2, 4, 1 * z)
          .hold(6, 3, -0.5 * z)
          .hold(9, 4, 1.25 * z)
          .hold(13, 4, 2 * z)
          .hold(17, 3, 5 * z)
          .hold(20, 2, 4.75 * z)
          .finish());
  LocalContactModel inside = sticking_tissue();
  inside.is_capsule = true;
  inside.after_puncture_n = 0.5;
  all.push_back(VectorWriter("capsule_from_within", "with the friction of the tissue behind it: pulls too")
                    .model(0, inside)
                    .hold(0, 3, -0.5 * z)
                    .hold(3, 5, 1.75 * z)
                    .hold(8, 5, 2 * z)
                    .hold(13, 5, 0 * z)
                    .finish());
  VectorWriter late("drag", "a model of an older pose: its contact point is dragged through the tips since");
  late.model(0, sticking_tissue());
  const auto hand = [](int ms) { return 0.125 * (ms < 30 ? ms : 60 - ms); };  // in, and back from 30 ms on
  for (int ms = 1; ms <= 40; ++ms) late.tip(ms, hand(ms) * z);
  LocalContactModel then = sticking_tissue();
  then.reference_tip = hand(28) * z;
  then.contact_point = then.reference_tip - 1.875 * z;  // slipping, on the way in
  late.model(40, then, 28 * kMillisecond);
  for (int ms = 41; ms <= 50; ++ms) late.tip(ms, hand(ms) * z);
  all.push_back(late.finish());
  all.push_back(
      VectorWriter("expiry",
                   "time_to_live_s after its arrival the force goes to 0, and comes back with a newer model")
          .model(0, sticking_tissue())
          .hold(0, 4, 1.5 * z)
          .tip(50, 1.5 * z)
          .tip(51, 1.5 * z)
          .tip(52, 1.5 * z)
          .tip(53, 1.5 * z)
          .tip(54, 1.5 * z)
          .model(60, sticking_tissue())
          .hold(60, 4, 1.5 * z)
          .finish());
  LocalContactModel spoiled = sticking_tissue();
  spoiled.axis *= 2;
  all.push_back(VectorWriter("not_usable",
                             "a model with an axis that is no unit vector is refused, the last one stays; a "
                             "tip that is no number takes the force away")
                    .model(0, sticking_tissue())
                    .hold(0, 4, 1.5 * z)
                    .model(4, spoiled)
                    .hold(4, 2, 1.5 * z)
                    .tip(6, Vec3(0, 0, std::nan("")))
                    .tip(7, 1.5 * z)
                    .finish());
  for (const double limit : {std::nan(""), -1.0, 0.0, -kNoBound}) {
    all.push_back(VectorWriter("no_limit_of_force", "a limit that is no number above 0 gives no force",
                               {limit, kNoBound})
                      .model(0, sticking_tissue())
                      .hold(0, 4, 1.5 * z)
                      .finish());
    all.push_back(VectorWriter("no_limit_of_stiffness", "likewise: no model is taken", {3.3, limit})
                      .model(0, sticking_tissue())
                      .hold(0, 4, 1.5 * z)
                      .finish());
  }
  for (const ForceLimits& limits : {ForceLimits{}, ForceLimits{2.5, 8}}) {
    auto number = numbers(45);
    VectorWriter any("any_input", "models and tips of every class of numbers", limits);
    std::int64_t now_ns = 0;
    for (int i = 0; i < 150; ++i) {
      now_ns = next_time(number, now_ns);
      if (number.below(4) == 0)
        any.step({{"now_ns", now_ns},
                  {"model", json_of(number.model())},
                  {"pose_stamp_ns", number.below(2) ? Json() : Json(now_ns / 2)}});
      any.step({{"now_ns", now_ns}, {"tip", json_of(number.place())}});
    }
    all.push_back(any.finish());
  }
  return {{"received", make_received_vectors()},
          {"about",
           "LOCAL_MODEL's and FORCE's test vectors: net/PROTOCOL.md. Lengths mm, forces N, moments N mm, "
           "frame W, times ns "
           "of the device's clock. Each step is a model that arrives or a cycle at a tip; of "
           "received a cycle, with the FORCE that came before it."},
          {"vectors", all}};
}

::testing::AssertionResult is_same(const Json& expected, const Json& actual) {
  if (expected.size() != actual.size())
    return ::testing::AssertionFailure() << expected << " is not " << actual;
  if (expected.is_object()) {
    for (const auto& [key, value] : expected.items()) {
      if (!actual.contains(key)) return ::testing::AssertionFailure() << "no " << key;
      if (auto same = is_same(value, actual.at(key)); !same) return same << " at " << key;
    }
  } else if (expected.is_array()) {
    for (std::size_t i = 0; i < expected.size(); ++i)
      if (auto same = is_same(expected[i], actual[i]); !same) return same << "[" << i << "]";
  } else if (expected.is_number_float()) {
    if (!(std::abs(expected.get<double>() - number_of(actual)) <= 1e-12))
      return ::testing::AssertionFailure() << expected << " is not " << actual;
  } else if (expected != actual) {
    return ::testing::AssertionFailure() << expected << " is not " << actual;
  }
  return ::testing::AssertionSuccess();
}

/// A line for each step.
void write_vectors(std::ofstream& file, const Json& vectors) {
  const char* separator = "\n";
  for (Json vector : vectors) {
    const Json steps = vector.at("steps");
    vector.erase("steps");
    std::string head = vector.dump();
    head.pop_back();
    file << separator << head << ",\"steps\": [";
    separator = "\n  ";
    for (const Json& step : steps) {
      file << separator << step;
      separator = ",\n  ";
    }
    file << "]}";
    separator = ",\n";
  }
}

void write_file(const Json& all) {
  std::ofstream file(kVectorsFile);
  file << "{\"about\": " << all.at("about") << ",\n\"vectors\": [";
  write_vectors(file, all.at("vectors"));
  file << "],\n\"received\": [";
  write_vectors(file, all.at("received"));
  file << "]}\n";
}

Json read_vectors() {
  std::ifstream file(kVectorsFile);
  return Json::parse(file);
}

TEST(LocalModelVectors, AreWhatTheDevicesSideGives) {
  if (std::getenv("BRACHY_WRITE_VECTORS")) write_file(make_vectors());
  const Json vectors = read_vectors().at("vectors");
  EXPECT_EQ(vectors.size(), 21u);
  for (const Json& vector : vectors) {
    LocalForce local = device_of(vector);
    const Json& steps = vector.at("steps");
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const Json result = result_of(local, steps[i]);
      ASSERT_TRUE(is_same(steps[i].at("result"), result)) << vector.at("name") << ", step " << i;
    }
  }
}

TEST(LocalModelVectors, OfForceAreWhatTheDevicesSideGives) {
  const Json vectors = read_vectors().at("received");
  EXPECT_EQ(vectors.size(), 8u);
  for (const Json& vector : vectors) {
    ReceivedForce received(number_of(vector.at("max_force_n")));
    for (const Json& step : vector.at("steps"))
      ASSERT_TRUE(is_same(step.at("result"), result_of(received, step)))
          << vector.at("name") << " at " << step;
  }
}

/// From the document's formula and nothing else: force and place where the slew limit no longer holds.
TEST(LocalModelVectors, AgreeWithTheDocumentsFormula) {
  const Json vectors = read_vectors().at("vectors");
  const auto force_at = [&](const char* name, std::size_t step) {
    for (const Json& vector : vectors)
      if (vector.at("name") == name) return vector_of(vector.at("steps").at(step).at("result").at("force_n"));
    ADD_FAILURE() << name;
    return Vec3(Vec3::Zero());
  };
  const auto near = [](const Vec3& a, const Vec3& b) { return (a - b).norm() < 1e-12; };
  EXPECT_TRUE(near(force_at("axial", 5), Vec3(0, 0, -0.4)));   // −k z at z = 0.5
  EXPECT_TRUE(near(force_at("axial", 15), Vec3(0, 0, -1.5)));  // slips: contact point at 4 − 1.5/0.8 = 2.125
  EXPECT_TRUE(near(force_at("axial", 20), Vec3(0, 0, -1.1)));  // −0.8 (3.5 − 2.125)
  EXPECT_TRUE(near(force_at("axial", 25), Vec3(0, 0, 0)));     // at the contact point
  EXPECT_TRUE(near(force_at("axial", 33), Vec3(0, 0, 1)));     // slips the other way: to −1 + 1/0.8 = 0.25
  EXPECT_TRUE(near(force_at("axial", 36), Vec3(0, 0, 0.6)));   // −0.8 (−0.5 − 0.25)
  EXPECT_TRUE(
      near(force_at("lateral", 9), Vec3(-0.4, 0.25, -0.5)));  // lateral_n − 0.5 (0.4, −0.3, 0) − 0.8·0.625 z
  const LocalContactModel m = oblique_tissue();
  const Vec3 moved = Vec3(12.75, -7, 30.25) - m.reference_tip;
  const double along = moved.dot(m.axis);
  EXPECT_TRUE(near(force_at("oblique", 8),
                   m.lateral_n - 0.5 * (moved - along * m.axis) - 0.8 * (0.625 + along) * m.axis));
}

}  // namespace
}  // namespace brachy
