#include "apps/brachy/tools.h"

#include <iostream>

#include "net/access/token_file.h"

namespace brachy {

int token(const TokenOptions& options) {
  if (options.show) {
    std::cout << net::to_hex(net::load_token(options.file)) << "\n";
    return kExitOk;
  }
  net::make_token(options.file);
  std::cout
      << "token: " << options.file.string()
      << ", for you alone; name it under [server] of the daemon's scene, and to tools with --token-file\n";
  return kExitOk;
}

}  // namespace brachy
