#include "core/brachytherapy/structures/structure_role.h"

#include <gtest/gtest.h>

#include "core/brachytherapy/structures/anatomy.h"
#include "core/brachytherapy/structures/name_words.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using enum StructureRole;
using Fit = NamedRole::Fit;

std::vector<std::string> words(const char* name) {
  return name_words(name);
}

TEST(NameWords, EndAtSignsDigitsAndCapitals) {
  using Words = std::vector<std::string>;
  EXPECT_EQ(words("Urethra_Prostatc"), (Words{"urethra", "prostatc"}));
  EXPECT_EQ(words("PTVProstate+5mm"), (Words{"ptv", "prostate", "5", "mm"}));
  EXPECT_EQ(words("Harnröhre"), (Words{"harnrohre"}));
  EXPECT_EQ(words("HARNROEHRE"), (Words{"harnrohre"}));
  EXPECT_EQ(words("Harnro\xCC\x88hre"), (Words{"harnrohre"}));  // decomposed
  EXPECT_EQ(words("Harnr\xF6hre"), (Words{"harnrohre"}));       // Latin-1
  EXPECT_EQ(words("gruczoł – krokowy"), (Words{"gruczol", "krokowy"}));
  EXPECT_EQ(words(""), Words());
  EXPECT_EQ(words("__ (%)"), Words());
  EXPECT_EQ(without_accents("Harnröhre Blåsa pęcherz"), "Harnroehre Blaasa pecherz");
}

TEST(StructureRole, IsThatOfTheNameInEveryLanguageAndSpelling) {
  const struct {
    StructureRole role;
    std::uint8_t fit;
    std::vector<const char*> names;
  } all[] = {
      {kGland,
       Fit::kExact,
       {"Prostate", "PROSTATE", "prostata", "Próstata", "Prostaat", "Vorsteherdrüse", "prostate gland",
        "gruczoł krokowy", "Stercz", "eturauhanen", "ПРОСТАТА", "前列腺"}},
      {kGland,
       Fit::kContained,
       {"Prostate2", "prostate_MR", "Prostata klein", "Prostatakapsel", "whole_gland"}},
      {kGland, Fit::kPart, {"Prostate_L", "Prostate+SV", "prostate apex", "Prostate_PZ"}},
      {kUrethra,
       Fit::kExact,
       {"Urethra_Prostatc", "Urethra", "Harnröhre", "HARNROEHRE", "Urètre", "URETRA", "Plasbuis", "cewka",
        "Urinrör", "Močová trubice", "prostatic urethra"}},
      {kUrethra, Fit::kContained, {"Urethra_1", "Prostate_Urethra", "Urethra_Foley"}},
      {kRectum,
       Fit::kExact,
       {"Rectum", "Rektum", "Enddarm", "RETTO", "recto", "Odbytnica", "Ändtarm", "Konečník"}},
      {kRectum, Fit::kContained, {"Rectum_Wall", "RectumWall", "Rektumwand", "rectum 2"}},
      {kRectum, Fit::kPart, {"Rectum_Ant", "Rectum ant wall"}},
      {kBladder,
       Fit::kExact,
       {"Bladder", "Harnblase", "Blase", "Vessie", "vescica", "Vejiga", "pęcherz", "Urinblåsa",
        "Močový měchýř", "urinary_bladder"}},
      {kBladder, Fit::kContained, {"Bladder_Wall", "Blasenwand"}},
      {kBladder, Fit::kPart, {"Bladder_Neck", "BladderTrigone"}},
      {kSeminalVesicles, Fit::kExact, {"SeminalVes", "SV", "Samenblasen", "vésicules séminales"}},
      {kSeminalVesicles, Fit::kContained, {"SeminalVes_L"}},
      {kPenileBulb, Fit::kExact, {"PenileBulb", "Bulbus penis"}},
      {kFemoralHead, Fit::kContained, {"Femur_Head_L", "Hüftkopf links", "tête fémorale gauche"}},
      {kBowel, Fit::kExact, {"Bowel", "Bowel_Small", "Colon_Sigmoid", "Dünndarm"}},
      {kBody, Fit::kExact, {"BODY", "External", "Außenkontur"}},
      {kPubicArch, Fit::kExact, {"pubic_arch", "PubicArch", "Symphyse"}},
      {kTarget, 0, {"CTV_Prostate"}},
      {kTarget, 1, {"CTV", "HR-CTV", "CTV1"}},
      {kTarget, 4, {"PTV_Prostate", "PTVProstate"}},
      {kTarget, 5, {"PTV", "ptvprostate"}},
      {kOther,
       0,
       {"",
        "label_1",
        "Segment_1",
        "Gallbladder",
        "Gallenblase",
        "mesorectum",
        "Rectosigmoid",
        "L5",
        "Ring prostate-PTV",
        "Prostate+5mm",
        "prostate_expansion",
        "Prostatabett",
        "Prostate bed",
        "zRectum",
        "z_Rectum",
        "Rectum_PRV",
        "Urethra_PRV05",
        "Rectum-PTV",
        "Prostate-Urethra",
        "100% isodose",
        "Dose 145[Gy]",
        "SpaceOAR",
        "Avoid_Bladder",
        "Rectum minus PTV",
        "Margin prostate"}},
  };
  for (const auto& [role, fit, names] : all)
    for (const char* name : names) {
      const NamedRole found = role_of_name(name);
      EXPECT_STREQ(role_word(found.role), role_word(role)) << name;
      EXPECT_EQ(int{found.fit}, int{fit}) << name;
    }
}

