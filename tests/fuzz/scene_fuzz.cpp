// A scene file.
#include "core/scene/file/scene_file.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of(std::as_bytes(std::span(data, size)));
  // The message has a line number, because the defaults do not contradict each other.
  reads("scene.toml:", [&] {
    const Scene scene = parse_scene(text, "scene.toml");
    EXPECT_TRUE(scene.rates.deformation_hz >= 1 && scene.rates.deformation_hz <= 1000);
    EXPECT_TRUE(scene.needle.count >= 1 && scene.needle.count <= NeedleSettings::kMaxCount);
    EXPECT_TRUE(scene.server.port >= 0 && scene.server.port <= 65535);
  });
  return 0;
}

}  // namespace brachy::fuzz
