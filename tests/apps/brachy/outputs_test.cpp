// Nothing that a tool writes overwrites anything: every tool and every output option of its --help. An option that the
// table below does not have fails the test, as does one whose help speaks of writing without being one of these.
#include <regex>
#include <set>

#include "apps/command_line/study_commands.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// An option as --help describes it.
struct HelpedOption {
  std::string name, head, help;  // "--out", "--out NEW FILE REQUIRED", "CSV to write"
};

std::vector<HelpedOption> options_in(const std::string& help) {
  std::vector<HelpedOption> options;
  for (const std::string& line : lines_of(help)) {
    if (line == "Examples:") break;
    if (line.starts_with("  ") && line.size() > 2 && line[2] != ' ') {
      const std::size_t column = line.find("  ", 2);
      const std::string head = line.substr(2, column - 2);
      options.push_back({head.substr(0, head.find(' ')), head,
                         column == line.npos ? "" : line.substr(line.find_first_not_of(' ', column))});
    } else if (line.starts_with("      ") && !options.empty()) {
      options.back().help += " " + line.substr(line.find_first_not_of(' '));
    }
  }
  return options;
}

std::vector<std::string> tools() {
  std::vector<std::string> names;
  bool is_list = false;
  for (const std::string& line : lines_of(run_brachy({"--help"}).out)) {
    if (is_list && line.starts_with("  ")) names.push_back(line.substr(2, line.find(' ', 2) - 2));
    is_list |= line == "Subcommands:";
  }
  return names;
}

/// A command line of a tool whose option writes to "OUT"; "": it cannot be run to its end here, only refused.
struct Case {
  std::string tool, option;
  std::vector<std::string> line;
  bool runs = true;
};

struct Outputs : ::testing::Test {
  std::string in(const std::string& name) const { return (folder / name).string(); }

  Outputs() {
    fs::create_directory(in("r"));
    fs::create_directory(in("history"));
    fs::create_directory(in("history/1"));
    folder.write("r/seeds.csv", std::string(kSeedHeader) + "\n");
    folder.write("r/poses.csv", short_insertion(0.5));
    folder.write("history/1/report.json", "{\"findings\":[]}");
  }

  std::vector<Case> cases() const {
    return {
        {"replay", "--log", {"replay", trajectory, "--offline", "--config", scene, "--log", "OUT"}},
        {"replay", "--session", {"replay", trajectory, "--offline", "--config", scene, "--session", "OUT"}},
        {"record", "--out", {"record", "--connect", "127.0.0.1:1", "--out", "OUT"}, false},
        {"export", "--out", {"export", scene, "--out", "OUT"}, false},
        {"deform",
         "--out",
         {"deform", "--landmarks", landmarks, "--points", points, "--support", "12", "--out", "OUT"}},
        {"dose", "--out", {"dose", "--seeds", seeds, "--points", points, "--out", "OUT"}},
        {"dose", "--grid", {"dose", "--seeds", seeds, "--config", scene, "--grid", "OUT"}},
        {"inspect", "--out", {"inspect", mesh, "--out", "OUT"}},
        {"import", "--out", {"import", mesh, "--out", "OUT"}, false},
        {"check-dose", "--html", {"check-dose", mesh, "--html", "OUT"}, false},
        {"plot-force", "--out", {"plot-force", forces, "--out", "OUT"}},
        {"score", "--out", {"score", in("r"), "--plan", plan, "--config", scene, "--out", "OUT"}, false},
        {"score", "--csv", {"score", "--history", in("history"), "--csv", "OUT"}},
        {"robust", "--csv", {"robust", plan, "--config", scene, "--draws", "1", "--csv", "OUT"}},
        {"robust",
         "--seeds",
         {"robust", plan, "--config", scene, "--draws", "1", "--draw", "0", "--seeds", "OUT"}},
        {"plan", "--out", {"plan", plan, "--config", scene, "--out", "OUT.toml"}},
        {"plan", "--csv", {"plan", plan, "--config", scene, "--csv", "OUT"}},
        {"plan", "--seeds", {"plan", plan, "--config", scene, "--seeds", "OUT"}},
        {"plan", "--structures", {"plan", plan, "--config", scene, "--structures", "OUT"}},
        {"plan", "--trajectory", {"plan", plan, "--config", scene, "--trajectory", "OUT"}},
        {"us", "--out", {"us", "--config", scene, "--out", "OUT"}, false},
    };
  }

