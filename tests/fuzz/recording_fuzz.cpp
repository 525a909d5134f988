// A recording: a script of messages, each with the correct CRC unless the script sets another. It is summarised and
// replayed as far as it is valid.
#include <boost/crc.hpp>
#include <sstream>

#include "apps/recording/recorded_motion.h"
#include "apps/recording/recording_tally.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/fuzz/message_script.h"

namespace brachy::fuzz {
namespace {

std::string recording_of(Script& script) {
  net::Bytes file;
  for (const char c : kRecordingMagic) file.push_back(static_cast<std::byte>(c));
  for (ServerScript server(script); !script.is_over();) {
    const bool is_cut = script.u8() == 255;
    net::Bytes message = server.next();
    boost::crc_32_type crc;
    crc.process_bytes(message.data(), message.size());
    net::ByteWriter(message).u32(crc.checksum());
    if (is_cut) message.pop_back();
    file.insert(file.end(), message.begin(), message.end());
  }
  return text_of(file);
}

void sum_up(const std::string& file) {
  std::istringstream stream(file);
  RecordingReader reader(stream, "recording");
  RecordingTally tally;
  net::ServerMessages messages(tally.handlers());
  std::uint64_t offset = reader.offset();
  const bool is_read = reads("recording: ", [&] {
    read_recording(reader, messages, [&] {
      EXPECT_GT(reader.offset(), offset);
      offset = reader.offset();
    });
  });
  EXPECT_LE(reader.offset(), file.size());
  if (is_read) EXPECT_EQ(reader.damage().empty(), reader.offset() == file.size()) << reader.damage();
  EXPECT_FALSE(tally.to_text(file.size(), reader.damage()).empty());
  EXPECT_FALSE(tally.to_json(file.size(), reader.damage()).empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const std::string content = recording_of(script);
  sum_up(content);
  const test::TempFile file("r.brachy", content);
  for (const auto model : {ReplayedModel::kDaemons, ReplayedModel::kRecorded})
    reads(file.path().string(), [&] {
      const RecordedMotion motion = load_recorded_motion(file.path(), model, 3);
      EXPECT_GE(motion.trajectories.duration_s(), 0);
    });
  return 0;
}

}  // namespace brachy::fuzz
