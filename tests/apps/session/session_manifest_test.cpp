// What a session was: the manifest's text, its hashes, and what counts as the same scene.
#include "apps/session/session_manifest.h"

#include "apps/session/sha256.h"
#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/file/scene_keys.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

// FIPS 180-4's own examples.
TEST(Sha256, IsThatOfTheStandard) {
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const TempFolder folder;
  const std::string million(1'000'000, 'a');
  const FileDigest digest = digest_of_file(folder.write("a", million));
  EXPECT_EQ(digest.sha256, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_EQ(digest.bytes, million.size());
  EXPECT_THROW(digest_of_file(folder / "none"), UserError);
  EXPECT_THROW(digest_of_file("/dev/zero"), UserError);
}

struct Manifest : ::testing::Test {
  /// A scene with a mesh, a structure and a plan.
  std::string scene_text(const std::string& more = "") const {
    return small_scene(
        "[plan]\nfile = \"plan.toml\"\n[[structure]]\nname = \"rectum\"\nfile = \"rectum.stl\"\n" + more);
  }
  std::string write_scene(const std::string& name, const std::string& text) const {
    return folder.write(name, text);
  }
  SessionManifest manifest() const {
    const std::string file = write_scene("scene.toml", scene_text());
    return make_manifest(load_scene(file), file);
  }

  TempFolder folder;
  const std::string plan = folder.write("plan.toml",
                                        "name = \"p\"\nsource = \"6711\"\nair_kerma_strength_u = "
                                        "0.5\nprescription_gy = 145\nbase_plane_mm = 82\n"
                                        "[[needle]]\nhole = \"H7\"\nretraction_mm = 2\ntrain = \"s-s-s\"\n");
  const std::string rectum = folder.write("rectum.stl", octahedron_stl(8));
};

TEST_F(Manifest, IsReadBackAsItWasWritten) {
  SessionManifest written = manifest();
  written.trainee = "Zoë \"Z\" Müller";
  written.exercise = ManifestText{"e.toml", "name = \"e\"\n"};
  written.runs = {{"0.1.0", "2026-11-28T09:30:00Z", "2026-11-28T09:40:00Z", 0},
                  {"0.1.1", "2026-11-29T09:30:00Z", "", 600.5}};
  EXPECT_EQ(parse_manifest(to_json(written), "m"), written);
  ASSERT_EQ(written.files.size(), 1u);
  EXPECT_EQ(written.files[0].key, "structure rectum");
  EXPECT_EQ(written.files[0].sha256, sha256_of(read_file(rectum)));
  ASSERT_TRUE(written.plan);
  EXPECT_EQ(written.plan->text, read_file(plan));
}

// The source that dose.source names, or HDR implies, is found when the scene is read.
TEST_F(Manifest, ASceneWhoseSourceAnotherKeyNamesIsItself) {
  for (const char* more : {"[dose]\nsource = \"200\"\n", "[implant]\nkind = \"hdr\"\n"}) {
    const std::string file = write_scene("scene.toml", small_scene(more));
    const Scene scene = load_scene(file);
    ASSERT_NE(scene.seeds.source, Scene().seeds.source);
    EXPECT_EQ(differences_from(make_manifest(scene, file), scene, ManifestScope::kJudged),
              std::vector<std::string>());
  }
  const std::string file = write_scene("scene.toml", small_scene("[dose]\nsource = \"200\"\n"));
  const SessionManifest pd = make_manifest(load_scene(file), file);
  const Scene cs = load_scene(write_scene("cs.toml", small_scene("[dose]\nsource = \"cs1-rev2\"\n")));
  EXPECT_EQ(differences_from(pd, cs, ManifestScope::kJudged).size(), 1u);
}

TEST_F(Manifest, DamagedOrEditedIsRefusedByName) {
  const std::string whole = to_json(manifest());
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      parse_manifest(text, "s/session.json");
      return "";
    } catch (const UserError& e) {
      return e.what();
    }
  };
  EXPECT_EQ(refusal(whole), "");
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, whole.size() / 2, whole.size() - 3})
    EXPECT_TRUE(refusal(whole.substr(0, size)).starts_with("s/session.json: ")) << size;
  std::string edited = whole;
  edited.replace(edited.find("hole = "), 7, "hole =  ");
  EXPECT_NE(refusal(edited).find("hash"), std::string::npos) << refusal(edited);
  std::string later = whole;
  later.replace(later.find("session 1"), 9, "session 9");
  EXPECT_NE(refusal(later).find("another version"), std::string::npos) << refusal(later);
  EXPECT_NE(refusal("[]"), "");
  EXPECT_NE(refusal("{\"format\": 3}"), "");
}

