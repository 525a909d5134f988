#include "net/http/served_files.h"

#include "tests/net/http/http_testing.h"

namespace brachy::net::test {
namespace {

TEST(ServedFiles, WithoutAViewerAPageSaysHowToBuildIt) {
  const ServedFiles none;
  EXPECT_FALSE(none.has_viewer());
  const ServedFile* page = none.find("/", true);
  ASSERT_TRUE(page);
  EXPECT_NE(page->content.find("./scripts/build.sh"), std::string::npos);
  EXPECT_EQ(page->content_type, "text/html; charset=utf-8");
  const TemporaryFolder empty;
  EXPECT_EQ(ServedFiles(empty.path()).find("/", false)->content, page->content);
}

TEST(ServedFiles, TheFolderIsServedByNameAndPackedToWhoTakesIt) {
  const TemporaryFolder folder;
  folder.write("index.html", "<p>viewer");
  folder.write("index.html.gz", "packed");
  folder.write("x.js", "1");
  const ServedFiles files(folder.path());
  EXPECT_TRUE(files.has_viewer());
  EXPECT_EQ(files.find("/", false)->content, "<p>viewer");
  EXPECT_EQ(files.find("/index.html?replay", false)->content, "<p>viewer");
  EXPECT_EQ(files.find("/?x=1", true)->content, "packed");
  EXPECT_EQ(files.find("/", true)->encoding, "gzip");
  EXPECT_EQ(files.find("/", true)->content_type, "text/html; charset=utf-8");
  EXPECT_NE(files.find("/", true)->etag, files.find("/", false)->etag);
  EXPECT_EQ(files.find("/x.js", true)->content, "1");
  EXPECT_EQ(files.find("/x.js", true)->encoding, "");
  EXPECT_EQ(files.find("/x.js", true)->content_type, "text/javascript; charset=utf-8");
}

TEST(ServedFiles, NothingElseIsServed) {
  const TemporaryFolder folder;
  folder.write("index.html", "<p>viewer");
  folder.write("secret.key", "s");
  folder.write("only.txt.gz", "packed");
  std::filesystem::create_directory(folder.path() / "sub");
  folder.write("sub/a.txt", "a");
  const ServedFiles files(folder.path());
  for (const auto* target : {"/secret.key", "/sub/a.txt", "/sub", "/../index.html", "//index.html",
                             "/./index.html", "/..", "/%2e%2e/index.html", "/index.html/", "/index.html%00",
                             "index.html", "", "*", "/only.txt", "/etc/passwd", "/only.txt.gz"})
    EXPECT_FALSE(files.find(target, false)) << target;
}

TEST(ServedFiles, ATagIsOfTheContent) {
  const TemporaryFolder folder;
  folder.write("index.html", "one");
  const std::string first = ServedFiles(folder.path()).find("/", false)->etag;
  EXPECT_EQ(ServedFiles(folder.path()).find("/", false)->etag, first);
  folder.write("index.html", "two");
  EXPECT_NE(ServedFiles(folder.path()).find("/", false)->etag, first);
}

TEST(AcceptEncoding, GzipIsTakenWhereItIsNotRefused) {
  for (const auto* header :
       {"gzip", "gzip, deflate, br", "deflate, gzip;q=0.5", "br , gzip ; q=1.0", "*", "x-gzip"})
    EXPECT_TRUE(takes_gzip(header)) << header;
  for (const auto* header :
       {"", "identity", "deflate, br", "gzip;q=0", "gzip;q=0.000", "gzipped", "br;q=1, gzip ;q=0, *"})
    EXPECT_FALSE(takes_gzip(header)) << header;
}

}  // namespace
}  // namespace brachy::net::test
