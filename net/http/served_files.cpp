#include "net/http/served_files.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <utility>

#include "core/base/error.h"

namespace brachy::net {
namespace {

constexpr std::string_view kNotBuilt = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>brachyd: the viewer is not built</title>
<style>body{font:16px/1.5 sans-serif;max-width:42em;margin:3em auto;padding:0 1em}
code{background:#eee;padding:.1em .3em}</style>
</head><body><h1>brachyd runs, its viewer is not built</h1>
<p>Building it needs npm. In brachyd's source folder:</p>
<p><code>apt-get install nodejs npm</code> (as root), then <code>./scripts/build.sh</code>, and start brachyd again.</p>
<p>Without it: <code>brachy watch --connect HOST:PORT</code> with the address that brachyd printed first.</p>
</body></html>
)";

/// "" = not a kind that is served.
std::string_view content_type_of(std::string_view extension) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".json", "application/json"},
      {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
  }};
  for (const auto& [known, type] : kTypes)
    if (extension == known) return type;
  return "";
}

/// FNV-1a, 64 bit: the same content has the same tag in every run.
std::string etag_of(std::string_view content, std::string_view encoding) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  std::array<char, 16> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), hash, 16).ptr;
  std::string tag = "\"";
  tag.append(digits.data(), end);
  if (!encoding.empty()) tag.append("-").append(encoding);
  return tag.append("\"");
}

std::string read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in) throw UserError(path.string() + ": cannot be read, and is part of the viewer that brachyd serves");
  return content;
}

}  // namespace

ServedFiles::ServedFiles() {
  add("index.html", "", std::string(kNotBuilt));
}

ServedFiles::ServedFiles(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const bool is_gzip = entry.path().extension() == ".gz";
    const std::string name = is_gzip ? entry.path().stem().string() : entry.path().filename().string();
    if (!content_type_of(std::filesystem::path(name).extension().string()).empty())
      add(name, is_gzip ? "gzip" : "", read(entry.path()));
  }
  has_viewer_ = plain_.contains("index.html");
  if (!has_viewer_) add("index.html", "", std::string(kNotBuilt)), gzip_.clear();
}

void ServedFiles::add(const std::string& name, const std::string& encoding, std::string content) {
  ServedFile file;
  file.content_type = content_type_of(std::filesystem::path(name).extension().string());
  file.encoding = encoding;
  file.etag = etag_of(content, encoding);
  file.content = std::move(content);
  (encoding.empty() ? plain_ : gzip_).insert_or_assign(name, std::move(file));
}

const ServedFile* ServedFiles::find(std::string_view target, bool takes_gzip) const {
  if (!target.starts_with('/')) return nullptr;
  target = target.substr(1, target.find('?') - 1);
  if (target.empty()) target = "index.html";
  if (takes_gzip)
    if (const auto found = gzip_.find(target); found != gzip_.end()) return &found->second;
  const auto found = plain_.find(target);
  return found == plain_.end() ? nullptr : &found->second;
}

bool takes_gzip(std::string_view accept_encoding) {
  const auto trimmed = [](std::string_view s) {
    const std::size_t first = s.find_first_not_of(" \t");
    return first == std::string_view::npos ? std::string_view()
                                           : s.substr(first, s.find_last_not_of(" \t") + 1 - first);
  };
  while (!accept_encoding.empty()) {
    const std::size_t comma = accept_encoding.find(',');
    const std::string_view item = accept_encoding.substr(0, comma);
    accept_encoding =
        comma == std::string_view::npos ? std::string_view() : accept_encoding.substr(comma + 1);
    const std::size_t semicolon = item.find(';');
    const std::string_view coding = trimmed(item.substr(0, semicolon));
    if (coding != "gzip" && coding != "x-gzip" && coding != "*") continue;
    if (semicolon == std::string_view::npos) return true;
    const std::string_view weight = trimmed(item.substr(semicolon + 1));  // q=0, q=0.0: not that one
    return weight.find_first_of("123456789") != std::string_view::npos;
  }
  return false;
}

}  // namespace brachy::net
