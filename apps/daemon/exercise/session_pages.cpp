#include "apps/daemon/exercise/session_pages.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/score/class_table.h"
#include "apps/score/exercise.h"
#include "apps/score/history.h"
#include "apps/session/session_folder.h"
#include "apps/session/session_manifest.h"
#include "core/base/error.h"
#include "core/base/version.h"

namespace brachy {
namespace {

using OrderedJson = nlohmann::ordered_json;
using Content = net::DynamicPage::Content;
namespace fs = std::filesystem;

// A page that asks again sooner gets the same answer. It also bounds what clients can make the daemon read.
constexpr std::chrono::seconds kReadGoodFor{5};
constexpr const char *kPlain = "text/plain; charset=utf-8", *kHtml = "text/html; charset=utf-8";

/// A browser asks again by itself.
const Content kNotYet = {202, kHtml,
                         "<!DOCTYPE html><html lang=\"en\"><head><meta http-equiv=\"refresh\" content=\"1\">"
                         "<title>brachyd</title></head><body><p>The sessions are being read; ask again."
                         "</p></body></html>\n"};

/// Of a path's rest, as browsers encode it; none: it is no such text.
std::optional<std::string> percent_decoded(std::string_view text) {
  std::string decoded;
  while (!text.empty()) {
    unsigned char byte = static_cast<unsigned char>(text.front());
    std::size_t count = 1;
    if (byte == '%') {
      count = 3;
      if (text.size() < count) return std::nullopt;
      const char* const end = text.data() + count;
      if (std::from_chars(text.data() + 1, end, byte, 16).ptr != end) return std::nullopt;
    }
    decoded += static_cast<char>(byte);
    text.remove_prefix(count);
  }
  return decoded;
}

/// What a debrief needs of a session.
bool is_served(const std::string& file) {
  return file == kReportJson || file == kReportPage || file == kHdrReportFile ||
         (file.starts_with(kSessionRecording.name) && file.ends_with(".brachy"));
}

std::string relative_name(const fs::path& session, const fs::path& sessions) {
  return session.lexically_relative(sessions).generic_string();
}

OrderedJson recordings_of(const SessionFolder& folder) {
  std::vector<std::string> names = folder.names(kSessionRecording.name);
  std::ranges::sort(names);
  OrderedJson all = OrderedJson::array();
  for (const std::string& name : names)
    if (is_served(name)) all.push_back({{"file", name}, {"bytes", folder.size_of(name).value_or(0)}});
  return all;
}

/// A session in the list; `row`: of its report, null where it was not scored.
OrderedJson listed(const fs::path& session, const std::string& name, const HistoryRow* row) {
  OrderedJson one = {{"session", name},   {"trainee", ""},       {"task", ""},        {"began", ""},
                     {"passed", nullptr}, {"findings", nullptr}, {"report", nullptr}, {"recordings", {}}};
  try {
    const SessionFolder folder = SessionFolder::open(session);
    one["recordings"] = recordings_of(folder);
    for (const char* report : {kReportJson, kHdrReportFile})
      if (folder.has(report)) one["report"] = report;
    if (const auto manifest = load_manifest(folder)) {
      one["trainee"] = manifest->trainee;
      if (!manifest->runs.empty()) one["began"] = manifest->runs.front().began;
      if (manifest->exercise) one["task"] = exercise_name_in(manifest->exercise->text);
    }
  } catch (const UserError& e) {
    one["why"] = e.what();
  }
  if (!row) return one;
  one["trainee"] = row->trainee;
  one["task"] = row->task;
  if (row->has_passed) one["passed"] = *row->has_passed;
  one["findings"] = row->first_findings;
  return one;
}

}  // namespace

SessionPages::SessionPages(EventLoop& loop, fs::path sessions, std::function<void()> name_thread)
    : loop_(loop), sessions_(std::move(sessions)) {
  worker_.post(std::move(name_thread));
}

net::DynamicPages SessionPages::pages() {
  using enum net::DynamicPage::Access;
  net::DynamicPages pages;
  pages["/class.html"] = {kOperator, [this] { return of_class(&Class::page); }};
  pages["/class.csv"] = {kOperator, [this] { return of_class(&Class::table); }};
  pages["/sessions"] = {kOperator, [this] { return of_class(&Class::list); }};
  pages["/sessions/"] = {kOperator, nullptr, [this](std::string_view rest) { return file(rest); }};
  return pages;
}

void SessionPages::stop() {
  is_stopped_ = true;
  worker_.stop();
}

template <class T>
bool SessionPages::is_good(const std::optional<Read<T>>& read) const {
  return read && loop_.clock().now_ns() - read->at_ns < net::in_ns(kReadGoodFor);
}

template <class T, class Make>
void SessionPages::read(std::optional<Read<T>> SessionPages::*into, std::string of, Make make) {
  if (is_reading_ || is_stopped_) return;
  is_reading_ = true;
  (this->*into).reset();
  worker_.post([this, into, of = std::move(of), make = std::move(make)] {
    loop_.post([this, into, read = Read<T>{of, make(), 0}] {
      this->*into = read;
      (this->*into)->at_ns = loop_.clock().now_ns();
      is_reading_ = false;
    });
  });
}

Content SessionPages::of_class(Content Class::*part) {
  if (is_good(class_)) return class_->content.*part;
  read(&SessionPages::class_, {}, [sessions = sessions_] { return read_class(sessions); });
  return kNotYet;
}

Content SessionPages::file(std::string_view rest) {
  const std::optional<std::string> name = percent_decoded(rest);
  if (!name) return {404, kPlain, "There is no such session.\n"};
  if (is_good(file_) && file_->of == *name) {
    Content content = std::move(file_->content);
    file_.reset();
    return content;
  }
  // Another's file waits to be fetched.
  if (!is_good(file_))
    read(&SessionPages::file_, *name,
         [sessions = sessions_, name = *name] { return read_file(sessions, name); });
  return kNotYet;
}

/// On the worker, as is read_file.
SessionPages::Class SessionPages::read_class(const fs::path& sessions) {
  Class read;
  std::map<fs::path, const HistoryRow*> rows;
  History history;
  try {
    history = load_class(sessions);
    read.page = {200, kHtml, to_html(history, "", version())};
    read.table = {200, "text/csv; charset=utf-8", to_csv(class_table(history))};
  } catch (const std::exception& e) {
    read.page = read.table = {404, kPlain, std::string(e.what()) + "\n"};
  }
  for (const HistoryRow& row : history.rows) rows[row.folder] = &row;
  OrderedJson list = OrderedJson::array();
  try {
    for (const fs::path& session : session_folders(sessions)) {
      const auto row = rows.find(session);
      list.push_back(
          listed(session, relative_name(session, sessions), row == rows.end() ? nullptr : row->second));
    }
  } catch (const std::exception& e) {
    read.list = {404, kPlain, std::string(e.what()) + "\n"};
    return read;
  }
  read.list = {
      200, "application/json",
      OrderedJson{{"sessions", list}}.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + "\n"};
  return read;
}

Content SessionPages::read_file(const fs::path& sessions, const std::string& rest) {
  const std::size_t slash = rest.rfind('/');
  const std::string session = rest.substr(0, slash);
  const std::string file = slash == rest.npos ? std::string() : rest.substr(slash + 1);
  try {
    // By the list: what came never becomes a path.
    const std::vector<fs::path> all = session_folders(sessions);
    const auto found =
        std::ranges::find(all, session, [&](const fs::path& one) { return relative_name(one, sessions); });
    if (found == all.end() || !is_served(file)) return {404, kPlain, "There is no such session or file.\n"};
    std::optional<std::string> text = SessionFolder::open(*found).read(file);
    if (!text) return {404, kPlain, "The session has no " + file + ".\n"};
    const char* const type = file == kReportPage       ? kHtml
                             : file.ends_with(".json") ? "application/json"
                                                       : "application/octet-stream";
    return {200, type, {}, std::make_shared<const std::string>(std::move(*text))};
  } catch (const std::exception& e) {
    return {404, kPlain, std::string(e.what()) + "\n"};
  }
}

}  // namespace brachy
