#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"
#include "core/scene/load_tissue.h"
#include "core/scene/load_tissues.h"
#include "test_paths.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

std::string refusal(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const UserError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return "accepted";
}

TEST(Scene, TheDefaultFileSaysTheDefaults) {
  const Scene file = load_scene(BRACHY_SOURCE_DIR "/config/prostate.toml");
  const Scene built_in = parse_scene("", "nothing");
  EXPECT_EQ(file.name, built_in.name);
  EXPECT_EQ(file.tissue, built_in.tissue);
  EXPECT_EQ(file.box, built_in.box);
  EXPECT_EQ(file.regions, built_in.regions);
  EXPECT_EQ(file.model, built_in.model);
  EXPECT_EQ(file.anchors, built_in.anchors);
  EXPECT_EQ(file.needle, built_in.needle);
  EXPECT_EQ(file.contact, built_in.contact);
  EXPECT_EQ(file.template_grid, built_in.template_grid);
  EXPECT_EQ(file.seeds, built_in.seeds);
  EXPECT_EQ(file.plan_file, built_in.plan_file);
  EXPECT_EQ(file.dose, built_in.dose);
  EXPECT_EQ(file.structures, built_in.structures);
  EXPECT_EQ(file.rates, built_in.rates);
  EXPECT_EQ(file.engine, built_in.engine);
  EXPECT_EQ(file.work_costs, built_in.work_costs);
  EXPECT_EQ(file.realtime, built_in.realtime);
  EXPECT_EQ(file.device, built_in.device);
  EXPECT_EQ(file.server, built_in.server);
  EXPECT_EQ(file.broker, built_in.broker);
}

TEST(Scene, UnknownKeysAreRefusedWithLineAndNearestName) {
  EXPECT_EQ(refusal("[model]\nkernel = \"psi31\"\nsuport_radius_mm = 12\n"),
            "scene.toml:3: unknown key 'model.suport_radius_mm'; did you mean 'model.support_radius_mm'?");
  EXPECT_EQ(refusal("\n[modle]\n"), "scene.toml:2: unknown key 'modle'; did you mean 'model'?");
}

TEST(Scene, WhatAFileHoldsStandsInARefusalAsOneShortLine) {
  EXPECT_TRUE(refusal("[model]\nkernel = \"a\\n\\u001b[2J\"")
                  .starts_with("scene.toml:2: 'model.kernel' is \"a  [2J\"; it"));
  EXPECT_TRUE(
      refusal("\"two\\nlines\" = 1").starts_with("scene.toml:1: unknown key 'two lines'; did you mean"));
  const std::string many(5000, 'x');
  EXPECT_LT(refusal("[model]\nkernel = \"" + many + "\"").size(), 300u);
  EXPECT_LT(refusal("[model]\n" + many + " = 1").size(), 300u);
  EXPECT_LT(refusal("[box]\nheld = [\"" + many + "\"]").size(), 300u);
}

TEST(Scene, ABodyIsReadAsAReferenceSceneSaysIt) {
  const Scene scene = load_scene(BRACHY_SOURCE_DIR "/tests/reference/free_face_stiff_lateral/scene.toml");
  EXPECT_EQ(scene.box.size_mm, Vec3(96, 96, 96));
  EXPECT_EQ(scene.box.held, (std::array<bool, 6>{true, true, true, true, false, true}));
  ASSERT_EQ(scene.regions.size(), 1u);
  EXPECT_EQ(scene.regions[0].semi_axes_mm, Vec3(24, 18, 21));
  EXPECT_EQ(scene.needle.diameter_mm, 4);
  const ElasticBody body = load_body(scene);
  EXPECT_DOUBLE_EQ(body.shear_modulus, 1e-3 * scene.tissue.shear_modulus_kpa);
  EXPECT_DOUBLE_EQ(body.materials().at(1), 3);
  EXPECT_EQ(body.needle_radius, 2);
}

TEST(Scene, SaysWhatGuardsAgainstFolds) {
  EXPECT_EQ(parse_scene("", "scene.toml").stability.policy, "substep");
  const Scene scene = parse_scene("[stability]\npolicy = \"clamp\"\nmax_substeps = 3", "scene.toml");
  EXPECT_EQ(scene.stability.policy, "clamp");
  EXPECT_EQ(scene.stability.max_substeps, 3);
  EXPECT_NE(refusal("[stability]\npolicy = \"hope\"").find("scene.toml:2: 'stability.policy'"),
            std::string::npos);
  EXPECT_NE(refusal("[stability]\nmax_substeps = 0").find("scene.toml:2: 'stability.max_substeps'"),
            std::string::npos);
}

