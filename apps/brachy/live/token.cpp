#include "apps/command_line/tool.h"

#include <iostream>

#include "net/access/token_file.h"

namespace brachy {
namespace {

struct TokenOptions {
  std::filesystem::path file;
  bool show = false;  ///< print the token in the file instead of creating one
};

int run(const TokenOptions& options) {
  if (options.show) {
    std::cout << net::to_hex(net::load_token(options.file)) << "\n";
    return kExitOk;
  }
  net::make_token(options.file);
  std::cout << "token: " << options.file.string()
            << ", readable by you alone; name it under [server] of the daemon's scene, and to tools with "
               "--token-file\n";
  return kExitOk;
}

void declare(OptionList& list, TokenOptions& options) {
  list.add("file", options.file, "file to create; nothing is overwritten").required();
  list.add_flag("--show", options.show, "print the token in the file, as 64 hexadecimal digits");
}

}  // namespace

Tool token_tool() {
  return make_tool<TokenOptions>("token", "Create an access token for a daemon that requires authentication.",
                                 R"(Examples:
  brachy token operator.token                    32 random bytes, readable by you alone
  brachy watch --connect 127.0.0.1:18950 --token-file operator.token
  brachy token --show operator.token             for a browser: http://127.0.0.1:PORT/#token=…
The daemon's scene names the file under [server]: token_file (any role), device_token_file (device, viewer)
or viewer_token_file.
Exit codes: 0 done, 2 the file exists already, or holds no token.)",
                                 declare, run);
}

}  // namespace brachy
