// `brachy import` and `brachy export --dicom`, the programs from outside, against pydicom, numpy and dciodvfy.
#include <gtest/gtest.h>
#include <unistd.h>

#include "apps/import/case/case_plan.h"
#include "apps/import/case/volume_nrrd.h"
#include "core/base/error.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/geometry/label_map/label_nrrd.h"
#include "core/geometry/label_map/rasterise.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "tests/apps/import/import_testing.h"
#include "tests/core/geometry/simplify/surface_distance.h"
#include "tests/data_dir.h"

namespace brachy::test {
namespace {

const std::string kSession = (kConfigFolder / "session.toml").string();

/// The session's scene as DICOM: made once for all tests.
class Import : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_folder = new TempFolder;
    made_export = run_brachy({"export", "--dicom", (*made_folder / "dicom").string(), "--config", kSession});
  }
  static void TearDownTestSuite() {
    delete made_folder;
    made_folder = nullptr;
  }
  void SetUp() override {
    ASSERT_TRUE(exited(made_export, 0)) << made_export.err;
    if (!has_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed";
  }

  static TempFolder* made_folder;
  static Ended made_export;
};
TempFolder* Import::made_folder = nullptr;
Ended Import::made_export;

/// With an exact export and its variants, and what is expected of them.
class ImportForms : public Import {
 protected:
  static void SetUpTestSuite() {
    Import::SetUpTestSuite();
    const std::string exact = (*made_folder / "dicom32").string();
    ASSERT_TRUE(exited(run_brachy({"export", "--dicom", exact, "--config", kSession, "--dose-bits", "32",
                                   "--slice-mm", "0.5"}),
                       0));
    if (!has_pydicom()) return;
    const Ended made = run_python({source_file("make_variants.py"), exact, (*made_folder / "v").string()});
    ASSERT_TRUE(exited(made, 0)) << made.err;
  }
};

/// Imports of the same files, one after the other: a suite of its own runs beside the others.
class ImportRepeats : public Import {};

TEST_F(Import, GivesBackSurfacesNeedlesSeedsAndStrengthOfTheSceneItWasExportedFrom) {
  const TempFolder out;
  const Ended ended =
      run_brachy({"import", (*made_folder / "dicom/rtstruct.dcm").string(),
                  (*made_folder / "dicom/rtplan.dcm").string(), (*made_folder / "dicom/rtdose.dcm").string(),
                  (*made_folder / "dicom/dose.nrrd").string(), "--out", (out / "s").string()});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const Scene before = load_scene(kSession), after = load_scene(out / "s/scene.toml");
  const auto was = load_structures(before), is = load_structures(after);
  ASSERT_EQ(was.size(), is.size());
  for (std::size_t n = 0; n < was.size(); ++n) {
    EXPECT_EQ(was[n].name, is[n].name);
    EXPECT_LT(surface_distance(was[n].mesh, is[n].mesh).p95_mm, 0.1) << was[n].name;
    EXPECT_NEAR(enclosed_mm3(is[n].mesh) / enclosed_mm3(was[n].mesh), 1, 0.01) << was[n].name;
  }
  const Plan plan = load_plan(before.resolve(before.plan_file), before.template_grid);
  Plan back = load_plan(out / "s/plan.toml", after.template_grid);
  EXPECT_EQ(after.template_grid, before.template_grid);
  back.name = plan.name;  // dropped: it could be a person's
  EXPECT_EQ(back, plan);
  const auto seeds = plan.seeds(before.template_grid), seeds_back = back.seeds(after.template_grid);
  for (std::size_t n = 0; n < seeds.size(); ++n) EXPECT_EQ(seeds[n].position, seeds_back[n].position);
}

TEST_F(Import, GivesBackTheDoseToATenthOfAPercent) {
  const TempFolder out;
  for (const char* bits : {"16", "32"}) {
    const std::string dicom = (out / bits).string(), scene = (out / (std::string("s") + bits)).string();
    ASSERT_TRUE(
        exited(run_brachy({"export", "--dicom", dicom, "--config", kSession, "--dose-bits", bits}), 0));
    ASSERT_TRUE(
        exited(run_brachy({"import", dicom + "/rtstruct.dcm", dicom + "/rtdose.dcm", "--out", scene}), 0));
    const std::string compare =
        "import numpy as np,sys\n"
        "def f(p):\n"
        "  b=open(p,'rb').read(); i=b.index(b'\\n\\n'); h=b[:i].decode(); n=[int(v) for v in h.split('sizes: "
        "')[1].split('\\n')[0].split()]\n"
        "  return np.frombuffer(b[i+2:],'<f4').reshape(n[::-1])\n"
        "a=f(sys.argv[1]); b=f(sys.argv[2])[:,::-1,::-1]\n"  // LPS rows and columns run against RAS
        "print(abs(a-b).max()/145*100, (abs(a-b)/a).max()*100)\n";
    const Ended compared = run_python({"-c", compare, dicom + "/dose.nrrd", scene + "/dose.nrrd"});
    ASSERT_TRUE(exited(compared, 0)) << compared.err;
    double of_prescription = 1, of_dose = 1;
    std::istringstream(compared.out) >> of_prescription >> of_dose;
    EXPECT_LT(of_prescription, 0.1) << bits;
    if (std::string(bits) == "32") {
      EXPECT_LT(of_dose, 0.001);
    }
  }
}

TEST_F(Import, ExportsWhatAnIndependentReaderAgreesWith) {
  const Ended checked =
      run_python({source_file("check_export.py"), (*made_folder / "dicom").string(), "145"});
  ASSERT_TRUE(exited(checked, 0)) << checked.err;
  const nlohmann::json theirs = json_of(checked);
  const TempFolder out;
  const Scene scene = load_scene(kSession);
  const Plan plan = load_plan(scene.resolve(scene.plan_file), scene.template_grid);
  std::string seeds = "x,y,z,ax,ay,az,source,strength_u\n";
  for (const PlannedSeed& s : plan.seeds(scene.template_grid)) {
    std::ostringstream row;
    row.precision(17);
    row << s.position.x() << "," << s.position.y() << "," << s.position.z() << ",0,0,1,6711,"
        << s.air_kerma_strength_u << "\n";
    seeds += row.str();
  }
  const Ended dose =
      run_brachy({"dose", "--seeds", out.write("s.csv", seeds), "--config", kSession, "--json"});
  ASSERT_TRUE(exited(dose, 0)) << dose.err;
  for (const auto& ours : json_of(dose)["structures"]) {
    const std::string name = ours["name"];
    const nlohmann::json& other = theirs["structures"][name];
    if (name != "rectum") {
      EXPECT_NEAR(other["volume_cc"].get<double>() / ours["volume_cc"].get<double>(), 1, 0.01) << name;
    }
    if (name == "prostate") {
      EXPECT_NEAR(other["d90_gy"].get<double>() / ours["d90_gy"].get<double>(), 1, 0.001);
      EXPECT_NEAR(other["v100_percent"].get<double>() / ours["v100_percent"].get<double>(), 1, 0.001);
    }
    if (name == "urethra") {
      EXPECT_NEAR(other["d30_gy"].get<double>() / ours["d30_gy"].get<double>(), 1, 0.001);
    }
  }
  EXPECT_EQ(theirs["needles"], plan.needles.size());
  EXPECT_EQ(theirs["seeds"], plan.seed_count());
  EXPECT_EQ(theirs["strength_u"], plan.air_kerma_strength_u);
  const auto planned = plan.seeds(scene.template_grid);
  for (std::size_t n = 0; n < planned.size(); ++n)
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(theirs["positions_lps"][n][static_cast<std::size_t>(k)].get<double>(),
                (k < 2 ? -1 : 1) * planned[n].position[k]);
}

TEST_F(Import, ExportsObjectsInWhichDciodvfyFindsNoError) {
  if (access("/usr/bin/dciodvfy", X_OK) != 0) GTEST_SKIP() << "dicom3tools is not installed";
  for (const char* name : {"rtstruct.dcm", "rtplan.dcm", "rtdose.dcm"}) {
    const Ended checked = run_process({"/usr/bin/dciodvfy", (*made_folder / "dicom" / name).string()});
    EXPECT_EQ(checked.signal, 0) << name;
    EXPECT_EQ(checked.err.find("Error"), std::string::npos) << name << ": " << checked.err;
  }
}

// Channels, dwell positions and times of a fraction, and its dose, by an independent reader.
TEST_F(Import, ExportsCathetersWithTheirDwellsAsAnIndependentReaderFindsThem) {
  const TempFolder out;
  const std::string scene = (kConfigFolder / "hdr.toml").string(), dicom = (out / "d").string();
  const Ended ended = run_brachy({"export", "--dicom", dicom, "--config", scene, "--slice-mm", "5"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const Ended read = run_python(
      {"-c",
       "import pydicom,json,sys\n"
       "d=pydicom.dcmread(sys.argv[1]); r=[]\n"
       "for c in d.ApplicationSetupSequence[0].ChannelSequence:\n"
       "  p=c.BrachyControlPointSequence; u=float(c.ChannelTotalTime)/float(c.FinalCumulativeTimeWeight)\n"
       "  for a,b in zip(p[::2],p[1::2]):\n"
       "    r.append([*map(float,a.ControlPoint3DPosition),u*(float(b.CumulativeTimeWeight)-"
       "float(a.CumulativeTimeWeight))])\n"
       "print(json.dumps({'dwells':r,'type':d.BrachyTreatmentType,"
       "'strength':float(d.SourceSequence[0].ReferenceAirKermaRate)}))\n",
       dicom + "/rtplan.dcm"});
  ASSERT_TRUE(exited(read, 0)) << read.err;
  const nlohmann::json theirs = json_of(read);
  const Scene loaded = load_scene(scene);
  const HdrPlan plan =
      load_hdr_plan(loaded.resolve(loaded.plan_file), loaded.template_grid, loaded.needle.length_mm);
  EXPECT_EQ(theirs["type"], "HDR");
  EXPECT_EQ(theirs["strength"], plan.source_strength_u);
  ASSERT_EQ(theirs["dwells"].size(), plan.dwell_count());
  std::size_t n = 0;
  for (const Dwell& dwell : plan.dwells(loaded.template_grid)) {
    if (dwell.seconds <= 0) continue;
    const std::vector<double> theirs_n = theirs["dwells"][n++];
    EXPECT_NEAR(theirs_n[0], -dwell.position.x(), 1e-9);
    EXPECT_NEAR(theirs_n[1], -dwell.position.y(), 1e-9);
    EXPECT_NEAR(theirs_n[2], dwell.position.z(), 1e-9);
    EXPECT_NEAR(theirs_n[3], dwell.seconds, 1e-6);
  }
  EXPECT_TRUE(std::filesystem::exists(out / "d/rtdose.dcm"));
  if (access("/usr/bin/dciodvfy", X_OK) != 0) return;
  const Ended checked = run_process({"/usr/bin/dciodvfy", dicom + "/rtplan.dcm"});
  EXPECT_EQ(checked.err.find("Error"), std::string::npos) << checked.err;
}

TEST_F(ImportForms, ReadsEveryFormAndRefusesEveryMalformedOneInALineThatNamesFileAndTag) {
  const nlohmann::json variants = json_file(*made_folder / "v/variants.json");
  EXPECT_GE(variants.size(), 30u);
  const SurfaceMesh plain = load_structures(load_scene(kSession)).front().mesh;
  for (const auto& [name, expected] : variants.items()) {
    const TempFolder out;
    const Ended ended =
        run_brachy({"import", (*made_folder / "v" / name).string(), "--out", (out / "s").string()});
    EXPECT_EQ(ended.signal, 0) << name;
    if (!expected.contains("good")) {
      const std::vector<std::string> words = expected["refused"];
      EXPECT_TRUE(refused_in_last_line(ended, words)) << name << ": " << ended.err;
      EXPECT_FALSE(std::filesystem::exists(out / "s/scene.toml")) << name;
      continue;
    }
    EXPECT_TRUE(exited(ended, 0)) << name << ": " << ended.err;
    if (ended.exit_code != 0) continue;
    EXPECT_TRUE(exited(run_brachyd({"--check-config", (out / "s/scene.toml").string()}), 0)) << name;
    const SurfaceMesh gland = surface_file(out / "s/prostate.ply");
    EXPECT_TRUE(is_closed_manifold(gland)) << name;
    if (expected.contains("box")) {
      // 40 × 30 × 36 mm about RAS (10, −20, 30).
      EXPECT_NEAR(enclosed_mm3(gland) / 43200, 1, 0.02) << name;
      const SurfaceBvh bvh(gland);
      EXPECT_LT((0.5 * (bvh.min() + bvh.max()) - Vec3(10, -20, 30)).norm(), 0.5) << name;
    } else if (expected.contains("turned")) {
      EXPECT_NEAR(enclosed_mm3(gland) / enclosed_mm3(plain), 1, 0.01) << name;
    } else {
      EXPECT_LT(surface_distance(plain, gland).p95_mm, name == "missing_slices" ? 0.15 : 0.1) << name;
    }
  }
}

TEST_F(ImportRepeats, WritesTheSameBytesAgainAndNothingThatIdentifiesThePatient) {
  const TempFolder out;
  const Ended named = run_python(
      {"-c",
       "import pydicom,sys\nfor n in ('rtstruct','rtplan','rtdose'):\n"
       "  d=pydicom.dcmread(f'{sys.argv[1]}/{n}.dcm'); d.PatientName='Doe^Jane'; "
       "d.PatientID='PID-4711-0815'\n"
       "  d.PatientBirthDate='19510203'; d.InstitutionName='Saint Elsewhere'; d.OperatorsName='Roe^Rick'\n"
       "  d.StudyDescription='Doe seed implant'; d.save_as(f'{sys.argv[2]}/{n}.dcm')\n",
       (*made_folder / "dicom").string(), [&] {
         std::filesystem::create_directories(out / "in");
         return (out / "in").string();
       }()});
  ASSERT_TRUE(exited(named, 0)) << named.err;
  const auto import_to = [&](const char* to, std::vector<std::string> more = {}) {
    std::vector<std::string> line = {"import", (out / "in").string(), "--out", (out / to).string()};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  const Ended first = import_to("a"), second = import_to("b"), kept = import_to("c", {"--keep-identifiers"});
  ASSERT_TRUE(exited(first, 0)) << first.err;
  ASSERT_TRUE(exited(second, 0)) << second.err;
  EXPECT_NE(first.err.find("dropped: PatientName (0010,0010)"), std::string::npos) << first.err;
  EXPECT_EQ((first.out + first.err).find("Doe"), std::string::npos);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(out / "a")) {
    const std::string bytes = read_file(entry.path());
    EXPECT_EQ(bytes, read_file(out / "b" / entry.path().filename())) << entry.path();
    for (const char* secret : {"Doe", "4711-0815", "19510203", "Elsewhere", "Roe", "2.25."})
      EXPECT_EQ(bytes.find(secret), std::string::npos) << entry.path() << ": " << secret;
    ++files;
  }
  EXPECT_GE(files, 7u);
  EXPECT_NE(read_file(out / "c/import.json").find("Doe^Jane"), std::string::npos);
  EXPECT_TRUE(refused_in_last_line(import_to("a"), {"is not empty", "--force"}));
  EXPECT_TRUE(exited(import_to("a", {"--force"}), 0));
}

TEST_F(Import, ShowsAnUltrasoundSeriesAsTheScenesUltrasoundWithoutAnEdit) {
  const TempFolder out;
  const Ended made = run_python(
      {source_file("make_image_series.py"), (*made_folder / "dicom").string(), (out / "us").string(), "US"});
  ASSERT_TRUE(exited(made, 0)) << made.err;
  ASSERT_TRUE(exited(run_brachy({"import", (out / "us").string(), "--out", (out / "s").string()}), 0));
  const Scene scene = load_scene(out / "s/scene.toml");
  EXPECT_TRUE(scene.ultrasound.on);
  EXPECT_EQ(scene.ultrasound.volume, "volume.nrrd");
  EXPECT_NEAR(scene.ultrasound.volume_db_per_value, 60.0 / 255, 1e-9);
  EXPECT_EQ(scene.display.volume, "volume.nrrd");
  EXPECT_EQ(json_file(out / "s/import.json").at("volume_is_ultrasound"), true);
  const Ended image =
      run_brachy({"us", "--config", (out / "s/scene.toml").string(), "--out", (out / "image").string()});
  EXPECT_TRUE(exited(image, 0)) << image.err;
  EXPECT_TRUE(std::filesystem::exists(out / "image/transverse_000000.png"));
}

TEST_F(Import, SaysHowToUseImagesThatAreNoEchoesForTheUltrasound) {
  const TempFolder out;
  const Ended made = run_python(
      {source_file("make_image_series.py"), (*made_folder / "dicom").string(), (out / "ct").string(), "CT"});
  ASSERT_TRUE(exited(made, 0)) << made.err;
  const Ended ended = run_brachy({"import", (out / "ct").string(), "--out", (out / "s").string()});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const Scene scene = load_scene(out / "s/scene.toml");
  EXPECT_EQ(scene.ultrasound, UltrasoundSettings());
  EXPECT_EQ(scene.display.volume, "volume.nrrd");
  const char* line = "add under [ultrasound] in scene.toml: volume = \"volume.nrrd\"";
  EXPECT_NE(ended.err.find(line), std::string::npos) << ended.err;
  EXPECT_NE(json_file(out / "s/import.json").at("left").dump().find("[ultrasound]"), std::string::npos);
}

TEST_F(Import, GivesTheSceneTheColoursOfTheStructures) {
  const TempFolder out;
  ASSERT_TRUE(exited(
      run_brachy({"import", (*made_folder / "dicom/rtstruct.dcm").string(), "--out", (out / "s").string()}),
      0));
  const Scene scene = load_scene(out / "s/scene.toml");
  const auto json = json_file(out / "s/import.json").at("structures");
  EXPECT_EQ(scene.tissue.colour, json.at(0).at("colour"));
  ASSERT_EQ(scene.structures.size() + 1, json.size());
  for (std::size_t n = 0; n < scene.structures.size(); ++n) {
    EXPECT_EQ(scene.structures[n].colour.size(), 7U) << scene.structures[n].name;
    EXPECT_EQ(scene.structures[n].colour, json.at(n + 1).at("colour"));
  }
}

TEST_F(Import, BringsItsSegmentationBack) {
  const TempFolder out;
  const Ended ended = run_brachy(
      {"import", (*made_folder / "dicom/structures.seg.nrrd").string(), "--out", (out / "s").string()});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const auto was = load_structures(load_scene(kSession)),
             is = load_structures(load_scene(out / "s/scene.toml"));
  ASSERT_EQ(is.size(), was.size());
  for (std::size_t n = 0; n < was.size(); ++n) {
    EXPECT_EQ(is[n].name, was[n].name);
    // Half the diagonal of a voxel of 1 mm.
    EXPECT_LT(surface_distance(was[n].mesh, is[n].mesh).p95_mm, 0.87) << was[n].name;
  }
  for (const auto& structure : json_file(out / "s/import.json")["structures"])
    EXPECT_NEAR(structure["surface_cc"].get<double>() / structure["source_cc"].get<double>(), 1, 0.01);
  EXPECT_EQ(json_file(out / "s/import.json")["structures"][0]["colour"], "#d55e00");
}

/// Of the voxels that one map has and the other has not, whether each has a neighbour, also across an edge or corner,
/// in the other: then the Hausdorff distance of their voxels is at most a voxel's diagonal.
::testing::AssertionResult lie_within_a_voxel(const VoxelGrid& grid, const std::vector<std::uint16_t>& a,
                                              const std::vector<std::uint16_t>& b) {
  const auto has_near = [&](const std::vector<std::uint16_t>& labels, std::array<std::size_t, 3> at) {
    for (std::size_t k = at[2] == 0 ? 0 : at[2] - 1; k <= at[2] + 1 && k < grid.size[2]; ++k)
      for (std::size_t j = at[1] == 0 ? 0 : at[1] - 1; j <= at[1] + 1 && j < grid.size[1]; ++j)
        for (std::size_t i = at[0] == 0 ? 0 : at[0] - 1; i <= at[0] + 1 && i < grid.size[0]; ++i)
          if (labels[grid.index(i, j, k)] != 0) return true;
    return false;
  };
  for (std::size_t k = 0; k < grid.size[2]; ++k)
    for (std::size_t j = 0; j < grid.size[1]; ++j)
      for (std::size_t i = 0; i < grid.size[0]; ++i) {
        const std::size_t n = grid.index(i, j, k);
        if ((a[n] != 0) != (b[n] != 0) && !has_near(a[n] != 0 ? b : a, {i, j, k}))
          return ::testing::AssertionFailure() << "voxel " << i << " " << j << " " << k << " is in one only";
      }
  return ::testing::AssertionSuccess();
}

// The same contours by another program: the surfaces that an import makes of them fill the same voxels.
TEST_F(ImportForms, FillsTheVoxelsThatPlastimatchFills) {
  if (access("/usr/bin/plastimatch", X_OK) != 0) GTEST_SKIP() << "plastimatch is not installed";
  const TempFolder out;
  const std::string contours = (*made_folder / "dicom32/rtstruct.dcm").string();
  const Ended ended = run_brachy({"import", contours, "--out", (out / "s").string()});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  for (const Structure& structure : load_structures(load_scene(out / "s/scene.toml"))) {
    const SurfaceBvh surface(structure.mesh);
    // Voxels of 0.5 mm whose middles are in the planes of the contours, which are as far apart.
    const auto before = [](double mm) { return 0.5 * std::floor(2 * mm) - 0.75; };
    const std::array<double, 3> origin = {before(-surface.max().x()), before(-surface.max().y()),
                                          before(surface.min().z())};  // LPS
    std::string dim, from;
    for (int a = 0; a < 3; ++a) {
      dim += std::to_string(static_cast<int>(2 * (surface.max()[a] - surface.min()[a])) + 5) + " ";
      from += std::to_string(origin[static_cast<std::size_t>(a)]) + " ";
    }
    const Ended theirs = run_process({"/usr/bin/plastimatch", "convert", "--input", contours, "--origin",
                                      from, "--spacing", "0.5 0.5 0.5", "--dim", dim, "--output-prefix",
                                      (out / structure.name).string(), "--prefix-format", "nrrd"});
    ASSERT_TRUE(exited(theirs, 0)) << theirs.err;
    const LabelMap map =
        parse_label_nrrd(read_file(out / structure.name / (structure.name + ".nrrd")), structure.name);
    std::vector<std::uint16_t> ours(map.grid.count(), 0);
    const std::size_t count = rasterise(surface, map.grid, 1, ours);
    const auto filled = static_cast<std::size_t>(
        std::ranges::count_if(map.layers.front(), [](std::uint16_t value) { return value != 0; }));
    EXPECT_GT(filled, 1000u) << structure.name;
    EXPECT_NEAR(static_cast<double>(count) / static_cast<double>(filled), 1, 0.01) << structure.name;
    EXPECT_TRUE(lie_within_a_voxel(map.grid, ours, map.layers.front())) << structure.name;
  }
}

// The prostate of a patient, rasterised at 1 mm, comes back; plan, daemon and score take the scene as it is.
TEST_F(Import, TakesARealProstateAllTheWayToAPlan) {
  BRACHY_REQUIRE_DATA(data);
  const SurfaceMesh mesh = surface_file(data / "meshes/prostate_mr.ply");
  const SurfaceBvh surface(mesh);
  LabelMap map;
  map.grid.steps = 0.7 * Mat3::Identity();
  map.grid.origin = surface.min() - Vec3(2.1, 3.2, 1.3);
  for (int a = 0; a < 3; ++a)
    map.grid.size[static_cast<std::size_t>(a)] =
        static_cast<std::size_t>((surface.max()[a] - surface.min()[a]) / 0.7) + 8;
  map.layers.emplace_back(map.grid.count(), std::uint16_t{0});
  rasterise(surface, map.grid, 1, map.layers.front());
  map.segments.push_back({"Prostate", 1, 0, {}});
  const TempFolder out;
  const std::string file = out.write("map.seg.nrrd", to_seg_nrrd(map)),
                    scene = (out / "s/scene.toml").string();
  const Ended ended = run_brachy({"import", file, "--out", (out / "s").string()});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const SurfaceMesh back = surface_file(out / "s/prostate.ply");
  EXPECT_NEAR(enclosed_mm3(back) / enclosed_mm3(mesh), 1, 0.01);
  EXPECT_LT(surface_distance(mesh, back).p95_mm, 0.5);
  const std::string plan = (out / "s/plan.toml").string(), needles = (out / "needles.csv").string();
  const Ended planned = run_brachy({"plan", "--generate", "--config", scene, "--out", plan});
  ASSERT_TRUE(exited(planned, 0)) << planned.err;
  // The scene of a session with that plan, which the import has written too.
  const std::string session = (out / "s/session.toml").string();
  ASSERT_TRUE(exited(run_brachyd({"--check-config", session}), 0));
  const Ended path = run_brachy({"plan", "--config", session, "--trajectory", needles, "--speed-mm-s", "200",
                                 "--drop-speed-mm-s", "100"});
  ASSERT_TRUE(exited(path, 0)) << path.err;
  const std::string recording = (out / "recording").string();
  const Ended ran = run_brachyd({"--config", session, "--port", "0", "--trajectory", needles, "--play",
                                 "--duration", "15", "--session", recording});
  ASSERT_TRUE(exited(ran, 0)) << ran.err;
  const Ended scored = run_brachy({"score", recording, "--config", session, "--json"});
  ASSERT_TRUE(exited(scored, 0)) << scored.err;
  EXPECT_GT(json_of(scored).at("seeds").size(), 0u) << scored.out.substr(0, 2000);
}

TEST(CasePlan, DescribesItsTemplateAndReadsItBack) {
  TemplateGrid grid;
  grid.origin_mm = {-30.1, 1.0 / 3, 1e4};
  for (const char* from : {"left", "right"})
    for (const bool half_steps : {false, true}) {
      const auto back = parse_template_text(template_text(grid.named(from, half_steps), 82.5));
      ASSERT_TRUE(back);
      EXPECT_EQ(back->grid, grid.named(from, half_steps));
      EXPECT_EQ(back->base_plane_mm, 82.5);
    }
  EXPECT_FALSE(parse_template_text("another plan"));
  EXPECT_FALSE(parse_template_text(template_text(grid, 1e9)));
}

/// A channel of single seeds at these heights, as another planning system writes it: without a template.
RtChannel channel_at(double x, double y, const std::vector<double>& heights) {
  RtChannel channel;
  channel.source = 1;
  for (const double z : heights) channel.points.push_back({Vec3(x, y, z), 0, 0, std::nullopt});
  return channel;
}

TEST(CasePlan, FitsAForeignPlanToTheNearestTrainsAndSaysHowFarSeedsMoved) {
  RtBrachyPlan file;
  file.technique = "PERMANENT";
  RtSource source;
  source.number = 1;
  source.model = "STM1251";
  source.isotope = "I-125";
  source.air_kerma_strength_u = 0.4;
  file.sources = {source};
  file.channels = {channel_at(1.3, 2.1, {20, 10, 0}), channel_at(6.3, 2.1, {15, 10.5}),
                   channel_at(6.3, -2.9, {8})};
  const CasePlan plan = fit_plan(file, TemplateGrid(), "plan");
  ASSERT_EQ(plan.plan.needles.size(), 3u);
  EXPECT_EQ(plan.plan.needles[0].train, "s-s-s");
  EXPECT_EQ(plan.plan.needles[1].train, "ss");
  EXPECT_LT(plan.most_moved_mm, 1e-6);
  const auto seeds = plan.plan.seeds(plan.grid);
  EXPECT_LT((seeds[0].position - Vec3(1.3, 2.1, 20)).norm(), 1e-5);
  EXPECT_LT((seeds[5].position - Vec3(6.3, -2.9, 8)).norm(), 1e-5);
  file.channels.push_back(channel_at(12.1, 2.1, {20, 12}));
  const CasePlan moved = fit_plan(file, TemplateGrid(), "plan");
  EXPECT_GT(moved.most_moved_mm, 0.5);
  EXPECT_FALSE(moved.notes.empty());
  file.channels.back() = channel_at(200, 2.1, {20});
  EXPECT_THROW(fit_plan(file, TemplateGrid(), "plan"), UserError);
}

}  // namespace
}  // namespace brachy::test
