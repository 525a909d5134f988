#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "apps/daemon/io/event_loop.h"
#include "net/http/dynamic_pages.h"

namespace brachy {

/// The teacher's pages, of the attempts below a directory (--sessions): the class as `brachy score --class` writes it,
/// a list of the sessions, and of each the files that a debrief needs. All for operators. What takes long is read on a
/// thread of its own: until it is there the answer is 202, ask again.
/// Threads: the io thread.
class SessionPages {
 public:
  /// `loop` outlives this. `name_thread` is the thread's first work.
  SessionPages(EventLoop& loop, std::filesystem::path sessions, std::function<void()> name_thread);

  /// /class.html, /class.csv, /sessions and /sessions/SESSION/FILE (net/PROTOCOL.md).
  net::DynamicPages pages();

  bool is_busy() const { return is_reading_; }  ///< the destructor waits for what is read
  void stop();                                  ///< nothing more is started

 private:
  using Content = net::DynamicPage::Content;
  struct Class {
    Content page, table, list;
  };
  /// What was read last, and when.
  template <class T>
  struct Read {
    std::string of;
    T content;
    std::int64_t at_ns = 0;
  };

  Content of_class(Content Class::*part);
  Content file(std::string_view rest);
  template <class T, class Make>
  void read(std::optional<Read<T>> SessionPages::*into, std::string of, Make make);
  template <class T>
  bool is_good(const std::optional<Read<T>>& read) const;
  static Class read_class(const std::filesystem::path& sessions);
  static Content read_file(const std::filesystem::path& sessions, const std::string& rest);

  EventLoop& loop_;
  const std::filesystem::path sessions_;
  std::optional<Read<Class>> class_;
  std::optional<Read<Content>> file_;  // until it is fetched, once
  bool is_reading_ = false, is_stopped_ = false;
  Worker worker_;
};

}  // namespace brachy
