#include "apps/recording/recording_file.h"

#include <sys/resource.h>

#include <csignal>
#include <sstream>

#include "apps/recording/read_recording.h"
#include "core/base/error.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/recording/sample_recording.h"
#include "tests/net/wire/golden_blocks.h"

namespace brachy {
namespace {

using namespace test;

SampleMessages some_messages() {
  SampleMessages messages;
  messages.add(messages.frame(1, {1}));
  messages.add(net::EventMessage{net::EventKind::kPuncture, 0, 1, "capsule punctured"});
  messages.add(messages.frame(2, {2}));
  return messages;
}

std::string written(const SampleMessages& messages) {
  const TempFolder folder;
  messages.write(folder / "r.brachy");
  return read_file(folder / "r.brachy");
}

/// What a reader finds in a file's bytes: the messages' sizes, and where damage begins.
struct Read {
  explicit Read(const std::string& bytes) {
    std::istringstream stream(bytes);
    RecordingReader reader(stream, "r");
    RecordingReader::Message message;
    while (reader.next(message)) {
      EXPECT_EQ(message.offset, ends.empty() ? kRecordingMagic.size() : ends.back());
      ends.push_back(reader.offset());
      types.push_back(message.header.type);
      bodies.emplace_back(message.body.begin(), message.body.end());
    }
    damage = reader.damage();
    EXPECT_FALSE(reader.next(message));
  }
  std::vector<std::uint64_t> ends;
  std::vector<net::MessageType> types;
  std::vector<net::Bytes> bodies;
  std::string damage;
};

std::string refusal_of(const std::string& bytes) {
  try {
    const Read read(bytes);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(RecordingFile, IsWhatTheDocumentSays) {
  const TempFolder folder;
  const net::Bytes golden = net::test::golden_blocks().at("RECORDING");
  net::Bytes body;
  net::encode_body(net::EventMessage{net::EventKind::kPuncture, 0, 42, "capsule punctured"}, body);
  {
    RecordingWriter writer(folder / "r.brachy");
    writer.add({net::kProtocolVersion, net::MessageType::kEvent, 0, static_cast<std::uint32_t>(body.size()),
                5, 2'000'000'005},
               body);
    EXPECT_EQ(writer.bytes(), golden.size());
  }
  const std::string bytes = read_file(folder / "r.brachy");
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(bytes)), golden));
  EXPECT_TRUE(is_recording_file(folder / "r.brachy"));
}

TEST(RecordingFile, GivesEveryMessageBack) {
  const SampleMessages messages = some_messages();
  const Read read(written(messages));
  EXPECT_EQ(read.damage, "");
  ASSERT_EQ(read.bodies.size(), messages.all().size());
  for (std::size_t i = 0; i < read.bodies.size(); ++i) {
    EXPECT_EQ(read.bodies[i], messages.all()[i].body);
    EXPECT_EQ(read.types[i], messages.all()[i].header.type);
  }
}

TEST(RecordingFile, IsInTheFileAsSoonAsItIsAdded) {
  const TempFolder folder;
  const SampleMessages messages = some_messages();
  RecordingWriter writer(folder / "r.brachy");
  for (std::size_t i = 0; i < messages.all().size(); ++i) {
    writer.add(messages.all()[i].header, messages.all()[i].body);
    EXPECT_EQ(Read(read_file(folder / "r.brachy")).bodies.size(), i + 1);
  }
}

TEST(RecordingFile, CutOffAnywhereItIsGoodUpToThere) {
  const std::string whole = written(some_messages());
  const Read all(whole);
  for (std::size_t size = kRecordingMagic.size(); size < whole.size(); ++size) {
    const Read read(whole.substr(0, size));
    const auto left = static_cast<std::size_t>(
        std::ranges::count_if(all.ends, [&](std::uint64_t end) { return end <= size; }));
    ASSERT_EQ(read.bodies.size(), left) << size;
    const std::uint64_t good = left == 0 ? kRecordingMagic.size() : all.ends[left - 1];
    if (good == size)
      ASSERT_EQ(read.damage, "");
    else
      ASSERT_EQ(read.damage,
                "from byte " + std::to_string(good) + " on it is damaged: the file ends within a message");
  }
}

TEST(RecordingFile, AWrongBitAnywhereIsFound) {
  const std::string whole = written(some_messages());
  const Read all(whole);
  for (std::size_t i = kRecordingMagic.size(); i < whole.size(); ++i) {
    std::string bytes = whole;
    bytes[i] = static_cast<char>(bytes[i] ^ (1 << (i % 8)));
    const Read read(bytes);
    const auto before = static_cast<std::size_t>(
        std::ranges::count_if(all.ends, [&](std::uint64_t end) { return end <= i; }));
    ASSERT_EQ(read.bodies.size(), before) << i;
    const std::uint64_t good = before == 0 ? kRecordingMagic.size() : all.ends[before - 1];
    ASSERT_TRUE(read.damage.starts_with("from byte " + std::to_string(good) + " on "))
        << i << ": " << read.damage;
  }
}

TEST(RecordingFile, ALengthIsNotBelieved) {
  for (const std::uint32_t length : {0xFFFFFFFFu, RecordingReader::kMaxBodyBytes, 5'000'000u}) {
    net::Bytes header;
    net::encode_header({net::kProtocolVersion, net::MessageType::kFrame, 0, length, 1, 0}, header);
    std::string bytes(kRecordingMagic);
    for (const std::byte b : header) bytes += static_cast<char>(b);
    const Read read(bytes + "some more");
    EXPECT_TRUE(read.bodies.empty());
    EXPECT_TRUE(read.damage.starts_with("from byte 8 on ")) << read.damage;
  }
}

TEST(RecordingFile, WhatIsNoneIsRefusedByName) {
  EXPECT_EQ(refusal_of("t_s,m00,m01"),
            "r: not a recording: it does not begin with BRCYREC1; give a file that `brachy record --out "
            "FILE.brachy` made");
  EXPECT_NE(refusal_of(""), "");
  EXPECT_NE(refusal_of("BRCYRE"), "");
  EXPECT_EQ(refusal_of("BRCYREC2 and more"),
            "r: a recording of another version (REC2); this program reads REC1, use a newer one");
  const TempFolder folder;
  EXPECT_THROW(RecordingReader(folder / "none.brachy"), UserError);
  EXPECT_THROW(RecordingReader(folder / "."), UserError);
  EXPECT_FALSE(is_recording_file(folder / "none.brachy"));
  EXPECT_FALSE(is_recording_file(folder / "."));
  EXPECT_FALSE(is_recording_file(folder.write("short", "BRC")));
}

TEST(RecordingFile, IsNeverOverwritten) {
  const TempFolder folder;
  folder.write("mine.brachy", "mine");
  EXPECT_THROW(RecordingWriter(folder / "mine.brachy"), UserError);
  EXPECT_THROW(RecordingWriter(folder / "no folder/r.brachy"), UserError);
  EXPECT_EQ(read_file(folder / "mine.brachy"), "mine");
}

// RLIMIT_FSIZE ends within the fourth message.
TEST(RecordingFile, OnAFullDiskItEndsWithAWholeMessage) {
  const TempFolder folder;
  const SampleMessages messages = some_messages();
  const std::uint64_t space = Read(written(messages)).ends[2] + 20;
  RecordingWriter writer(folder / "r.brachy");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = space;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::size_t added = 0;
  std::string failure;
  try {
    for (; added < messages.all().size(); ++added)
      writer.add(messages.all()[added].header, messages.all()[added].body);
  } catch (const std::runtime_error& error) {
    failure = error.what();
  }
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_EQ(added, 3u);
  EXPECT_NE(failure.find("r.brachy: cannot be written any more: "), std::string::npos) << failure;
  const Read read(read_file(folder / "r.brachy"));
  EXPECT_EQ(read.bodies.size(), 3u);
  EXPECT_EQ(read.damage, "");
}

/// The result of read_recording for intact messages.
std::string reading(const SampleMessages& messages, std::uint64_t* frames = nullptr) {
  std::istringstream stream(written(messages));
  RecordingReader reader(stream, "r");
  net::ServerMessages mesh({});
  try {
    read_recording(reader, mesh);
  } catch (const UserError& error) {
    return error.what();
  }
  if (frames) *frames = mesh.frames();
  return reader.damage();
}

TEST(ReadRecording, SkipsWhatItDoesNotKnow) {
  SampleMessages messages = some_messages();
  messages.add({net::kProtocolVersion, static_cast<net::MessageType>(999), 0, 3, 77, 0}, net::Bytes(3));
  messages.add(messages.frame(3, {}));
  std::uint64_t frames = 0;
  EXPECT_EQ(reading(messages, &frames), "");
  EXPECT_EQ(frames, 3u);
}

TEST(ReadRecording, RefusesWhatNoServerSays) {
  SampleMessages messages;
  net::FrameMessage other = messages.frame(1, {});
  other.topology_hash ^= 1;
  messages.add(other);
  EXPECT_NE(
      reading(messages).find("is intact, but no server sends it: the frame belongs to another topology"),
      std::string::npos);
  SampleMessages late;
  net::Bytes body;
  const TempFolder folder;
  {
    RecordingWriter writer(folder / "r.brachy");
    writer.add(late.all()[1].header, late.all()[1].body);
  }
  RecordingReader reader(folder / "r.brachy");
  net::ServerMessages mesh({});
  EXPECT_THROW(read_recording(reader, mesh), UserError);
}

TEST(RunStarts, AreToldByTicksThatGoBackOrByTheEvent) {
  SampleMessages messages;
  const auto frame = [&](std::uint64_t tick) { return messages.frame(tick, {}); };
  const net::EventMessage reset{net::EventKind::kReset, 0, 0, "reset"};
  RunStarts frame_first;
  EXPECT_FALSE(frame_first.is_first_of_a_run(frame(5)));
  EXPECT_FALSE(frame_first.is_first_of_a_run(frame(9)));
  EXPECT_TRUE(frame_first.is_first_of_a_run(frame(2)));
  frame_first.add(reset);
  EXPECT_FALSE(frame_first.is_first_of_a_run(frame(3)));
  // The first frame after it came when its ticks were past the old ones'.
  RunStarts event_first;
  EXPECT_FALSE(event_first.is_first_of_a_run(frame(5)));
  event_first.add(reset);
  net::FrameMessage on_its_way = frame(6);
  on_its_way.full = false;
  EXPECT_FALSE(event_first.is_first_of_a_run(on_its_way));
  EXPECT_TRUE(event_first.is_first_of_a_run(frame(9)));
  EXPECT_FALSE(event_first.is_first_of_a_run(frame(10)));
}

}  // namespace
}  // namespace brachy