  /// The line with `out` in its place; its own extension where it needs one.
  static std::vector<std::string> line_to(const Case& c, const std::string& out) {
    std::vector<std::string> line = c.line;
    for (std::string& word : line)
      if (word == "OUT" || word == "OUT.toml") word = out;
    return line;
  }
  std::string out_of(const Case& c, const std::string& name) const {
    return in(name) + (c.line.back() == "OUT.toml" ? ".toml" : "");
  }
  static std::vector<std::string> with(std::vector<std::string> line, const std::string& more) {
    line.push_back(more);
    return line;
  }

  TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene());
  const std::string trajectory = folder.write("trajectory.csv", short_insertion(0.2));
  const std::string mesh = folder.write("mesh.stl", octahedron_stl(20));
  const std::string landmarks = folder.write("landmarks.csv", "x,y,z,dx,dy,dz\n0,0,0,1,0,0\n");
  const std::string points = folder.write("points.csv", "x,y,z\n1,0,0\n");
  const std::string seeds =
      folder.write("seeds.csv", "x,y,z,ax,ay,az,source,strength_u\n0,0,0,0,0,1,6711,0.5\n");
  const std::string plan = folder.write("plan.toml",
                                        "name = \"p\"\nsource = \"6711\"\nair_kerma_strength_u = "
                                        "0.5\nprescription_gy = 145\nbase_plane_mm = 82\n"
                                        "[[needle]]\nhole = \"H7\"\nretraction_mm = 2\ntrain = \"s-s-s\"\n");
  const std::string forces = folder.write(
      "forces.csv",
      "t_s,needle,state,depth_mm,fx_n,fy_n,fz_n,axial_n,lateral_n,cutting_n,friction_n,landmarks,min_det\n"
      "0.1,0,inserted,1,0,0,0.1,0.1,0,0.05,0.05,3,1\n0.2,0,inserted,2,0,0,0.1,0.1,0,0.05,0.05,3,1\n");
};

TEST_F(Outputs, EveryOneOfTheHelpIsTried) {
  std::set<std::pair<std::string, std::string>> tried, found;
  for (const Case& c : cases()) tried.insert({c.tool, c.option});
  for (const std::string& tool : tools()) {
    if (is_study_command(tool)) continue;
    const Ended help = run_brachy({tool, "--help"});
    ASSERT_TRUE(exited(help, 0)) << tool;
    bool has_file = false, has_force = false;
    for (const HelpedOption& option : options_in(help.out)) {
      const bool is_output = option.head.find(" NEW F") != option.head.npos;
      has_file |= option.head.find(" NEW FILE") != option.head.npos;
      has_force |= option.name == "--force";
      if (is_output) found.insert({tool, option.name});
      const std::regex writes("\\b(to write|also write|write the surface)\\b");
      EXPECT_TRUE(is_output || !std::regex_search(option.help, writes) ||
                  option.head.find(' ') == option.head.npos)
          << tool << " " << option.name << " writes, but is no output: declare it with add_output";
    }
    EXPECT_EQ(has_file, has_file && has_force) << tool << " has outputs but no --force";
  }
  EXPECT_EQ(found, tried);
}