TEST(Scene, ABodyThatMakesNoSenseIsRefused) {
  const std::string ellipsoid = "[[region]]\nshape = \"ellipsoid\"\nshear_modulus_kpa = 2\n";
  EXPECT_NE(refusal(ellipsoid).find("scene.toml:1: 'region.centre_mm' is missing"), std::string::npos);
  EXPECT_NE(refusal("[[region]]\nshape = \"mesh\"\nshear_modulus_kpa = 2").find("'region.file' is missing"),
            std::string::npos);
  EXPECT_NE(refusal("[box]\nheld = [\"-x\", \"up\"]").find("scene.toml:2: 'box.held' has \"up\""),
            std::string::npos);
  EXPECT_NE(refusal("[box]\nheld = []").find("is empty"), std::string::npos);
  EXPECT_NE(refusal("[box]\nsize_mm = [1, 2]").find("needs three numbers"), std::string::npos);
  EXPECT_NE(refusal("[needle]\ndiameter_mm = 2\nradius_mm = 2").find("is not half of"), std::string::npos);
  EXPECT_NE(refusal("[contact]\ntip_core_mm = 0.05")
                .find("scene.toml:2: 'contact.tip_core_mm' is 0.05; give 0 or at least 0.1"),
            std::string::npos);
  const Scene far =
      parse_scene(ellipsoid + "centre_mm = [40, 0, 0]\nsemi_axes_mm = [10, 10, 10]", "scene.toml");
  EXPECT_THROW(load_body(far), UserError);
}

TEST(Scene, RegionsHaveAModulusOrASupportOrBoth) {
  const Scene scene = parse_scene(
      "[[region]]\nshape = \"sphere\"\ncentre_mm = [1, 2, 3]\nradius_mm = 9\nsupport_radius_mm = 20\n"
      "[[region]]\nshape = \"ellipsoid\"\ncentre_mm = [0, 0, 0]\nsemi_axes_mm = [5, 2, 7]\n"
      "support_radius_mm = 6\nshear_modulus_kpa = 3\n"
      "[[region]]\nshape = \"mesh\"\nfile = \"gland.stl\"\nsupport_radius_mm = 6\nblend_mm = 7.5\n",
      "scene.toml");
  ASSERT_EQ(scene.regions.size(), 3u);
  EXPECT_EQ(scene.regions[0].semi_axes_mm, Vec3(9, 9, 9));
  EXPECT_EQ(scene.regions[0].support_radius_mm, 20);
  EXPECT_FALSE(scene.regions[0].shear_modulus_kpa);
  EXPECT_EQ(scene.regions[0].blend_mm, 8);
  EXPECT_EQ(scene.regions[0].place, "scene.toml:1");
  EXPECT_EQ(scene.regions[1].shear_modulus_kpa, 3);
  EXPECT_EQ(scene.regions[1].blend_mm, 4);  // the region is no wider
  EXPECT_EQ(scene.regions[1].place, "scene.toml:6");
  EXPECT_EQ(scene.regions[2].blend_mm, 7.5);
}

TEST(Scene, ATissuesNeedleForcesAreItsOwnAndARegionsWhatItSays) {
  const Scene scene = parse_scene(
      "[tissue]\npuncture_force_n = 9\ncutting_force_n = 2\n"
      "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 9\nfriction_n_per_mm = 0.05\n"
      "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 5\nshear_modulus_kpa = 3\n",
      "scene.toml");
  EXPECT_EQ(scene.tissue.contact.puncture_force_n, 9);
  ASSERT_TRUE(scene.regions[0].contact);
  EXPECT_EQ(scene.regions[0].contact->friction_n_per_mm, 0.05);
  EXPECT_EQ(scene.regions[0].contact->cutting_force_n, 2);   // as around it
  EXPECT_EQ(scene.regions[0].contact->puncture_force_n, 0);  // but it has no capsule
  EXPECT_FALSE(scene.regions[1].contact);
}

