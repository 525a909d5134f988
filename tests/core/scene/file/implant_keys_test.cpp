#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/scene/file/scene_file.h"

namespace brachy {
namespace {

std::string refusal_of_keys(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const UserError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(ImplantKeys, AreReadAsTheFileSaysThem) {
  const Scene scene = parse_scene(
      "[template]\ncolumns = 11\nrows = 9\nspacing_mm = 4\norigin_mm = [1, 2, -70]\n"
      "[seeds]\napplicator = \"train\"\nsource = \"200\"\nair_kerma_strength_u = 1.8\nmax_count = 4096\n"
      "[plan]\nfile = \"plan.toml\"\n"
      "[dose]\nprescription_gy = 125\nspacing_mm = 2\nmargin_mm = 5\n"
      "[[structure]]\nname = \"urethra\"\nfile = \"u.stl\"\n[[structure]]\nname = \"bulb_2\"\nfile = "
      "\"b.ply\"\n",
      "scene.toml");
  EXPECT_EQ(scene.template_grid, (TemplateGrid{11, 9, 4, {1, 2, -70}}));
  EXPECT_EQ(scene.seeds, (SeedSettings{"train", SourceModel::kTheraSeed200, 1.8, 4096}));
  EXPECT_EQ(scene.plan_file, "plan.toml");
  EXPECT_EQ(scene.dose, (DoseSettings{125, 2, 5, {}}));
  ASSERT_EQ(scene.structures.size(), 2u);
  EXPECT_EQ(scene.structures[0], (StructureSettings{"urethra", "u.stl", "scene.toml:17"}));
  EXPECT_EQ(scene.structures[1].name, "bulb_2");
}

TEST(ImplantKeys, AFractionHasADoseAndASourceOfItsOwn) {
  const Scene hdr = parse_scene("[implant]\nkind = \"hdr\"\nactivity_ci = 8\n", "scene.toml");
  EXPECT_TRUE(hdr.implant.is_hdr());
  EXPECT_EQ(hdr.implant.source_strength_u, 8 * 4030);
  EXPECT_EQ(hdr.dose.prescription_gy, 13.5);
  EXPECT_EQ(parse_scene("[implant]\nkind = \"hdr\"\n[dose]\nprescription_gy = 19\n", "scene.toml")
                .dose.prescription_gy,
            19);
  EXPECT_EQ(parse_scene("", "scene.toml").dose.prescription_gy, 145);
  // ABS 2012, of the source alone; what a scene says is never replaced.
  const auto prescribed = [](const std::string& text) {
    return parse_scene(text, "scene.toml").dose.prescription_gy;
  };
  EXPECT_EQ(prescribed("[seeds]\nsource = \"200\"\n"), 125);
  EXPECT_EQ(prescribed("[seeds]\nsource = \"cs1-rev2\"\n"), 115);
  EXPECT_EQ(prescribed("[dose]\nsource = \"200\"\n"), 125);
  EXPECT_EQ(prescribed("[seeds]\nsource = \"200\"\n[dose]\nprescription_gy = 145\n"), 145);
}

TEST(ImplantKeys, AStructureAndTheTissueHaveAColourOrNone) {
  const std::string structure = "[[structure]]\nname = \"node\"\nfile = \"node.ply\"\n";
  const Scene scene =
      parse_scene("[tissue]\ncolour = \"#33cc66\"\n" + structure + "colour = \"#FF00ff\"\n", "scene.toml");
  EXPECT_EQ(scene.tissue.colour, "#33cc66");
  EXPECT_EQ(scene.structures[0].colour, "#FF00ff");
  EXPECT_EQ(parse_scene(structure, "scene.toml").structures[0].colour, "");
  EXPECT_EQ(refusal_of_keys(structure + "colour = \"red\""),
            "scene.toml:4: 'structure.colour' is \"red\"; write it as #rrggbb, such as \"#f2c94c\"");
}

TEST(ImplantKeys, TheDefaultTemplateHasAHoleOnThePhantomsAxis) {
  const TemplateGrid grid = parse_scene("", "nothing").template_grid;
  EXPECT_EQ(grid.position("G7"), Vec3(0, 0, -60));
}

TEST(ImplantKeys, WhatMakesNoSenseIsRefusedWithItsLineAndTheFix) {
  EXPECT_EQ(refusal_of_keys("[seeds]\nmax_count = 5000"),
            "scene.toml:2: 'seeds.max_count' is 5000; it must be between 1 and 4096");
  EXPECT_EQ(refusal_of_keys("\n[seeds]\napplicator = \"train\""),
            "scene.toml:3: 'seeds.applicator' is \"train\", and trains are a plan's; give plan.file = "
            "\"PLAN.toml\" or make it \"single\"");
  EXPECT_EQ(refusal_of_keys("[seeds]\nloading = \"tray\""),
            "scene.toml:2: 'seeds.loading' is \"tray\"; it must be one of: hole, order");
  EXPECT_EQ(refusal_of_keys("[seeds]\nsource = \"6702\""),
            "scene.toml:2: 'seeds.source' is \"6702\"; it must be one of: 6711, 200, cs1-rev2");
  EXPECT_EQ(refusal_of_keys("[implant]\nstep_mm = 3"),
            "scene.toml:2: 'implant.step_mm' is 3; it must be 2.5 or 5");
  EXPECT_EQ(refusal_of_keys("[implant]\nactivity_ci = 8\nsource_strength_u = 40000"),
            "scene.toml:2: 'implant.activity_ci' and implant.source_strength_u both give the strength; give "
            "one of them");
  EXPECT_EQ(refusal_of_keys("[seeds]\nair_kerma_strength_u = 0"),
            "scene.toml:2: 'seeds.air_kerma_strength_u' is 0; it must be between 0.001 and 100");
  EXPECT_EQ(refusal_of_keys("[template]\ncolumns = 27"),
            "scene.toml:2: 'template.columns' is 27; it must be between 1 and 26");
  EXPECT_EQ(refusal_of_keys("[dose]\nspacing = 1"),
            "scene.toml:2: unknown key 'dose.spacing'; did you mean 'dose.spacing_mm'?");
  EXPECT_EQ(refusal_of_keys("[plan]\nfile = 3"), "scene.toml:2: 'plan.file' needs a string in quotes");
}

TEST(ImplantKeys, AStructureHasANameOfItsOwnAndAFile) {
  const std::string urethra = "[[structure]]\nname = \"urethra\"\nfile = \"u.stl\"\n";
  EXPECT_EQ(refusal_of_keys("[[structure]]\nfile = \"u.stl\""),
            "scene.toml:1: 'structure.name' is missing; a [[structure]] has a name and the file of its "
            "closed surface");
  EXPECT_EQ(refusal_of_keys("[[structure]]\nname = \"u\""),
            "scene.toml:1: 'structure.file' is missing; a [[structure]] has a name and the file of its "
            "closed surface");
  EXPECT_EQ(refusal_of_keys(urethra + urethra),
            "scene.toml:5: 'structure.name' is \"urethra\" as that at scene.toml:1; rename one of them");
  EXPECT_EQ(refusal_of_keys("[[structure]]\nname = \"prostate\"\nfile = \"p.stl\""), "accepted");
  EXPECT_EQ(refusal_of_keys("[[structure]]\nname = \"../u\"\nfile = \"u.stl\""),
            "scene.toml:2: 'structure.name' is \"../u\"; name it with 1 to 32 letters, digits, _ and -");
}

}  // namespace
}  // namespace brachy