TEST_F(Outputs, AFileIsNotOverwrittenWithoutForceAndAnInputNever) {
  for (const Case& c : cases()) {
    if (std::set<std::string>{"--session", "--structures"}.contains(c.option)) continue;
    const bool is_folder = std::set<std::string>{"record", "export", "import", "us"}.contains(c.tool);
    SCOPED_TRACE(c.tool + " " + c.option);
    const std::string out = out_of(c, "new_" + c.tool + c.option);
    if (c.runs && !is_folder) {
      ASSERT_TRUE(exited(run_brachy(line_to(c, out)), 0));
      const std::string first = read_file(out);
      EXPECT_FALSE(first.empty());
      EXPECT_TRUE(refused_in_one_line(run_brachy(line_to(c, out)), {out, "exists already"}));
      folder.write(fs::path(out).filename().string(), "somebody's text");
      EXPECT_TRUE(refused_in_one_line(run_brachy(line_to(c, out)), {out, "exists already"}));
      EXPECT_EQ(read_file(out), "somebody's text");
      EXPECT_TRUE(exited(run_brachy(with(line_to(c, out), "--force")), 0));
      EXPECT_EQ(read_file(out), first) << "the same bytes again";
      // By a link, also one that leads nowhere.
      const std::string victim = folder.write("victim.txt", "text"),
                        link = out_of(c, "link_" + c.tool + c.option);
      fs::create_symlink(victim, link);
      EXPECT_TRUE(refused_in_one_line(run_brachy(line_to(c, link)), {"exists already"}));
      EXPECT_EQ(read_file(victim), "text");
      fs::remove(victim);
      EXPECT_TRUE(refused_in_one_line(run_brachy(line_to(c, link)), {"exists already"}));
      EXPECT_FALSE(fs::exists(victim));
      EXPECT_TRUE(refused_in_one_line(run_brachy(line_to(c, out_of(c, "no/folder/f"))), {"no folder"}));
    }
    if (!c.runs && !is_folder) {
      const std::string there = folder.write("there", "text");
      EXPECT_TRUE(refused_in_one_line(run_brachy(line_to(c, there)), {"exists already"}));
      EXPECT_EQ(read_file(there), "text");
    }
    // Each input, by its own name, by another spelling and by a hard link.
    for (const std::string& input : c.line) {
      if (!fs::is_regular_file(input)) continue;
      const std::string before = read_file(input), again = out_of(c, "again");
      fs::create_hard_link(input, again);
      for (const std::string& name :
           {input, (folder / ("./" + fs::path(input).filename().string())).string(), again}) {
        std::vector<std::string> line = line_to(c, name);
        if (!is_folder) line.emplace_back("--force");
        const Ended ended = run_brachy(line);
        EXPECT_EQ(ended.exit_code, 2) << name << ended.out << ended.err;
        EXPECT_EQ(read_file(input), before) << name;
      }
      fs::remove(again);
    }
  }
}

TEST_F(Outputs, AFolderKeepsWhatIsInIt) {
  for (const Case& c : cases()) {
    const bool is_folder = std::set<std::string>{"record", "export", "import", "us"}.contains(c.tool) ||
                           c.option == "--session" || c.option == "--structures";
    if (!is_folder) continue;
    SCOPED_TRACE(c.tool + " " + c.option);
    const std::string out = in("folder_" + c.tool + c.option);
    fs::create_directory(out);
    const std::vector<std::string> names = {
        "events.csv", "report.html", "seeds.csv",    "recording.pvd",    "structures.pvd", "prostate.vtp",
        "scene.toml", "rest.png",    "session.json", "transverse_0.png", "structures/x"};
    fs::create_directory(out + "/structures");
    for (const std::string& name : names)
      folder.write(fs::path(out).filename().string() + "/" + name, "somebody's");
    EXPECT_EQ(run_brachy(line_to(c, out)).exit_code, 2);
    for (const std::string& name : names) EXPECT_EQ(read_file(out + "/" + name), "somebody's") << name;
    const std::string file = folder.write("file", "text");
    EXPECT_EQ(run_brachy(line_to(c, file)).exit_code, 2);
    EXPECT_EQ(read_file(file), "text");
  }
}

TEST_F(Outputs, OneNameForTwoIsRefused) {
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"plan", plan, "--config", scene, "--csv", in("x"), "--seeds", in("./x"), "--force"}),
      {"named for two outputs"}));
  EXPECT_FALSE(fs::exists(in("x")));
}

TEST_F(Outputs, AStreamIsWrittenTo) {
  const Ended ended = run_brachy({"dose", "--seeds", seeds, "--points", points, "--out", "/dev/stdout"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("x,y,z,dose_rate_cgy_h,total_gy\n1,0,0,"), std::string::npos) << ended.out;
  EXPECT_TRUE(exited(run_brachy({"dose", "--seeds", seeds, "--points", points, "--out", "/dev/null"}), 0));
}

// What could not be computed leaves no file, and what is there already stays, also with --force.
TEST_F(Outputs, AnErrorLeavesThemAsTheyWere) {
  const std::string out = folder.write("kept.csv", "text");
  folder.write("bad.csv", "x,y,z\nnonsense\n");
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"dose", "--seeds", seeds, "--points", in("bad.csv"), "--out", out, "--force"}),
      {"bad.csv:2"}));
  EXPECT_EQ(read_file(out), "text");
  EXPECT_EQ(
      run_brachy({"dose", "--seeds", seeds, "--points", in("bad.csv"), "--out", in("none.csv")}).exit_code,
      2);
  EXPECT_FALSE(fs::exists(in("none.csv")));
}

}  // namespace
}  // namespace brachy
