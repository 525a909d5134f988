#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/daemon/io/event_loop.h"
#include "apps/recording/recording_file.h"
#include "apps/session/session_folder.h"
#include "net/broker/in_process_viewer.h"
#include "net/server/server.h"

namespace brachy {

/// Records what a viewer of the surface is sent into a session's directory, for the debrief (apps/viewer): a recording
/// named recording_MS.brachy, MS being the session time of its begin in ms. It ends with the run, or when it has
/// kSessionRecording.most_bytes, or cannot be written; the session goes on without it.
/// Threads: the io thread; the file is written on a thread of its own.
class SessionRecorder {
 public:
  using Log = std::function<void(const std::string&)>;

  /// `loop` and `server` outlive this. `name_thread` is the thread's first work. `on_failure` gets the reason, once.
  SessionRecorder(EventLoop& loop, net::Server& server, std::function<void()> name_thread, Log on_failure);

  /// Creates the file, and joins the server. `start_s`: session time of tick 0. Throws UserError.
  void begin(const SessionFolder& folder, double start_s);
  void stop();  ///< leaves the server; nothing more is recorded

 private:
  void write(net::Bytes header, std::shared_ptr<const net::Bytes> body);
  std::string add(const net::Bytes& header, const net::Bytes& body);
  void fail(const std::string& why);

  EventLoop& loop_;
  net::Server& server_;
  const Log on_failure_;
  std::shared_ptr<net::InProcessViewer> viewer_;  // null: not recording
  std::optional<RecordingWriter> file_;           // the worker's, from begin() on
  Worker worker_;
};

}  // namespace brachy
