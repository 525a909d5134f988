#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "core/base/error.h"
#include "haptics/trajectory/rigid_pose.h"
#include "haptics/trajectory/trajectory.h"

namespace brachy {
namespace {

const std::string kHeader = std::string(kTrajectoryHeader) + "\n";

/// A row at t with the tip at (x, 0, 0) and no rotation.
std::string row(const std::string& t, const std::string& x = "1") {
  return t + ",1,0,0," + x + ",0,1,0,0,0,0,1,0\n";
}

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const UserError& error) {
    return error.what();
  }
  return "no error";
}

std::string parse_error(const std::string& text) {
  const std::string message = error_of([&] { parse_trajectory(text, "t.csv"); });
  EXPECT_EQ(message.find('\n'), message.npos) << message;
  return message;
}

void expect_error(const std::string& text, const std::string& start, const std::string& part = "") {
  const std::string message = parse_error(text);
  EXPECT_TRUE(message.starts_with(start)) << message;
  EXPECT_NE(message.find(part), message.npos) << message;
}

TEST(TrajectoryCsv, ReadsRowsInOrder) {
  const Trajectory trajectory = parse_trajectory(kHeader + row("0.5", "-2.25") + row("0.75"), "t.csv");
  ASSERT_EQ(trajectory.samples().size(), 2u);
  EXPECT_EQ(trajectory.start_s(), 0.5);
  EXPECT_EQ(trajectory.duration_s(), 0.25);
  EXPECT_EQ(trajectory.samples()[0].X_WN.p, Vec3(-2.25, 0, 0));
}

TEST(TrajectoryCsv, TheMatrixIsReadRowByRow) {
  const Trajectory trajectory = parse_trajectory(kHeader + "0,0,-1,0,7,1,0,0,8,0,0,1,9\n", "t.csv");
  const RigidTransform& X_WN = trajectory.samples()[0].X_WN;
  EXPECT_EQ(X_WN.p, Vec3(7, 8, 9));
  EXPECT_EQ(X_WN.R * Vec3::UnitX(), Vec3::UnitY());
}

TEST(TrajectoryCsv, AcceptsCrlfBlankLinesCommentsSpacesAndNoLastLineEnd) {
  const std::string text = "\xEF\xBB\xBF# tracked\r\n" + std::string(kTrajectoryHeader) +
                           "\r\n# first\r\n 0, 1,0,0,+1.5 ,0,1,0,0,0,0,1,0\r\n\r\n1,1,0,0,2,0,1,0,0,0,0,1,0";
  const Trajectory trajectory = parse_trajectory(text, "t.csv");
  ASSERT_EQ(trajectory.samples().size(), 2u);
  EXPECT_EQ(trajectory.samples()[0].X_WN.p.x(), 1.5);
  EXPECT_EQ(trajectory.samples()[1].X_WN.p.x(), 2);
}

TEST(TrajectoryCsv, RefusesAnEmptyFile) {
  for (const char* text : {"", "\n\n", "# only a comment\n"})
    expect_error(text, "t.csv:1: the file is empty");
}

TEST(TrajectoryCsv, RefusesAHeaderWithoutRows) {
  expect_error(kHeader, "t.csv:1: no rows after the header");
  expect_error(kHeader + "\n# none\n", "t.csv:3: no rows after the header");
}

TEST(TrajectoryCsv, RefusesAWrongHeaderAndNamesTheExpectedOne) {
  expect_error(row("0"), "t.csv:1: expected the header t_s,m00,m01,", "found '0,1,0,0,1,");
  expect_error("# c\nt,x,y,z\n", "t.csv:2: expected the header");
  expect_error("t_s,m00\n" + row("0"), "t.csv:1: expected the header");
}

TEST(TrajectoryCsv, RefusesColumnsItDoesNotKnow) {
  expect_error(std::string(kTrajectoryHeader).append(",needle\n") + row("0"),
               "t.csv:1: unknown columns 'needle'");
}

