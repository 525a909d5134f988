#include "net/broker/nats_link.h"

#include <nats/nats.h>

#include <stdexcept>
#include <utility>

namespace brachy::net {
namespace {

// A connection that breaks silently is detected after this many unanswered PINGs.
constexpr std::int64_t kPingIntervalMs = 2000;
constexpr int kMaxPingsOut = 2;
constexpr int kBufferBytes = 512 * 1024;  // a chunk leaves by one system call

void require(natsStatus status, const char* what) {
  if (status == NATS_OK) return;
  const char* last = nats_GetLastError(nullptr);
  std::string why = last && *last ? last : natsStatus_GetText(status);
  if (const std::size_t end = why.find("): "); why.starts_with("(") && end != std::string::npos)
    why.erase(0, end + 3);  // the position in libnats' source
  throw std::runtime_error(std::string(what) + ": " + why);
}

using Options = std::unique_ptr<natsOptions, decltype(&natsOptions_Destroy)>;

Options make_options(const BrokerOptions& broker) {
  natsOptions* made = nullptr;
  require(natsOptions_Create(&made), "libnats");
  Options options(made, natsOptions_Destroy);
  require(natsOptions_SetURL(made, broker.url.c_str()), "the broker's URL");
  require(natsOptions_SetName(made, broker.client_name.c_str()), "the client's name");
  require(natsOptions_SetAllowReconnect(made, false),
          "libnats");  // reconnecting is ours: it detects gaps, and counts
  require(natsOptions_SetTimeout(made, NatsLink::kConnectTimeout.count()), "libnats");
  require(natsOptions_SetWriteDeadline(made, NatsLink::kWriteTimeout.count()), "libnats");
  require(natsOptions_SetPingInterval(made, kPingIntervalMs), "libnats");
  require(natsOptions_SetMaxPingsOut(made, kMaxPingsOut), "libnats");
  require(natsOptions_SetIOBufSize(made, kBufferBytes), "libnats");
  require(natsOptions_SetSendAsap(made, true), "libnats");  // no thread that wakes up to flush
  if (broker.url.starts_with("tls://") || !broker.tls_ca.empty() || !broker.tls_certificate.empty())
    require(natsOptions_SetSecure(made, true), "TLS");
  if (!broker.tls_ca.empty())
    require(natsOptions_LoadCATrustedCertificates(made, broker.tls_ca.c_str()), broker.tls_ca.c_str());
  if (!broker.tls_certificate.empty())
    require(natsOptions_LoadCertificatesChain(made, broker.tls_certificate.c_str(), broker.tls_key.c_str()),
            broker.tls_certificate.c_str());
  return options;
}

}  // namespace

struct NatsLink::Handles {
  ~Handles() {
    natsSubscription_Destroy(subscription);
    natsConnection_Destroy(connection);
  }
  natsConnection* connection = nullptr;
  natsSubscription* subscription = nullptr;
};

NatsLink::NatsLink(const BrokerOptions& options, const std::string& subject)
    : handles_(std::make_unique<Handles>()) {
  const Options settings = make_options(options);
  require(natsConnection_Connect(&handles_->connection, settings.get()), "not connected");
  require(natsConnection_SubscribeSync(&handles_->subscription, handles_->connection, subject.c_str()),
          "not subscribed");
  require(natsSubscription_SetPendingLimits(handles_->subscription, -1, kMaxPendingBytes), "libnats");
}

NatsLink::~NatsLink() = default;

bool NatsLink::is_up() const {
  return natsConnection_Status(handles_->connection) == NATS_CONN_STATUS_CONNECTED;
}

std::size_t NatsLink::max_payload() const {
  const std::int64_t bytes = natsConnection_GetMaxPayload(handles_->connection);
  return bytes > 0 ? static_cast<std::size_t>(bytes) : 0;
}

bool NatsLink::publish(const std::string& subject, std::span<const std::byte> payload) {
  return natsConnection_Publish(handles_->connection, subject.c_str(), payload.data(),
                                static_cast<int>(payload.size())) == NATS_OK;
}

std::optional<Bytes> NatsLink::next(std::chrono::milliseconds wait) {
  natsMsg* message = nullptr;
  if (natsSubscription_NextMsg(&message, handles_->subscription, wait.count()) != NATS_OK)
    return std::nullopt;
  const std::unique_ptr<natsMsg, decltype(&natsMsg_Destroy)> owner(message, natsMsg_Destroy);
  const auto* data = static_cast<const std::byte*>(static_cast<const void*>(natsMsg_GetData(message)));
  return Bytes(data, data + natsMsg_GetDataLength(message));
}

std::string_view nats_version() {
  return NATS_VERSION_STRING;
}

}  // namespace brachy::net
