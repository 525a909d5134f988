#include "net/c_api/brachyd_client.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "core/base/version.h"
#include "net/c_api/client_handle.h"

namespace net = brachy::net;
namespace c_api = brachy::net::c_api;

namespace {

int fail(const BrachydClient* client, int status, std::string text) {
  client->error_text = std::move(text);
  return status;
}

// Runs what may throw: no exception passes the library's border.
template <class Function>
int guarded(const BrachydClient* client, const Function& function) noexcept {
  try {
    return client ? function() : kBrachydBadArgument;
  } catch (const std::bad_alloc&) {
    return kBrachydInternal;  // a text would need memory
  } catch (const std::exception& error) {
    try {
      return fail(client, kBrachydInternal, error.what());
    } catch (...) {
      return kBrachydInternal;
    }
  } catch (...) {
    return kBrachydInternal;
  }
}

int ended(const BrachydClient* client) {
  const std::string& reason = client->closed_reason;
  if (client->is_refused) return fail(client, kBrachydRefused, reason);
  return fail(client, kBrachydClosed, reason.empty() ? "there is no connection" : reason);
}

// Writes a value that has come; else nothing.
template <class Value>
int give(const BrachydClient* client, const std::optional<Value>& value, Value* out) {
  return guarded(client, [&] {
    if (!out) return fail(client, kBrachydBadArgument, "the output is NULL");
    if (!value) return fail(client, kBrachydNothing, "it has not come yet");
    *out = *value;
    return static_cast<int>(kBrachydOk);
  });
}

template <class Value>
int give_next(BrachydClient* client, std::deque<Value> BrachydClient::*waiting, Value* out) {
  return guarded(client, [&] {
    if (!out) return fail(client, kBrachydBadArgument, "the output is NULL");
    auto& queue = client->*waiting;
    if (queue.empty()) return fail(client, kBrachydNothing, "none waits");
    *out = queue.front();
    queue.pop_front();
    return static_cast<int>(kBrachydOk);
  });
}

// Runs what sends, where there is a connection.
template <class Function>
int send(BrachydClient* client, const Function& function) {
  return guarded(client, [&] {
    if (!client->client || !client->client->is_open()) return ended(client);
    if (client->welcome) function(*client->client);
    return client->client->is_open() ? static_cast<int>(kBrachydOk) : ended(client);
  });
}

bool is_number(std::uint32_t needle) {
  return needle <= 0xFFFF;
}

}  // namespace

const char* brachyd_client_version(void) {
  static const std::string version = brachy::version();
  return version.c_str();
}

const char* brachyd_status_text(int status) {
  switch (status) {
    case kBrachydBadArgument:
      return "an argument is not valid";
    case kBrachydUnreachable:
      return "the server cannot be reached";
    case kBrachydRefused:
      return "the server refused";
    case kBrachydClosed:
      return "the connection ended";
    case kBrachydNothing:
      return "nothing has come yet";
    case kBrachydInternal:
      return "no memory, or a defect of the library";
    default:
      return status >= 0 ? "no error" : "an unknown status";
  }
}

int64_t brachyd_now_ns(void) {
  return net::real_clock().now_ns();
}

void brachyd_init_options(BrachydOptions* options, size_t size) {
  if (!options || size < sizeof *options) return;
  std::memset(options, 0, size);  // a later version's may have more members than this one knows
  options->struct_size = size;
  options->role = kBrachydViewer;
  options->needle = kBrachydAnyNeedle;
  c_api::copy_text("client", options->name);
  options->timeout_s = 5;
  options->max_force_n = options->max_stiffness_n_per_mm = options->damping_n_s_per_mm = options->rate_hz =
      std::numeric_limits<double>::quiet_NaN();
}

BrachydClient* brachyd_create(void) {
  try {
    return new BrachydClient;
  } catch (...) {
    return nullptr;
  }
}

void brachyd_destroy(BrachydClient* client) {
  delete client;
}