TEST(Scene, ANeedleIsGivenByItsGaugeOrItsDiameter) {
  EXPECT_EQ(parse_scene("[needle]\ngauge = 18\n", "s").needle.diameter_mm, 1.27);
  EXPECT_EQ(parse_scene("[needle]\ngauge = 25\n", "s").needle.diameter_mm, 0.51);
  EXPECT_EQ(refusal("[needle]\ngauge = 18\ndiameter_mm = 1\n"),
            "scene.toml:2: 'needle.gauge' is 1.27 mm and needle.diameter_mm another; give one of them");
}

TEST(Scene, ACapsuleThatNeverGivesWayIsRefused) {
  EXPECT_EQ(refusal("[tissue]\ncapsule_n_per_mm = 0\ncapsule_n_per_mm2 = 0\n"),
            "scene.toml:2: 'tissue.capsule_n_per_mm' and capsule_n_per_mm2 are both 0: the capsule would "
            "never reach "
            "its puncture_force_n; raise one of them");
}

TEST(Scene, ARegionThatMakesNoSenseIsRefused) {
  const std::string sphere = "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 9\n";
  EXPECT_EQ(
      refusal(sphere),
      "scene.toml:1: 'region.shear_modulus_kpa' is missing; a [[region]] has that, a support_radius_mm or "
      "forces of its own (cutting_force_n …)");
  EXPECT_EQ(refusal("[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nsupport_radius_mm = 9"),
            "scene.toml:1: 'region.radius_mm' is missing; a sphere has centre_mm and radius_mm");
  EXPECT_EQ(
      refusal(sphere + "semi_axes_mm = [1, 2, 3]\nsupport_radius_mm = 9"),
      "scene.toml:5: 'region.semi_axes_mm' belongs to shape = \"ellipsoid\"; a sphere has centre_mm and "
      "radius_mm");
  EXPECT_NE(refusal("[[region]]\nshape = \"mesh\"\nfile = \"a.stl\"\nsupport_radius_mm = 9\n"
                    "centre_mm = [0, 0, 0]")
                .find("scene.toml:5: 'region.centre_mm' belongs to shape = \"ellipsoid\""),
            std::string::npos);
  EXPECT_EQ(refusal("[[region]]\nsupport_radius_mm = 9"),
            "scene.toml:1: 'region.shape' is missing; a [[region]] is an ellipsoid, a sphere or a mesh");
  EXPECT_EQ(refusal(sphere + "support_radius_mm = 20\nblend_mm = 18.5"),
            "scene.toml:6: 'region.blend_mm' is wider than the region; lower it to at most 18");
  EXPECT_EQ(refusal(sphere + "shear_modulus_kpa = 2\nblend_mm = 3"),
            "scene.toml:6: 'region.blend_mm' belongs to region.support_radius_mm, which this region has not");
  EXPECT_EQ(refusal(sphere + "suport_radius_mm = 2"),
            "scene.toml:5: unknown key 'region.suport_radius_mm'; did you mean 'region.support_radius_mm'?");
  EXPECT_EQ(
      refusal(sphere + "support_radius_mm = 20\n[model]\nkernel = \"auto\""),
      "scene.toml:7: 'model.kernel' is \"auto\", which is charted for one support only; name a model, or "
      "take region.support_radius_mm out of scene.toml:1");
}

std::string model_refusal(const std::string& text, std::string_view model_name) {
  try {
    return has_supports(parse_scene(text, "scene.toml"), model_name) ? "supports" : "none";
  } catch (const UserError& e) {
    return e.what();
  }
}

TEST(Scene, AModelSaysWhatItLacksOfARegion) {
  const std::string soft =
                        "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 9\n"
                        "shear_modulus_kpa = 2\n",
                    wide =
                        "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 9\n"
                        "support_radius_mm = 20\n",
                    both = wide + "shear_modulus_kpa = 4\n";
  for (const char* model_name : {"psi31", "buhmann", "compact_elastic"}) {
    EXPECT_EQ(model_refusal("", model_name), "none");
    EXPECT_EQ(model_refusal(soft, model_name), "none");
    EXPECT_EQ(model_refusal(wide, model_name), "supports");
    EXPECT_EQ(model_refusal(wide + both, model_name), "supports");
    EXPECT_EQ(model_refusal(wide + soft, model_name),
              "scene.toml:6: 'region.support_radius_mm' is missing; " + std::string(model_name) +
                  " needs it of every region where one has it");
  }
  for (const char* model_name : {"elastic", "fem"}) {
    EXPECT_EQ(model_refusal(soft + both, model_name), "none");
    EXPECT_EQ(model_refusal(soft + wide, model_name),
              "scene.toml:6: 'region.shear_modulus_kpa' is missing; " + std::string(model_name) +
                  " needs it of every region");
  }
  EXPECT_EQ(load_body(parse_scene(soft + wide, "scene.toml")).regions.size(), 1u);
}

