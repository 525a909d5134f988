#include "apps/recording/recorded_scanner.h"

#include "apps/recording/read_recording.h"

namespace brachy {

std::vector<net::ScannerMessage> load_recorded_scanner(const std::filesystem::path& file) {
  std::vector<net::ScannerMessage> settings;
  net::MessageHandlers handlers;
  handlers.on_scanner = [&](const net::ScannerMessage& scanner) { settings.push_back(scanner); };
  RecordingReader reader(file);
  net::ServerMessages messages(handlers);
  read_recording(reader, messages);
  return settings;
}

}  // namespace brachy