TEST(StructureRole, BestNamedPrefersExactNamesAndTargetsOnlyWithoutAGland) {
  using Which = std::vector<std::size_t>;
  EXPECT_EQ(best_named({"PTV_Prostate", "Ring prostate-PTV", "Prostate_MR", "Prostate"}, kGland), Which{3});
  EXPECT_EQ(best_named({"PTV_Prostate", "Prostate_MR", "BODY"}, kGland), Which{1});
  EXPECT_EQ(best_named({"Prostate", "Prostata"}, kGland), (Which{0, 1}));
  EXPECT_EQ(best_named({"PTV", "CTV", "Bladder"}, kGland), Which{1});
  EXPECT_EQ(best_named({"BODY", "Bladder"}, kGland), Which());
  EXPECT_EQ(best_named({"Rectum_Wall", "Rectum"}, kRectum), Which{1});
  EXPECT_EQ(best_named({"Rectum_Wall", "PTV"}, kRectum), Which{0});
}

TEST(StructureRole, SidesAreThoseOfNames) {
  for (const char* left : {"Femur_Head_L", "Hüftkopf links", "hip_left", "tête fémorale gauche",
                           "L femoral head", "FemurHead_L", "Cabeza femoral izq", "testa femorale sn"})
    EXPECT_EQ(side_of_name(left), BodySide::kLeft) << left;
  for (const char* right :
       {"Femur_Head_R", "Hüftkopf re", "testa femorale dx", "cabeza femoral der", "Femur rt"})
    EXPECT_EQ(side_of_name(right), BodySide::kRight) << right;
  for (const char* none : {"Rectum", "L5", "Rand der Prostata", "left and right", "Rectal"})
    EXPECT_EQ(side_of_name(none), BodySide::kNone) << none;
}

TEST(StructureRole, WordsAndRolesAreOneToOne) {
  for (const std::string& word : role_words()) {
    ASSERT_TRUE(role_of_word(word)) << word;
    EXPECT_EQ(role_word(*role_of_word(word)), word);
  }
  EXPECT_FALSE(role_of_word("gall"));
}

/// A gland with all that is checked, in a supine patient.
std::vector<Structure> pelvis() {
  const auto box = [](const Vec3& lo, const Vec3& hi) { return test::make_box(lo, hi); };
  return {{"prostate", prostate_phantom(), kGland},
          {"urethra", phantom_urethra(), kUrethra},
          {"rectum", phantom_rectum(), kRectum},
          {"bladder", box({-30, -20, 25}, {30, 30, 70}), kBladder},
          {"SeminalVes", box({-20, -25, 20}, {20, -10, 30}), kSeminalVesicles},
          {"PenileBulb", box({-8, -20, -45}, {8, -8, -30}), kPenileBulb},
          {"pubic_arch", box({-20, 35, -20}, {20, 45, 10}), kPubicArch},
          {"Femur_Head_L", box({-110, 0, 0}, {-70, 40, 40}), kFemoralHead},
          {"Femur_Head_R", box({70, 0, 0}, {110, 40, 40}), kFemoralHead}};
}

void transform(std::vector<Structure>& all, const Vec3& scale) {
  for (Structure& s : all) {
    for (Vec3& v : s.mesh.vertices) v = v.cwiseProduct(scale);
    if (scale.prod() < 0) test::turn_inside_out(s.mesh);
  }
}

/// Of which structures there is a warning with that word.
std::string warned(const std::vector<Structure>& all, const std::string& word,
                   const VoxelGrid* image = nullptr) {
  std::string names;
  for (const std::string& warning : anatomy_warnings(all, image))
    if (warning.find(word) != std::string::npos)
      names += (names.empty() ? "" : " ") + warning.substr(1, warning.find('"', 1) - 1);
  return names;
}

TEST(Anatomy, OfARightPelvisHasNoWarning) {
  EXPECT_EQ(anatomy_warnings(pelvis()), std::vector<std::string>());
}