TEST(Scene, RegionsOfOneSupportAreOneTissue) {
  const auto sphere = [](const std::string& more) {
    return "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 9\n" + more;
  };
  const Scene scene = parse_scene(sphere("support_radius_mm = 20\n") + sphere("support_radius_mm = 12\n") +
                                      sphere("support_radius_mm = 20\nshear_modulus_kpa = 30\n"),
                                  "scene.toml");
  const auto scalar = load_scalar_tissues(scene, Wendland31{}, 12);
  EXPECT_EQ(scalar.membership.tissues(), 2u);
  EXPECT_EQ(scalar.kernels.supports, (std::vector<double>{12, 20}));
  // Forces know moduli.
  const auto compact = load_compact_tissues(scene, load_body(scene));
  ASSERT_EQ(compact.kernels.size(), 4u);
  EXPECT_EQ(compact.kernels.support(0), 48);
  EXPECT_EQ(compact.kernels.support(1), 20);
  EXPECT_EQ(compact.kernels.support(3), 20);
  EXPECT_NEAR(compact.kernels.kernels[1].compliance() / compact.kernels.kernels[3].compliance(), 5, 1e-12);

  std::string many;
  for (int r = 0; r < 16; ++r) many += sphere("support_radius_mm = " + std::to_string(20 + r) + "\n");
  try {
    load_scalar_tissues(parse_scene(many, "scene.toml"), Wendland31{}, 12);
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("scene.toml:76: more than 16 tissues"), std::string::npos)
        << e.what();
  }
}

TEST(Scene, ValuesOutOfRangeAreRefusedWithTheRange) {
  EXPECT_EQ(refusal("[model]\nsupport_radius_mm = -3"),
            "scene.toml:2: 'model.support_radius_mm' is -3; it must be between 0.5 and 500");
  EXPECT_NE(refusal("[rates]\ndeformation_hz = nan").find("must be between 1 and 1000"), std::string::npos);
  EXPECT_NE(refusal("[tissue]\npoints = 99999999999").find("it must be between"), std::string::npos);
}

TEST(Scene, WrongTypesAreRefused) {
  EXPECT_NE(refusal("[model]\nkernel = 31").find("scene.toml:2: 'model.kernel' needs a string"),
            std::string::npos);
  EXPECT_NE(refusal("[tissue]\npoints = 1.5").find("needs a whole number"), std::string::npos);
  EXPECT_NE(refusal("[device]\nloop = 1").find("needs true or false"), std::string::npos);
  EXPECT_NE(refusal("model = 3").find("needs to be a table"), std::string::npos);
  EXPECT_NE(refusal("[model]\nkernel = \"psi99\"").find("one of: " + kernel_names() + ", "),
            std::string::npos);
}

TEST(Scene, ARetiredModelIsRefusedWithItsReplacement) {
  const std::string said = refusal("[model]\nkernel = \"multiscale\"");
  EXPECT_EQ(said.find("scene.toml:2: 'model.kernel' is \"multiscale\", which was removed"), 0u) << said;
  EXPECT_NE(said.find("take compact_elastic, or psi31"), std::string::npos) << said;
}

TEST(Scene, SettingsThatContradictEachOtherAreRefused) {
  EXPECT_NE(refusal("[contact]\nlandmark_spacing_mm = 2").find("set it to at least 101"), std::string::npos);
  EXPECT_NE(refusal("[device]\nkind = \"scripted\"").find("needs device.trajectory"), std::string::npos);
  EXPECT_NE(refusal("[anchors]\nlambda_loaded = 0.6").find("must not exceed"), std::string::npos);
  EXPECT_NE(refusal("[tissue]\npoints = 1000").find("phantom_surface_vertices"), std::string::npos);
}

