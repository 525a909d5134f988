#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace brachy::net {

/// One body as sent.
struct ServedFile {
  std::string content_type;
  std::string encoding;  ///< Content-Encoding: "gzip", or "" for none
  std::string etag;      ///< with its quotes
  std::string content;
};

/// The files of one folder, read once into memory: no other file can be requested by any path. Immutable.
class ServedFiles {
 public:
  /// Only a page at "/" that says how to build the viewer.
  ServedFiles();
  /// The regular files directly in `folder`, of the types a viewer needs (html, js, css, svg, png, ico, json, wasm);
  /// NAME.gz beside NAME is sent to clients that accept gzip. Without index.html as above. Throws UserError: a file
  /// cannot be read.
  explicit ServedFiles(const std::filesystem::path& folder);

  bool has_viewer() const { return has_viewer_; }

  /// The file at the path of a request target ("/", "/index.html", "/x.js?query"); null: not found.
  const ServedFile* find(std::string_view target, bool takes_gzip) const;

 private:
  void add(const std::string& name, const std::string& encoding, std::string content);

  std::map<std::string, ServedFile, std::less<>> plain_, gzip_;  // by name
  bool has_viewer_ = false;
};

/// Whether an Accept-Encoding header accepts gzip (RFC 9110, 12.5.3).
bool takes_gzip(std::string_view accept_encoding);

}  // namespace brachy::net
