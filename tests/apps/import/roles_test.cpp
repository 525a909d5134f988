// Roles, the choice of the gland, and images beside label maps, the programs from outside. import_cases.py has the
// kinds of cases in number.
#include <gtest/gtest.h>

#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"
#include "tests/apps/import/import_testing.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy::test {
namespace {

/// An RTSTRUCT of the session's scene whose structures are called otherwise, and copies of the gland with these names.
std::string renamed(const TempFolder& folder, const std::string& names, const std::string& copies) {
  const std::string dicom = (folder / "dicom").string(), file = (folder / "RS.dcm").string();
  const std::string session = (kConfigFolder / "session.toml").string();
  EXPECT_TRUE(exited(run_brachy({"export", "--dicom", dicom, "--config", session}), 0));
  const Ended made = run_python(
      {"-c",
       "import copy,json,pydicom,sys\nd=pydicom.dcmread(sys.argv[1]); names=json.loads(sys.argv[3])\n"
       "rois,contours=d.StructureSetROISequence,d.ROIContourSequence\n"
       "for r in rois: r.ROIName=names.get(r.ROIName,r.ROIName)\n"
       "for n,name in enumerate(json.loads(sys.argv[4])):\n"
       "  r,c=copy.deepcopy(rois[0]),copy.deepcopy(contours[0])\n"
       "  r.ROIName=name; r.ROINumber=c.ReferencedROINumber=90+n\n"
       "  for k in c.ContourSequence: k.ContourData=[float(v)*(1.2 if i%3<2 else 1) for i,v in "
       "enumerate(k.ContourData)]\n"
       "  rois.insert(0,r); contours.append(c)\n"
       "d.SpecificCharacterSet='ISO_IR 192'; d.save_as(sys.argv[2])\n",
       dicom + "/rtstruct.dcm", file, names, copies});
  EXPECT_TRUE(exited(made, 0)) << made.err;
  return file;
}

std::string role_in(const nlohmann::json& report, const std::string& name) {
  for (const auto& s : report.at("structures"))
    if (s.at("name_in_file") == name) return s.at("role");
  return "missing";
}

TEST(ImportRoles, AreThoseOfTheNamesAndReachThePlannerTheDoseAndTheExport) {
  if (!has_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed";
  const TempFolder folder;
  const std::string file =
      renamed(folder, R"({"prostate": "Prostata", "urethra": "Urethra_Prostatc", "rectum": "Enddarm"})",
              R"(["PTV_Prostata", "Ring prostate-PTV", "Prostata+5mm", "Rectum_PRV"])");
  const std::string out = (folder / "s").string(), scene_file = out + "/scene.toml";
  const Ended ended = run_brachy({"import", file, "--out", out, "--json"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const auto report = nlohmann::json::parse(ended.out);
  EXPECT_EQ(report, json_file(out + "/import.json"));
  EXPECT_EQ(report.at("warnings").size(), 0u) << report.at("warnings");
  EXPECT_EQ(report.at("structures").at(0).at("name"), "prostate");
  EXPECT_EQ(role_in(report, "Prostata"), "prostate");
  EXPECT_EQ(role_in(report, "Urethra_Prostatc"), "urethra");
  EXPECT_EQ(role_in(report, "Enddarm"), "rectum");
  EXPECT_EQ(role_in(report, "PTV_Prostata"), "target");
  EXPECT_EQ(role_in(report, "Ring prostate-PTV"), "other");
  EXPECT_EQ(role_in(report, "Rectum_PRV"), "other");
  const auto structures = load_structures(load_scene(scene_file));
  ASSERT_NE(find_structure(structures, "urethra"), nullptr);
  EXPECT_EQ(find_structure(structures, "urethra")->label, "Urethra_Prostatc");
  EXPECT_EQ(find_structure(structures, "rectum")->label, "Enddarm");
  const Ended planned =
      run_brachy({"plan", "--generate", "--config", scene_file, "--out", out + "/plan.toml", "--json"});
  ASSERT_TRUE(exited(planned, 0)) << planned.err;
  EXPECT_EQ((planned.out + planned.err).find("assumed"), std::string::npos) << planned.out << planned.err;
  // And goes out under the name that it came with.
  const std::string again = (folder / "again").string();
  ASSERT_TRUE(exited(run_brachy({"export", "--dicom", again, "--config", scene_file}), 0));
  const Ended names = run_python({"-c",
                                  "import pydicom,sys\nprint(*[r.ROIName for r in "
                                  "pydicom.dcmread(sys.argv[1]).StructureSetROISequence])",
                                  again + "/rtstruct.dcm"});
  EXPECT_NE(names.out.find("Urethra_Prostatc"), std::string::npos) << names.out << names.err;
  EXPECT_NE(names.out.find("Enddarm"), std::string::npos) << names.out;
}

TEST(ImportRoles, WhatNamesDoNotDecideIsAskedForByTheNamesOfTheFile) {
  if (!has_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed";
  const TempFolder folder;
  const std::string file = renamed(folder, R"_({"prostate": "Drüse (klein)", "rectum": "Ampulle"})_",
                                   R"(["PTV 1", "PTV 2", "BODY"])");
  const auto import_to = [&](const char* to, const std::vector<std::string>& more) {
    std::vector<std::string> line = {"import", file, "--out", (folder / to).string()};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  EXPECT_TRUE(refused_in_last_line(import_to("a", {}), {"which structure is the prostate?", "\"PTV 1\" (",
                                                        "\"PTV 2\" (", "--gland \"NAME\""}));
  EXPECT_TRUE(refused_in_last_line(import_to("a", {"--gland", "Druse"}),
                                   {"--gland: there is no structure \"Druse\"", "\"Drüse (klein)\""}));
  EXPECT_TRUE(
      refused_in_last_line(import_to("a", {"--role", "gall=x"}), {"--role gall=x", "urethra, rectum"}));
  for (const char* name : {"Drüse (klein)", "Druese_klein", "DRUESE klein"}) {
    const TempFolder out;
    const Ended ended = run_brachy(
        {"import", file, "--out", (out / "s").string(), "--gland", name, "--role", "rectum=Ampulle"});
    ASSERT_TRUE(exited(ended, 0)) << name << ended.err;
    const nlohmann::json report = json_file(out / "s/import.json");
    EXPECT_EQ(role_in(report, "Drüse (klein)"), "prostate") << name;
    EXPECT_EQ(role_in(report, "Ampulle"), "rectum") << name;
    EXPECT_EQ(role_in(report, "urethra"), "urethra") << name;
    const auto structures = load_structures(load_scene(out / "s/scene.toml"));
    EXPECT_EQ(find_structure(structures, "rectum")->label, "Ampulle");
  }
}

TEST(ImportRoles, AnotherOrganIsNoGlandThoughItIsAlone) {
  if (!has_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed";
  const TempFolder folder;
  const std::string file =
      renamed(folder, R"({"prostate": "Gewebe A"})", R"(["Liver", "Harnblase", "kidney_left", "1"])");
  const auto import_only = [&](const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"import", file, "--only", name, "--out", (folder / "s").string()};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  for (const std::string name : {"Liver", "Harnblase", "kidney_left", "urethra"})
    EXPECT_TRUE(refused_in_last_line(
        import_only(name), {"no structure is called as a prostate", "\"" + name + "\"", "--gland \"NAME\""}));
  const Ended asked = import_only("Gewebe A", {"--gland", "Gewebe A"});
  EXPECT_TRUE(exited(asked, 0)) << asked.err;
  EXPECT_EQ(asked.err.find("WARNING: \"Gewebe A\" is not called"), std::string::npos) << asked.err;
  for (const std::string name : {"Gewebe A", "1"}) {
    std::filesystem::remove_all(folder / "s");
    const Ended taken = import_only(name);
    EXPECT_TRUE(exited(taken, 0)) << taken.err;
    EXPECT_NE((taken.out + taken.err).find("WARNING: \"" + name + "\" is not called as a prostate is"),
              std::string::npos)
        << taken.out << taken.err;
  }
}

TEST(SceneGeometry, FrameAndAnatomyReachTheCheckTheInspectionAndTheExport) {
  // A gland in LPS, and a rectum behind it: y is to the back.
  const TempFolder folder;
  const auto box = [](const Vec3& lo, const Vec3& hi) { return binary_stl(make_box(lo, hi)); };
  folder.write("gland.stl", box({-20, -20, -20}, {20, 20, 20}));
  folder.write("Rektum.stl", box({-15, 25, -25}, {15, 50, 25}));
  const auto scene = [&](const char* file, const char* frame) {
    return folder.write(
        file, std::string("[tissue]\nmesh = \"gland.stl\"\npoints = 500\nframe = \"") + frame +
                  "\"\n[anchors]\ncount = 4\n[[structure]]\nname = \"Rektum\"\nfile = \"Rektum.stl\"\n");
  };
  const std::string right = scene("right.toml", "LPS"), wrong = scene("wrong.toml", "RAS");
  const Ended good = run_brachyd({"--check-config", right}), bad = run_brachyd({"--check-config", wrong});
  EXPECT_TRUE(exited(good, 0)) << good.err;
  EXPECT_EQ(good.err.find("WARNING"), std::string::npos) << good.err;
  EXPECT_TRUE(exited(bad, 0)) << bad.err;
  EXPECT_NE(bad.err.find("WARNING: \"Rektum\" is not posterior of the prostate"), std::string::npos)
      << bad.err;
  const nlohmann::json seen = json_of(run_brachy({"inspect", right, "--json"}));
  ASSERT_EQ(seen.at("structures").size(), 2u);
  EXPECT_EQ(seen.at("structures").at(1).at("role"), "rectum");
  EXPECT_NEAR(seen.at("structures").at(1).at("centroid_mm").at(1).get<double>(), -37.5, 1e-3);
  EXPECT_EQ(seen.at("warnings").size(), 0u);
  EXPECT_TRUE(run_brachy({"inspect", wrong}).out.starts_with("WARNING: "));
  if (!has_pydicom()) return;
  const std::string dicom = (folder / "dicom").string();
  ASSERT_TRUE(exited(run_brachy({"export", "--dicom", dicom, "--config", right}), 0));
  const Ended middle = run_python({"-c",
                                   "import numpy,pydicom,sys\nd=pydicom.dcmread(sys.argv[1])\n"
                                   "n={r.ROIName:r.ROINumber for r in d.StructureSetROISequence}['Rektum']\n"
                                   "c=next(c for c in d.ROIContourSequence if c.ReferencedROINumber==n)\n"
                                   "print(numpy.mean([numpy.reshape(k.ContourData,(-1,3)).astype(float).mean("
                                   "0)[1] for k in c.ContourSequence]))",
                                   dicom + "/rtstruct.dcm"});
  EXPECT_NEAR(std::strtod(middle.out.c_str(), nullptr), 37.5, 0.5) << middle.out << middle.err;
}

}  // namespace
}  // namespace brachy::test