TEST(TrajectoryCsv, RefusesAWrongNumberOfColumns) {
  expect_error(kHeader + row("0") + "1,1,0,0,1\n", "t.csv:3: found 5 columns, expected 13");
  expect_error(kHeader + "0,1,0,0,1,0,1,0,0,0,0,1,0,0\n", "t.csv:2: found 14 columns, expected 13");
}

TEST(TrajectoryCsv, RefusesWhatIsNotANumber) {
  for (const char* x : {"", "abc", "1.0mm", "1 2", "0x10", "--1", "1,5"}) {
    const std::string message = parse_error(kHeader + row("0", x));
    EXPECT_TRUE(message.starts_with("t.csv:2: ")) << message;
  }
  expect_error(kHeader + row("0", "12o"), "t.csv:2: column 5 is not a number: '12o'");
  expect_error(kHeader + row("0", "1e999"), "t.csv:2: column 5 '1e999' is out of range for a double");
}

TEST(TrajectoryCsv, RefusesNanAndInfinity) {
  for (const char* x : {"nan", "NaN", "inf", "-Infinity"}) {
    expect_error(kHeader + row("0", x), "t.csv:2: column 5 is '");
    expect_error(kHeader + row(x), "t.csv:2: column 1 is '");
  }
}

TEST(TrajectoryCsv, RefusesARotationThatIsNotRigid) {
  expect_error(kHeader + "0,1.001,0,0,0,0,1,0,0,0,0,1,0\n", "t.csv:2: the 3×3 part is not a rotation");
  expect_error(kHeader + "0,1,0,0,0,0,1,0,0,0,0,-1,0\n", "t.csv:2: the 3×3 part is not a rotation");
  expect_error(kHeader + "0,0,0,0,0,0,0,0,0,0,0,0,0\n", "t.csv:2: the 3×3 part is not a rotation");
  expect_error(kHeader + "0,1e300,1e300,0,0,-1e300,1e300,0,0,0,0,1,0\n",
               "t.csv:2: the 3×3 part is not a rotation");
}

TEST(TrajectoryCsv, RepairsARotationWithinToleranceToTheNearest) {
  const Trajectory trajectory =
      parse_trajectory(kHeader + "0,1.0004,0,0,0,0,1,1e-4,0,0,0,0.9997,0\n", "t.csv");
  const Mat3& R = trajectory.samples()[0].X_WN.R;
  EXPECT_LT(rigidity_error(trajectory.samples()[0].X_WN), 1e-15);
  EXPECT_NEAR(R(1, 2), 0.5e-4, 1e-8);  // the skew part is kept, the stretch is not
  EXPECT_NEAR(R(2, 1), -0.5e-4, 1e-8);
}

TEST(TrajectoryCsv, KeepsARotationWithin1e9BitForBit) {
  const Trajectory trajectory = parse_trajectory(kHeader + "0,1.0000000004,0,0,0,0,1,0,0,0,0,1,0\n", "t.csv");
  EXPECT_EQ(trajectory.samples()[0].X_WN.R(0, 0), 1.0000000004);
}

TEST(TrajectoryCsv, RefusesTipsBeyondTenMetres) {
  expect_error(kHeader + row("0", "10000.1"), "t.csv:2: the tip is more than 10 m from the origin", "mm");
}

TEST(TrajectoryCsv, RefusesTimesThatDoNotIncrease) {
  expect_error(kHeader + row("0") + row("1") + row("1"), "t.csv:4: t_s does not increase");
  expect_error(kHeader + row("0") + "# c\n" + row("-1"), "t.csv:4: t_s does not increase");
  expect_error(kHeader + row("1e10"), "t.csv:2: t_s 1e+10 is too large");
}

TEST(TrajectoryCsv, RefusesMoreRowsThanTheLimit) {
  std::string text = kHeader;
  for (std::size_t i = 0; i <= kMaxTrajectorySamples; ++i) text += row(std::to_string(i));
  expect_error(text, "t.csv:4000002: more than 4000000 rows");
}

