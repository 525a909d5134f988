// Rows of a text file: buffered, after a kill, and on a full disk.
#include "apps/forces/row_file.h"

#include <sys/resource.h>

#include <csignal>

#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using test::read_file;
using test::TempFolder;

TEST(RowFile, ReachesTheFileWhenItIsFlushedAndGoesOnWithWhatIsThere) {
  const TempFolder folder;
  {
    RowFile rows(folder / "r.csv", RowFile::Start::kAnew, "a,b");
    EXPECT_EQ(read_file(folder / "r.csv"), "");
    rows.flush();
    EXPECT_EQ(read_file(folder / "r.csv"), "a,b\n");
    rows.add("1,2");
  }
  {
    RowFile rows(folder / "r.csv", RowFile::Start::kGoOn, "c,d");
    rows.add("3,4");
    EXPECT_EQ(rows.rows(), 1u);
  }
  EXPECT_EQ(read_file(folder / "r.csv"), "a,b\n1,2\n3,4\n");
  RowFile(folder / "r.csv", RowFile::Start::kAnew, "new").flush();
  EXPECT_EQ(read_file(folder / "r.csv"), "new\n");
  EXPECT_THROW(RowFile(folder / "none/r.csv", RowFile::Start::kAnew, "a,b"), UserError);
}

// RLIMIT_FSIZE ends within a row, at every byte of it.
TEST(RowFile, OnAFullDiskEndsWithAWholeRowAndTakesNoMore) {
  const TempFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  for (const rlim_t space : {15, 16, 20, 24}) {
    RowFile rows(folder / "r.csv", RowFile::Start::kAnew, "head");
    rows.add("1234");
    rows.flush();
    rlimit small = before;
    small.rlim_cur = space;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (const char* row : {"5678", "9abc", "defg"}) rows.add(row);
    EXPECT_FALSE(rows.has_failed());
    rows.flush();
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_TRUE(rows.has_failed());
    EXPECT_NE(rows.failure().find("r.csv: not all rows could be written: File too large"), std::string::npos)
        << rows.failure();
    rows.add("late");
    rows.flush();
    EXPECT_EQ(read_file(folder / "r.csv"), space < 20 ? "head\n1234\n5678\n" : "head\n1234\n5678\n9abc\n")
        << space;
    EXPECT_EQ(rows.rows(), space < 20 ? 2u : 3u);
  }
  std::signal(SIGXFSZ, previous);
}

}  // namespace
}  // namespace brachy
