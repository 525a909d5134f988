#include "apps/daemon/session_recorder.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace brachy {

SessionRecorder::SessionRecorder(EventLoop& loop, net::Server& server, std::function<void()> name_thread,
                                 Log on_failure)
    : loop_(loop), server_(server), on_failure_(std::move(on_failure)) {
  worker_.post(std::move(name_thread));
}

void SessionRecorder::begin(const SessionFolder& folder, double start_s) {
  long long ms = std::llround(1e3 * start_s);
  const auto name = [&] { return fmt::format("{}{}.brachy", kSessionRecording.name, ms); };
  while (folder.has(name())) ++ms;  // of an earlier run that ended at once
  file_.emplace(folder.create(name()), folder.path_of(name()).string());
  viewer_ = std::make_shared<net::InProcessViewer>(
      loop_.clock(), "the session's recording",
      net::kSubscribeSurface | net::kSubscribeScene | net::kSubscribePlan,
      [this](std::function<void()> f) { loop_.post(std::move(f)); },
      [this](net::Bytes header, std::shared_ptr<const net::Bytes> body) {
        write(std::move(header), std::move(body));
      },
      [this] { fail("the disk is too slow"); });
  server_.adopt_own(viewer_);
}

void SessionRecorder::stop() {
  if (const auto viewer = std::exchange(viewer_, nullptr)) viewer->leave();
}

void SessionRecorder::write(net::Bytes header, std::shared_ptr<const net::Bytes> body) {
  worker_.post([this, viewer = viewer_, header = std::move(header), body = std::move(body)] {
    loop_.post([this, viewer, why = add(header, *body)] { why.empty() ? viewer->done() : fail(why); });
  });
}

/// On the worker. Returns why it cannot be written; empty: it is.
std::string SessionRecorder::add(const net::Bytes& header, const net::Bytes& body) {
  try {
    net::Header decoded;
    net::decode_header(header, RecordingReader::kMaxBodyBytes, decoded);
    if (file_->bytes() + kRecordedOverhead + body.size() > kSessionRecording.most_bytes)
      return fmt::format("it has {} MB", kSessionRecording.most_bytes / kMegabyte);
    file_->add(decoded, body);
  } catch (const std::exception& e) {
    return e.what();
  }
  return {};
}

void SessionRecorder::fail(const std::string& why) {
  if (!viewer_) return;
  stop();
  on_failure_("the recording for the debrief ends here: " + why);
}

}  // namespace brachy
