#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/number_text.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

using enum Reload;

// Outer diameters of regular-wall needles, mm (ISO 9626).
constexpr std::array<std::pair<int, double>, 12> kGauges = {{{14, 2.11},
                                                             {15, 1.83},
                                                             {16, 1.65},
                                                             {17, 1.47},
                                                             {18, NeedleSettings::kReferenceDiameter},
                                                             {19, 1.07},
                                                             {20, 0.91},
                                                             {21, 0.82},
                                                             {22, 0.72},
                                                             {23, 0.64},
                                                             {24, 0.57},
                                                             {25, 0.51}}};

void set_gauge(const TomlTable& t, NeedleSettings& s, std::int64_t gauge) {
  const double diameter = kGauges[static_cast<std::size_t>(gauge - kGauges.front().first)].second;
  if (t.has("diameter_mm") && s.diameter_mm != diameter)
    t.contradiction("gauge",
                    "is " + text_of(diameter) + " mm and needle.diameter_mm another; give one of them");
  s.diameter_mm = diameter;
}

void set_radius(const TomlTable& t, NeedleSettings& s, double radius) {
  if ((t.has("diameter_mm") || t.has("gauge")) && radius != 0.5 * s.diameter_mm)
    t.contradiction("radius_mm",
                    "is not half of needle.diameter_mm (" + text_of(s.diameter_mm) + "); give one of them");
  s.diameter_mm = 2 * radius;
}

std::vector<Key<NeedleSettings>> needle_keys() {
  using S = NeedleSettings;
  return {
      number("length_mm", &S::length_mm, {10, 500}, kRestart, "hub to tip, 18 G brachytherapy needle"),
      number("diameter_mm", &S::diameter_mm, {0.1, 10}, kRestart, "outer diameter, 18 G"),
      alternative<S>("gauge", IntegerRange{kGauges.front().first, kGauges.back().first}, 18, kRestart,
                     "the diameter by ISO 9626, in place of diameter_mm", set_gauge),
      alternative<S>("radius_mm", Range{0.05, 5}, 0.635, kRestart,
                     "half the diameter, in place of diameter_mm", set_radius),
      flag("flexible", &S::flexible, kRestart,
           "elastic, fem: the needle bends, as a beam; false: it is rigid"),
      number("youngs_modulus_gpa", &S::youngs_modulus_gpa, {0.01, 1e12}, kRestart,
             "flexible: of steel; rigid from 1e9 on"),
      number("inner_diameter_mm", &S::inner_diameter_mm, {0, 10}, kRestart,
             "flexible: 0: solid, as with its stylet in; 1.0 for an 18 G tube without"),
      number("hand_nmm_per_deg", &S::hand_nmm_per_deg, {0, 1e6}, kRestart,
             "flexible: moment at the hub that turns the hand by 1°; 0: it holds the hub fast"),
      number("bevel_force_share", &S::bevel_force_share, {0, 1}, kRestart,
             "flexible: force of a bevel across the tip as it cuts, over the cutting force; 0: symmetric"),
      number("bevel_deg", &S::bevel_deg, {-360, 360}, kRestart,
             "flexible: where the bevel pushes the tip: about the shaft, from the pose's +x towards +y"),
      integer("locking_count", &S::locking_count, {0, NeedleSettings::kMaxCount}, kRestart,
              "needles, the last ones of count, that lock the gland by barbs"),
      text("guide_at", &S::guide_at, {"none", "template", "hand"}, kRestart,
           "flexible: what holds the shaft across besides the hand where it passes the template: a hole that "
           "is fixed, "
           "or one that goes with the hand"),
      integer("count", &S::count, {1, NeedleSettings::kMaxCount}, kRestart,
              "needles that may be in the scene at the same time; each has its own device"),
  };
}

void check_needle(const TomlTable& t, Scene& scene) {
  const NeedleSettings& s = scene.needle;
  if (s.inner_diameter_mm >= s.diameter_mm)
    t.contradiction("inner_diameter_mm", "is " + text_of(s.inner_diameter_mm) +
                                             ", no less than needle.diameter_mm (" + text_of(s.diameter_mm) +
                                             ")");
  const std::string& kernel = scene.model.kernel;
  if (s.flexible && kernel != "auto" && !knows_forces(kernel))
    t.contradiction("flexible",
                    "needs a model that knows forces; set model.kernel to \"elastic\" or \"fem\"");
}