TEST(TrajectoryCsv, QuotesOnlyShortPrintableTextInErrors) {
  const std::string message = parse_error(std::string("\x1b[31m\0\xff", 7) + std::string(10'000, 'x'));
  EXPECT_LT(message.size(), 300u);
  for (char c : message) EXPECT_TRUE(c != '\x1b' && c != '\0' && c != '\xff');
}

TEST(TrajectoryCsv, AFileCutOffAnywhereIsReadInPartOrRefusedButNeverCrashes) {
  const std::string text = kHeader + row("0.25", "-12.5") + row("0.5", "3e1");
  for (std::size_t length = 0; length < text.size(); ++length) {
    try {
      EXPECT_LE(parse_trajectory(text.substr(0, length), "t.csv").samples().size(), 2u);
    } catch (const UserError&) {
    }
  }
}

class TrajectoryFile : public testing::Test {
 protected:
  TrajectoryFile() { std::filesystem::create_directories(folder_); }
  ~TrajectoryFile() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("brachy_trajectory_" + std::to_string(getpid()));
};

TEST_F(TrajectoryFile, IsLoadedAndErrorsNameItAndTheLine) {
  const auto file = folder_ / "t.csv";
  std::ofstream(file) << kHeader << row("0");
  EXPECT_EQ(load_trajectory(file).samples().size(), 1u);
  std::ofstream(file, std::ios::app) << "x\n";
  EXPECT_TRUE(error_of([&] { load_trajectory(file); }).starts_with(file.string() + ":3: found 1 columns"));
}

TEST_F(TrajectoryFile, MissingOrNoFileAtAllIsRefusedByName) {
  const auto missing = folder_ / "missing.csv";
  EXPECT_TRUE(error_of([&] { load_trajectory(missing); }).starts_with(missing.string() + ": no such file"));
  EXPECT_TRUE(error_of([&] { load_trajectory(folder_); }).starts_with(folder_.string() + ": not a file"));
  EXPECT_TRUE(error_of([&] { load_trajectory("/dev/zero"); }).starts_with("/dev/zero: not a file"));
}

TEST_F(TrajectoryFile, AFileBeyondTheSizeLimitIsRefusedBeforeItIsRead) {
  const auto file = folder_ / "huge.csv";
  std::ofstream(file) << kHeader;
  std::filesystem::resize_file(file, kMaxTrajectoryBytes + 1);  // sparse
  EXPECT_NE(error_of([&] { load_trajectory(file); }).find("larger than 1100 MiB"), std::string::npos);
}

TEST(TrajectoryCsv, ReadsQuaternionsInEitherOrderOfTheirNames) {
  // A quarter turn about z: x of the needle along y of the world.
  const std::string w_first = "t_s,x,y,z,qw,qx,qy,qz\n0,7,8,9,0.70710678118654757,0,0,0.70710678118654757\n";
  const std::string w_last =
      "t_s, x, y, z, qx, qy, qz, qw, button\n0,7,8,9,0,0,0.70710678118654757,0.70710678118654757,1\n";
  for (const std::string& text : {w_first, w_last}) {
    const Trajectory trajectory = parse_trajectory(text, "t.csv");
    ASSERT_EQ(trajectory.samples().size(), 1u);
    const RigidTransform& X_WN = trajectory.samples().front().X_WN;
    EXPECT_LT((X_WN.R.col(0) - Vec3::UnitY()).norm(), 1e-12);
    EXPECT_LT((X_WN.R.col(1) + Vec3::UnitX()).norm(), 1e-12);
    EXPECT_LT((X_WN.p - Vec3(7, 8, 9)).norm(), 1e-12);
  }
  EXPECT_TRUE(parse_trajectory(w_last, "t.csv").samples().front().button);
  expect_error("t_s,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,1,0,0\n", "t.csv:2: the quaternion's length is 1.41421");
  expect_error("t_s,x,y,z,qw,qx,qy\n0,0,0,0,1,1,0\n", "t.csv:1: expected the header t_s,m00");
}

}  // namespace
}  // namespace brachy