int brachyd_connect(BrachydClient* client, const char* host, int port, const BrachydOptions* options) {
  return guarded(client, [&] {
    BrachydOptions defaults;
    brachyd_init_options(&defaults, sizeof defaults);
    if (!host) return fail(client, kBrachydBadArgument, "the host is NULL");
    if (port < 1 || port > 65535) return fail(client, kBrachydBadArgument, "the port must be 1 to 65535");
    net::ClientOptions checked;
    try {
      checked = c_api::client_options(options ? *options : defaults);
    } catch (const brachy::UserError& error) {
      return fail(client, kBrachydBadArgument, error.what());
    }
    const double timeout_s = options ? options->timeout_s : defaults.timeout_s;
    client->forget();
    client->client = std::make_unique<net::Client>(client->io, std::move(checked), client->handlers());
    try {
      client->client->connect(host, static_cast<std::uint16_t>(port));
    } catch (const brachy::UserError& error) {
      client->client.reset();
      return fail(client, kBrachydUnreachable, error.what());
    }
    client->run_until([&] { return client->welcome || client->is_refused || !client->client->is_open(); },
                      timeout_s);
    if (client->welcome) return static_cast<int>(kBrachydOk);
    const bool has_answered = client->is_refused || !client->client->is_open();
    client->client.reset();
    if (has_answered) return ended(client);
    return fail(client, kBrachydUnreachable, "no welcome came in time: does brachyd listen there?");
  });
}

void brachyd_close(BrachydClient* client) {
  if (client && client->client) client->client->close();
}

int brachyd_is_open(const BrachydClient* client) {
  return client && client->client && client->client->is_open();
}

const char* brachyd_error_text(const BrachydClient* client) {
  return client ? client->error_text.c_str() : "the client is NULL";
}

int brachyd_poll(BrachydClient* client, double timeout_s) {
  return guarded(client, [&] {
    if (!c_api::is_wait(timeout_s)) return fail(client, kBrachydBadArgument, "the time must be 0 to 3600 s");
    if (client->client)
      client->run_until([&] { return client->news != 0 || !client->client->is_open(); }, timeout_s);
    if (client->news == 0 && !brachyd_is_open(client)) return ended(client);
    return std::exchange(client->news, 0);
  });
}

int brachyd_get_welcome(const BrachydClient* client, BrachydWelcome* welcome) {
  return guarded(client, [&] { return give(client, client->welcome, welcome); });
}

int brachyd_get_topology(const BrachydClient* client, BrachydTopology* topology) {
  return guarded(client, [&] {
    if (!topology) return fail(client, kBrachydBadArgument, "the output is NULL");
    if (!client->topology) return fail(client, kBrachydNothing, "it has not come yet");
    const net::TopologyMessage& got = *client->topology;
    static_assert(sizeof(brachy::Triangle) == 3 * sizeof(std::uint32_t));  // they lie one behind the other
    *topology = {got.hash,
                 static_cast<std::uint32_t>(got.rest_vertices.size() / 3),
                 got.surface_vertex_count,
                 static_cast<std::uint32_t>(got.triangles.size()),
                 got.triangles.empty() ? nullptr : got.triangles.front().data(),
                 got.rest_vertices.data()};
    return static_cast<int>(kBrachydOk);
  });
}

int brachyd_get_frame(const BrachydClient* client, BrachydFrame* frame) {
  return guarded(client, [&] { return give(client, client->frame, frame); });
}

const float* brachyd_positions(const BrachydClient* client) {
  if (!client || !client->topology || !client->client) return nullptr;
  return client->client->mesh().positions().data();
}

int brachyd_get_needle(const BrachydClient* client, uint32_t index, BrachydNeedle* needle) {
  return guarded(client, [&] {
    if (!needle) return fail(client, kBrachydBadArgument, "the output is NULL");
    if (index >= client->needles.size()) return fail(client, kBrachydBadArgument, "there is no such needle");
    *needle = client->needles[index];
    return static_cast<int>(kBrachydOk);
  });
}

int brachyd_get_seed(const BrachydClient* client, uint32_t index, BrachydSeed* seed) {
  return guarded(client, [&] {
    if (!seed) return fail(client, kBrachydBadArgument, "the output is NULL");
    if (!client->client || index >= client->client->mesh().seeds().size())
      return fail(client, kBrachydBadArgument, "there is no such seed");
    *seed = c_api::seed_of(client->client->mesh().seeds()[index]);
    return static_cast<int>(kBrachydOk);
  });
}

int brachyd_get_force(const BrachydClient* client, BrachydForce* force) {
  return guarded(client, [&] { return give(client, client->force, force); });
}

int brachyd_get_state(const BrachydClient* client, BrachydState* state) {
  return guarded(client, [&] { return give(client, client->state, state); });
}

