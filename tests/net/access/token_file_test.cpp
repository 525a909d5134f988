#include "net/access/token_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

#include "core/base/error.h"
#include "tests/net/http/http_testing.h"

namespace brachy::net::test {
namespace {

struct TokenFileTest : ::testing::Test {
  /// What is wrong with it; "" where it is good.
  std::string refusal(const std::filesystem::path& file) {
    try {
      load_token(file);
      return "";
    } catch (const UserError& e) {
      const std::string text = e.what();
      EXPECT_TRUE(text.starts_with(file.string() + ": ")) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos);
      return text;
    }
  }
  std::filesystem::path written(const std::string& name, const std::string& content, mode_t mode = 0600) {
    folder.write(name, content);
    EXPECT_EQ(::chmod((folder.path() / name).c_str(), mode), 0);
    return folder.path() / name;
  }

  /// 32 bytes, of which no two are equal.
  static std::string some_token() {
    std::string bytes;
    for (int i = 0; i < 32; ++i) bytes += static_cast<char>(i * 8);
    return bytes;
  }

  TemporaryFolder folder;
};

TEST_F(TokenFileTest, IsMadeOfRandomBytesForItsOwnerAlone) {
  std::set<Token> tokens;
  for (const char* name : {"a", "b", "c"}) {
    const auto file = folder.path() / name;
    make_token(file);
    struct stat about {};
    ASSERT_EQ(::stat(file.c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777u, 0600u);
    EXPECT_EQ(about.st_size, 32);
    tokens.insert(load_token(file));
  }
  EXPECT_EQ(tokens.size(), 3u);
}

TEST_F(TokenFileTest, NothingIsOverwritten) {
  const auto file = written("old", some_token());
  EXPECT_THROW(make_token(file), UserError);
  EXPECT_EQ(to_hex(load_token(file)).substr(0, 6), "000810");
  EXPECT_THROW(make_token(folder.path() / "none" / "token"), UserError);
}

TEST_F(TokenFileTest, IsReadAsItIs) {
  const Token token = load_token(written("t", some_token(), 0400));
  EXPECT_EQ(to_hex(token), "0008101820283038404850586068707880889098a0a8b0b8c0c8d0d8e0e8f0f8");
}

TEST_F(TokenFileTest, IsRefusedWithTheFix) {
  const std::string good = some_token();
  EXPECT_NE(refusal(folder.path() / "none").find("brachy token"), std::string::npos);
  for (const mode_t mode : {0604, 0640, 0610, 0666})
    EXPECT_NE(refusal(written("open", good, mode)).find("chmod 600"), std::string::npos) << mode;
  EXPECT_NE(refusal(written("short", good.substr(1))).find("32 bytes"), std::string::npos);
  EXPECT_NE(refusal(written("long", good + "\n")).find("32 bytes"), std::string::npos);
  EXPECT_NE(refusal(folder.path()).find("not a regular file"), std::string::npos);
  const auto pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(refusal(pipe).find("not a regular file"), std::string::npos);
  EXPECT_EQ(refusal(written("open", good)), "");
}

TEST_F(TokenFileTest, IsRefusedWhereItCanBeGuessed) {
  std::string few;  // 11 values
  for (int i = 0; i < 32; ++i) few += static_cast<char>('a' + i % 11);
  for (const std::string& guessable :
       {std::string(32, '\0'), std::string(32, 'x'), few, std::string("password") + std::string(24, '\n')})
    EXPECT_NE(refusal(written("guessable", guessable)).find("hardly random; make one with: brachy token"),
              std::string::npos);
  few.back() = 'z';
  EXPECT_EQ(refusal(written("enough", few)), "");
}

TEST_F(TokenFileTest, OfAnotherUserIsRefused) {
  const auto file = written("theirs", std::string(32, 'x'));
  if (::chown(file.c_str(), 12345, static_cast<gid_t>(-1)) != 0) GTEST_SKIP() << "only root gives files away";
  EXPECT_NE(refusal(file).find("another user"), std::string::npos);
}

TEST_F(TokenFileTest, ARefusalShowsNothingOfIt) {
  const std::string secret = "SECRET-SECRET-SECRET-SECRET-SECR";
  for (const auto& file : {written("s1", secret, 0644), written("s2", secret + "ET")})
    EXPECT_EQ(refusal(file).find("SECRET"), std::string::npos);
}

TEST_F(TokenFileTest, ItsDigitsReadBackAndNothingElseDoes) {
  const Token token =
      load_token(written("t", std::string("0123456789abcdef-ABCDEFGHIJ+/?!").append(1, '\0')));
  const std::string hex = to_hex(token);
  EXPECT_EQ(from_hex(hex), token);
  for (const std::string& bad : {std::string(), hex.substr(1), hex + "0", "+" + hex.substr(1),
                                 " " + hex.substr(1), "g" + hex.substr(1), hex.substr(0, 63) + "x"})
    EXPECT_EQ(from_hex(bad), std::nullopt) << bad;
}

}  // namespace
}  // namespace brachy::net::test