std::vector<Key<GlandSettings>> gland_keys() {
  using S = GlandSettings;
  return {
      flag("moves", &S::moves, kRestart, "elastic, fem: the gland moves as a whole on its ligaments"),
      numbers("stiffness_n_per_mm", &S::stiffness_n_per_mm, {0.01, 1000}, kRestart,
              "of the whole gland along x, y and z, the walls of [box] included; 7 N move it 10 mm along z"),
      number("rotation_nmm_per_deg", &S::rotation_nmm_per_deg, {0.1, 1e6}, kRestart,
             "moment that turns it by 1° about its apex"),
  };
}

void check_gland(const TomlTable& t, Scene& scene) {
  if (scene.gland.moves && scene.model.kernel != "auto" && !knows_forces(scene.model.kernel))
    t.contradiction("moves", "needs a model that knows forces; set model.kernel to \"elastic\" or \"fem\"");
}

std::vector<Key<SwellingSettings>> swelling_keys() {
  using S = SwellingSettings;
  return {
      flag("on", &S::on, kRestart, "the gland swells with the punctures: 2.5 of 37 cc after two, up to 4.5"),
      number("build_up_s", &S::build_up_s, {0.1, 1e4}, kRestart, "time constant with which it swells"),
  };
}

std::vector<Key<ProbeSettings>> probe_keys() {
  using S = ProbeSettings;
  return {
      flag("on", &S::on, kRestart,
           "elastic, fem: a transrectal probe, the instrument after the needles, with a device of its own"),
      number("diameter_mm", &S::diameter_mm, {5, 50}, kRestart, "of a biplane endorectal probe"),
      number("length_mm", &S::length_mm, {20, 500}, kRestart, "tip to handle"),
      number("rectal_wall_mm", &S::rectal_wall_mm, {0, 20}, kRestart, "between probe and gland"),
      number("surroundings_n_per_mm", &S::surroundings_n_per_mm, {0, 100}, kRestart,
             "what rectum and pelvic floor take of each mm that it pushes; 30 N move the gland's back 12 mm"),
      number("landmark_spacing_mm", &S::landmark_spacing_mm, {2, 20}, kRestart,
             "between points of the gland's surface that it may push"),
  };
}

void check_probe(const TomlTable& t, Scene& scene) {
  const ProbeSettings& s = scene.probe;
  if (s.on && scene.model.kernel != "auto" && !knows_forces(scene.model.kernel))
    t.contradiction("on", "needs a model that knows forces; set model.kernel to \"elastic\" or \"fem\"");
  if (s.length_mm < s.diameter_mm)
    t.contradiction("length_mm", "is " + text_of(s.length_mm) + ", less than probe.diameter_mm (" +
                                     text_of(s.diameter_mm) + ")");
}

std::vector<Key<NoiseSettings>> noise_keys() {
  using S = NoiseSettings;
  constexpr Range kLength = {0, 20};
  return {
      flag("on", &S::on, kRestart, "needles and seeds miss as in the clinic, by chance but repeatably"),
      integer("seed", &S::seed, {0, std::numeric_limits<std::int64_t>::max()}, kRestart, "of the chance"),
      number("template_play_mm", &S::template_play_mm, kLength, kRestart,
             "SD across the needle, of each insertion"),
      number("tremor_mm", &S::tremor_mm, kLength, kRestart, "SD of the hand, 8 to 12 Hz, in each direction"),
      number("drift_mm", &S::drift_mm, kLength, kRestart,
             "SD along all needles together: catheters drift by 1.8 between fractions"),
      number("stop_s", &S::stop_s, {0, 1}, kRestart,
             "SD of where the hand stops along the needle, over its speed"),
      number("drop_along_mm", &S::drop_along_mm, kLength, kRestart, "SD of each seed along the needle"),
      number("drop_across_mm", &S::drop_across_mm, kLength, kRestart, "SD of each seed across, twice"),
      number("migration_along_mm", &S::migration_along_mm, kLength, kRestart,
             "SD of how far each seed follows the needle out"),
  };
}