int brachyd_next_event(BrachydClient* client, BrachydEvent* event) {
  return give_next(client, &BrachydClient::events, event);
}

int brachyd_next_error(BrachydClient* client, BrachydError* error) {
  return give_next(client, &BrachydClient::errors, error);
}

int brachyd_get_image(const BrachydClient* client, int array, BrachydImage* image) {
  return guarded(client, [&] {
    if (!image || array < kBrachydAnyArray || array > kBrachydEndFire)
      return fail(client, kBrachydBadArgument, "the output is NULL, or there is no such array");
    const int wanted = array == kBrachydAnyArray ? client->newest_image : array;
    if (wanted == 0 || client->images[static_cast<std::size_t>(wanted - 1)].message.width == 0)
      return fail(client, kBrachydNothing, "no image has come yet");
    const c_api::ReceivedImage& got = client->images[static_cast<std::size_t>(wanted - 1)];
    *image = BrachydImage{};
    image->array = wanted;
    image->flags = got.message.flags;
    image->width = got.message.width;
    image->height = got.message.height;
    image->sequence = got.message.sequence;
    image->tick = got.message.tick;
    image->spacing_mm = got.message.spacing_mm;
    c_api::copy(got.message.X_WI, image->X_WI);
    image->pixels = got.pixels.data();
    return static_cast<int>(kBrachydOk);
  });
}

int brachyd_get_scanner(const BrachydClient* client, BrachydScanner* scanner) {
  return guarded(client, [&] { return give(client, client->scanner, scanner); });
}

int brachyd_send_pose(BrachydClient* client, const double X_WN[12], int64_t stamp_ns) {
  return guarded(client, [&] {
    if (!X_WN || stamp_ns < 0)
      return fail(client, kBrachydBadArgument, "the pose is NULL, or its stamp below 0");
    if (!std::all_of(X_WN, X_WN + 12, [](double x) { return std::isfinite(x); }))
      return fail(client, kBrachydBadArgument,
                  "a number of the pose is not finite: send nothing while tracking is lost");
    brachy::RigidTransform X;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) X.R(row, column) = X_WN[4 * row + column];
      X.p[row] = X_WN[4 * row + 3];
    }
    return send(client,
                [&](net::Client& out) { out.send_pose(X, stamp_ns == 0 ? brachyd_now_ns() : stamp_ns); });
  });
}

int brachyd_arm(BrachydClient* client, uint32_t needle) {
  if (!is_number(needle)) return kBrachydBadArgument;
  return send(client, [&](net::Client& out) { out.arm(static_cast<std::uint16_t>(needle)); });
}

int brachyd_press(BrachydClient* client, uint32_t needle, int pressed) {
  if (!is_number(needle)) return kBrachydBadArgument;
  return send(client, [&](net::Client& out) { out.press(static_cast<std::uint16_t>(needle), pressed != 0); });
}

int brachyd_control(BrachydClient* client, int action, int loop, const char* kernel,
                    double support_radius_mm) {
  return guarded(client, [&] {
    if (action < kBrachydPlay || action > kBrachydModel)
      return fail(client, kBrachydBadArgument, "there is no such action");
    net::ControlMessage message;
    message.action = static_cast<net::ControlAction>(action);
    message.loop = loop != 0;
    message.support_radius_mm = support_radius_mm;
    if (kernel) message.kernel = kernel;
    return send(client, [&](net::Client& out) { out.control(message); });
  });
}

int brachyd_set_scanner(BrachydClient* client, const BrachydScanner* scanner) {
  return guarded(client, [&] {
    if (!scanner || scanner->array < kBrachydAnyArray || scanner->array > kBrachydBiplane ||
        scanner->freeze < 0 || scanner->freeze > 2)
      return fail(client, kBrachydBadArgument, "the scanner is NULL, or there is no such array or freeze");
    return send(client, [&](net::Client& out) { out.send(c_api::scanner_message(*scanner)); });
  });
}

int brachyd_load(BrachydClient* client, uint32_t needle, uint32_t plan_needle) {
  if (!is_number(needle) || !is_number(plan_needle)) return kBrachydBadArgument;
  return send(client, [&](net::Client& out) {
    out.send(net::LoadMessage{static_cast<std::uint16_t>(needle), static_cast<std::uint16_t>(plan_needle)});
  });
}

int brachyd_request_state(BrachydClient* client) {
  return send(client, [](net::Client& out) { out.request_state(); });
}