TEST(Scene, SaysWhoMayConnect) {
  const ServerSettings open_to_all = parse_scene("", "scene.toml").server;
  EXPECT_FALSE(open_to_all.has_tokens());
  EXPECT_FALSE(open_to_all.has_tls());
  for (const char* key : {"token_file", "device_token_file", "viewer_token_file"}) {
    EXPECT_TRUE(parse_scene(std::string("[server]\n") + key + " = \"t\"", "s").server.has_tokens());
    EXPECT_NE(refusal(std::string("[server]\n") + key + " = 3").find("needs a string"), std::string::npos);
  }
  const ServerSettings s =
      parse_scene(
          "[server]\nigtl_without_token = true\ntls_certificate = \"c.pem\"\ntls_key = \"k.pem\"\n"
          "tls_client_ca = \"ca.pem\"\nmax_clients_per_address = 3\nhello_timeout_ms = 100\n"
          "silence_timeout_ms = 1500\nstall_timeout_ms = 700",
          "s")
          .server;
  EXPECT_TRUE(s.igtl_without_token);
  EXPECT_TRUE(s.has_tls());
  EXPECT_EQ(s.tls_key, "k.pem");
  EXPECT_EQ(s.tls_client_ca, "ca.pem");
  EXPECT_EQ(s.max_clients_per_address, 3);
  EXPECT_EQ(s.hello_timeout_ms, 100);
  EXPECT_EQ(s.silence_timeout_ms, 1500);
  EXPECT_EQ(s.stall_timeout_ms, 700);
}

TEST(Scene, AServerThatMakesNoSenseIsRefused) {
  EXPECT_EQ(refusal("[server]\nport = 1\ntls_certificate = \"c.pem\""),
            "scene.toml:3: 'server.tls_certificate' needs server.tls_key = \"FILE.pem\" beside it");
  EXPECT_EQ(refusal("[server]\ntls_key = \"k.pem\""),
            "scene.toml:2: 'server.tls_key' needs server.tls_certificate = \"FILE.pem\" beside it");
  EXPECT_EQ(refusal("[server]\ntls_client_ca = \"ca.pem\""),
            "scene.toml:2: 'server.tls_client_ca' needs TLS: give server.tls_certificate and server.tls_key");
  EXPECT_EQ(refusal("[server]\nmax_clients_per_address = 0"),
            "scene.toml:2: 'server.max_clients_per_address' is 0; it must be between 1 and 1024");
  EXPECT_NE(refusal("[server]\nhello_timeout_ms = 99").find("between 100 and 60000"), std::string::npos);
  EXPECT_NE(refusal("[server]\nsilence_timeout_ms = 1000").find("between 1500 and 600000"),
            std::string::npos);
  EXPECT_NE(refusal("[server]\nstall_timeout_ms = -1").find("between 100 and 600000"), std::string::npos);
  EXPECT_NE(refusal("[server]\nigtl_without_token = 1").find("needs true or false"), std::string::npos);
}

TEST(Scene, TextThatIsNotTomlIsRefusedWithItsLine) {
  EXPECT_EQ(refusal("[model]\nkernel = \"psi31\n").find("scene.toml:2: not valid TOML"), 0u);
  EXPECT_EQ(refusal(std::string("\0\xff\xfe", 3)).find("scene.toml:1: not valid TOML"), 0u);
}

TEST(Scene, AnyTruncationOfTheDefaultFileIsAcceptedOrRefusedInOneLine) {
  std::ifstream in(BRACHY_SOURCE_DIR "/config/prostate.toml");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  ASSERT_GT(text.size(), 1000u);
  // Every end in nightly; in tests those at and around a line's end, and some within.
  const std::size_t stride = test::is_campaign() ? 1 : 20;
  for (std::size_t n = 0; n < text.size(); ++n)
    if (n % stride == 0 || text[n] == '\n' || (n > 0 && text[n - 1] == '\n')) refusal(text.substr(0, n));
}

TEST(Scene, AMissingFileIsRefusedByName) {
  EXPECT_THROW(load_scene("/nonexistent/scene.toml"), UserError);
  EXPECT_THROW(load_scene("/tmp"), UserError);
}

TEST(Scene, MeshFilesAreFoundBesideTheScene) {
  Scene scene;
  scene.directory = "/nonexistent";
  scene.tissue.mesh = "gland.stl";
  try {
    load_tissue(scene);
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("/nonexistent/gland.stl"), std::string::npos);
  }
}

}  // namespace
}  // namespace brachy