std::vector<Key<ContactSettings>> contact_keys() {
  using S = ContactSettings;
  return {
      number(
          "tip_core_mm", &S::tip_core_mm, {0, 100}, kLive,
          "elastic, fem: a tip's force is spread over this radius; 0: before the puncture as wide as makes "
          "the tissue yield by the capsule's law, then 12 mm; else at least √(F/32μ), 5.4 mm for 5.6 N at 6 "
          "kPa"),
      number("surface_slip_mm", &S::surface_slip_mm, {0, 50}, kLive,
             "drag along the capsule beyond which the contact point slides"),
      number("landmark_spacing_mm", &S::landmark_spacing_mm, {0.5, 50}, kLive, "between shaft landmarks"),
      number("leave_path_mm", &S::leave_path_mm, {0.1, 50}, kLive,
             "a tip this far beside an old cut cuts a new one"),
      number("max_displacement_mm", &S::max_displacement_mm, {0.1, 100}, kLive,
             "of a landmark; limited to this and flagged"),
      number("max_jump_mm", &S::max_jump_mm, {0.1, 1000}, kLive,
             "a needle whose tip moves farther in one tick is reinitialized"),
      number("relaxation_share", &S::relaxation_share, {0, 0.95}, kLive,
             "of a force, what relaxes while the needle rests; 0.5 as measured in liver; 0: none"),
      number("relaxation_s", &S::relaxation_s, {0.01, 1000}, kLive, "time constant with which it does"),
      number("locking_force_n", &S::locking_force_n, {0, 100}, kLive,
             "what a locking needle's barbs hold along its shaft, besides friction"),
      number("bone_n_per_mm", &S::bone_n_per_mm, {0.1, 1000}, kLive,
             "with which bone (a structure named pubic_arch) pushes back; a device takes what it can"),
      integer("max_landmarks", &S::max_landmarks, {2, 100}, kLive,
              "of a needle; spacing × (max - 1) must cover its length"),
  };
}

void check_contact(const TomlTable& t, Scene& scene) {
  const ContactSettings& s = scene.contact;
  const double needle_length_mm = scene.needle.length_mm;
  if (s.tip_core_mm > 0 && s.tip_core_mm < 0.1)
    t.contradiction("tip_core_mm", "is " + text_of(s.tip_core_mm) + "; give 0 or at least 0.1");
  if (s.landmark_spacing_mm * (s.max_landmarks - 1) < needle_length_mm)
    t.contradiction(
        "max_landmarks",
        "(" + std::to_string(s.max_landmarks) +
            ") at contact.landmark_spacing_mm = " + text_of(s.landmark_spacing_mm) +
            " does not cover the needle of " + text_of(needle_length_mm) + " mm; set it to at least " +
            text_of(std::ceil(needle_length_mm / s.landmark_spacing_mm) + 1) + " or widen the spacing");
}

}  // namespace

std::vector<SceneSection> needle_sections() {
  return {
      {"needle", "The needle.",
       within<Scene>(
           needle_keys(), [](auto& s) -> auto& { return s.needle; }),
       check_needle},
      {"gland", "How the gland moves as a whole.",
       within<Scene>(
           gland_keys(), [](auto& s) -> auto& { return s.gland; }),
       check_gland},
      {"probe", "The transrectal probe.",
       within<Scene>(
           probe_keys(), [](auto& s) -> auto& { return s.probe; }),
       check_probe},
      ultrasound_section(),
      {"swelling", "How the gland swells under the needles.",
       within<Scene>(
           swelling_keys(), [](auto& s) -> auto& { return s.swelling; })},
      {"noise", "Clinical noise: why a perfect hand's seeds are off.",
       within<Scene>(
           noise_keys(), [](auto& s) -> auto& { return s.noise; })},
      {"contact", "How a needle's landmarks are placed.",
       within<Scene>(
           contact_keys(), [](auto& s) -> auto& { return s.contact; }),
       check_contact},
  };
}

}  // namespace brachy
