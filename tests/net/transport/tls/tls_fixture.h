#pragma once

#include <boost/asio/ssl/context.hpp>

#include "tests/net/http/http_testing.h"
#include "tests/net/transport/tls/certificates.h"

namespace brachy::net::test {

/// The HTTP fixture with TLS, and what its clients need.
struct TlsFixture : HttpFixture {
  TlsContext server_context(const std::filesystem::path& client_ca = {}) {
    return make_server_context({identity.certificate, identity.key, client_ca}, [](const std::string&) {});
  }
  TlsContext client_context() const { return make_client_context({ca.certificate(), {}, {}}); }
  /// A client context that trusts any certificate, and accepts old versions too.
  static TlsContext careless_context() {
    auto context = std::make_shared<boost::asio::ssl::context>(boost::asio::ssl::context::tls_client);
    SSL_CTX_set_security_level(context->native_handle(), 0);
    SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_VERSION);
    return context;
  }

  std::unique_ptr<Recorder> join_over_tls(TlsContext context, ClientOptions options = {},
                                          const std::string& host = "127.0.0.1") {
    options.tls = std::move(context);
    auto recorder = std::make_unique<Recorder>(io, on_clock(options));
    recorder->client.connect(host, server->port());
    EXPECT_TRUE(until([&] { return recorder->welcomes == 1 || !recorder->closed.empty(); }));
    return recorder;
  }

  TemporaryFolder folder;
  TestCa ca{folder.path()};
  Identity identity = ca.issue("server");
};

}  // namespace brachy::net::test