TEST(Anatomy, ADirectionThatIsWrongIsSaid) {
  std::vector<Structure> turned = pelvis();
  transform(turned, {-1, -1, 1});  // LPS taken for RAS
  EXPECT_EQ(warned(turned, "posterior"), "rectum pubic_arch");
  EXPECT_EQ(warned(turned, "its name says"), "Femur_Head_L Femur_Head_R");
  std::vector<Structure> over = pelvis();
  transform(over, {1, 1, -1});
  EXPECT_EQ(warned(over, "inferior"), "bladder SeminalVes PenileBulb");
  std::vector<Structure> mirrored = pelvis();
  transform(mirrored, {-1, 1, 1});
  EXPECT_EQ(anatomy_warnings(mirrored).size(), 2u);
}

TEST(Anatomy, AnImplantOutsideTheGlandIsSaidAndSingleSeedsAreNot) {
  const auto line_of_seeds = [](const Vec3& middle) {
    std::vector<Vec3> seeds(10);
    for (std::size_t i = 0; i < seeds.size(); ++i)
      seeds[i] = middle + Vec3(0, 0, 2.0 * static_cast<double>(i) - 9);
    return seeds;
  };
  std::vector<Vec3> seeds = line_of_seeds(structure_places(pelvis()).front().centroid);
  EXPECT_EQ(implant_warning(pelvis(), {}), "");
  EXPECT_EQ(implant_warning(pelvis(), seeds), "");
  for (std::size_t i = 0; i < 5; ++i) seeds[i].x() += 100;  // migrated
  EXPECT_EQ(implant_warning(pelvis(), seeds), "");
  seeds[5].x() += 100;
  EXPECT_TRUE(implant_warning(pelvis(), seeds).starts_with("6 of 10 seeds lie"))
      << implant_warning(pelvis(), seeds);
}

TEST(Anatomy, VolumesOutsideThoseOfPeopleAreSaid) {
  std::vector<Structure> small = pelvis(), large = pelvis();
  transform(small, Vec3::Constant(0.1));  // centimetres
  transform(large, Vec3::Constant(10));
  EXPECT_EQ(warned(small, "check its units"),
            "prostate urethra rectum bladder SeminalVes PenileBulb Femur_Head_L Femur_Head_R");
  EXPECT_EQ(warned(large, "check its units"),
            "prostate urethra rectum bladder SeminalVes PenileBulb Femur_Head_L Femur_Head_R");
}

TEST(Anatomy, AUrethraBesideTheGlandAndAStructureOutsideTheImageAreSaid) {
  std::vector<Structure> all = pelvis();
  for (Vec3& v : all[1].mesh.vertices) v.x() += 30;
  EXPECT_EQ(warned(all, "outside the prostate"), "urethra");
  for (Vec3& v : all[1].mesh.vertices) v.z() += 200;
  EXPECT_EQ(warned(all, "does not pass through"), "urethra");
  VoxelGrid image;
  image.size = {120, 120, 120};
  image.origin = Vec3::Constant(-120);
  image.steps = 2 * Mat3::Identity();  // −120 … 118 mm
  EXPECT_EQ(warned(pelvis(), "image", &image), "");
  image.origin = {-120, -120, -160};  // up to z = 78
  EXPECT_EQ(warned(pelvis(), "image", &image), "");
  image.origin.z() = -180;
  EXPECT_EQ(warned(pelvis(), "reaches out of the image", &image), "bladder");
  image.origin.z() = 500;
  EXPECT_EQ(anatomy_warnings(pelvis(), &image).size(), 9u);
}

TEST(Anatomy, AGlandThatIsFlatOrLongIsNoneThoughItsVolumeIsOnes) {
  for (const Vec3& scale : {Vec3(4, 4, 1.0 / 16), Vec3(0.5, 0.5, 4)}) {
    std::vector<Structure> all = pelvis();
    all.resize(1);
    transform(all, scale);
    EXPECT_EQ(warned(all, ", and a prostate 10 mm to 120 mm"), "prostate") << scale.transpose();
  }
}

TEST(Anatomy, PlacesAreThoseOfTheShapes) {
  const auto places = structure_places(pelvis());
  EXPECT_NEAR(places[3].volume_cc, 60 * 50 * 45 / 1000.0, 1e-9);
  EXPECT_LT((places[3].centroid - Vec3(0, 5, 47.5)).norm(), 1e-9);
  EXPECT_EQ(places[0].side, "");
  EXPECT_EQ(places[7].side.substr(0, 24), "left of the prostate by ");
  EXPECT_EQ(places[2].side.substr(0, 29), "posterior of the prostate by ");
  EXPECT_EQ(places[3].side.substr(0, 28), "superior of the prostate by ");
}

}  // namespace
}  // namespace brachy