// Every key of a scene is either one that the session depends on or one that it does not.
TEST_F(Manifest, AnotherSceneIsOneByAnyKeyThatMatters) {
  const SessionManifest own = manifest();
  const auto differences = [&](const std::string& more, ManifestScope scope = ManifestScope::kRecorded) {
    return differences_from(own, load_scene(write_scene("other.toml", scene_text(more))), scope);
  };
  EXPECT_TRUE(differences("").empty());
  for (const char* service :
       {"[broker]\nsession = \"b\"\n", "[engine]\nthreads = 2\n", "[rates]\nsnapshot_hz = 20\n",
        "[realtime]\nlock_memory = true\n", "[ultrasound]\non = true\n"})
    EXPECT_TRUE(differences(service, ManifestScope::kJudged).empty()) << service;
  for (const auto& [more, part] : std::vector<std::pair<std::string, std::string>>{
           {"[needle]\nlength_mm = 190\n", "needle.length_mm was 200"},
           {"[rates]\ndeformation_hz = 100\n", "rates.deformation_hz was 200"},
           {"[seeds]\nmax_count = 17\n", "seeds.max_count"},
           {"[[structure]]\nname = \"bladder\"\nfile = \"rectum.stl\"\n", "structure bladder was none"}}) {
    const auto found = differences(more);
    ASSERT_EQ(found.size(), 1u) << more << listed_differences(found);
    EXPECT_NE(found[0].find(part), std::string::npos) << found[0];
  }
  const std::string goal = "[[goal]]\nstructure = \"prostate\"\nfigure = \"V100\"\nlimit = 90\n";
  EXPECT_TRUE(differences(goal).empty()) << "what was recorded does not depend on it";
  EXPECT_EQ(differences(goal, ManifestScope::kJudged).size(), 1u) << "what passes does";
}

TEST_F(Manifest, FilesAreTheSameByTheirContentWhereverTheyAre) {
  const SessionManifest own = manifest();
  std::filesystem::create_directory(folder / "moved");
  folder.write("moved/r.stl", read_file(rectum));
  folder.write("moved/p.toml", "# a comment\n" + read_file(plan));
  std::string text = scene_text();
  text.replace(text.find("plan.toml"), 9, "p.toml");
  text.replace(text.find("rectum.stl"), 10, "r.stl");
  EXPECT_TRUE(
      differences_from(own, load_scene(folder.write("moved/s.toml", text)), ManifestScope::kJudged).empty());

  folder.write("rectum.stl", octahedron_stl(9));
  const auto found = differences_from(own, load_scene(folder / "scene.toml"), ManifestScope::kRecorded);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].find("rectum.stl has another content"), std::string::npos) << found[0];
  try {
    scene_of(own, "out/s");
    FAIL() << "another rectum was taken";
  } catch (const UserError& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("out/s: ")) << e.what();
  }
  std::filesystem::remove(rectum);
  EXPECT_THROW(scene_of(own, "out/s"), UserError);
}

TEST_F(Manifest, ThePlanIsTheOneAtTheStartWhateverBecameOfItsFile) {
  const SessionManifest own = manifest();
  const Scene scene = scene_of(own, "s");
  folder.write("plan.toml", "nothing\n");
  const auto kept = plan_of(own, scene);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->needles.at(0).hole, "H7");
  EXPECT_FALSE(differences_from(own, scene, ManifestScope::kRecorded).empty());
}

TEST_F(Manifest, OfTheBuiltInPhantomHasNoFile) {
  const SessionManifest own = make_manifest(Scene(), std::nullopt);
  EXPECT_EQ(parse_manifest(to_json(own), "m"), own);
  EXPECT_TRUE(differences_from(own, scene_of(own, "s"), ManifestScope::kJudged).empty());
  EXPECT_FALSE(
      differences_from(own, load_scene(folder.write("s.toml", small_scene())), ManifestScope::kRecorded)
          .empty());
}

}  // namespace
}  // namespace brachy
