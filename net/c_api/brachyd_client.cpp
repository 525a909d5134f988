#include "net/c_api/brachyd_client.h"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/version.h"
#include "net/client/client.h"
#include "net/wire/image_pixels.h"

namespace net = brachy::net;

namespace {

constexpr std::size_t kMostWaiting = 256;  // events, errors
constexpr int kMostHandlers = 10'000;  // of one poll: a server that never pauses does not hold it for ever
constexpr double kLongestWaitS = 3600;

static_assert(kBrachydTokenBytes == net::kTokenBytes && kBrachydNameBytes == net::kMaxNameBytes + 1 &&
              kBrachydTextBytes == net::kMaxTextBytes + 1 && kBrachydAnyNeedle == net::kAnyNeedle);

template <std::size_t kBytes>
void copy_text(const std::string& text, char (&out)[kBytes]) {
  const std::size_t length = std::min(text.size(), kBytes - 1);
  std::memcpy(out, text.data(), length);
  std::memset(out + length, 0, kBytes - length);
}

void copy(const brachy::Vec3& from, double (&to)[3]) {
  std::copy_n(from.data(), 3, to);
}

void copy(const brachy::RigidTransform& X, double (&to)[12]) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) to[4 * row + column] = X.R(row, column);
    to[4 * row + 3] = X.p[row];
  }
}

BrachydNeedle needle_of(const net::NeedleRecord& record) {
  const brachy::NeedleState& state = record.state;
  BrachydNeedle needle{};
  needle.id = record.id;
  needle.present = state.present;
  needle.contact = static_cast<std::int32_t>(state.contact);
  needle.puncture_count = state.puncture_count;
  needle.insertion_depth_mm = state.insertion_depth_mm;
  copy(state.X_WN, needle.X_WN);
  needle.has_force = record.has_forces;
  copy(state.forces.force_n, needle.force_n);
  needle.axial_n = state.forces.axial_n;
  return needle;
}

BrachydFrame frame_of(const net::FrameMessage& message) {
  BrachydFrame frame{};
  frame.tick = message.tick;
  frame.snapshot_sequence = message.snapshot_sequence;
  frame.sim_time_s = message.sim_time_s;
  frame.input_sequence = message.input_sequence;
  frame.input_stamp_ns = message.input_stamp_ns;
  frame.max_displacement_mm = message.max_displacement_mm;
  frame.step_flags = message.step_flags;
  frame.moved_vertices = message.moved_vertices;
  frame.point_count = message.point_count;
  frame.needle_count = static_cast<std::uint32_t>(message.needles.size());
  frame.verdict = message.certificate ? static_cast<std::int32_t>(message.certificate->verdict) : 0;
  frame.lag_mm = message.lag_mm;
  return frame;
}

BrachydForce force_of(const net::ForceMessage& message, std::int64_t received_ns) {
  constexpr std::uint32_t kDefaultValidMs = 50;
  BrachydForce force{};
  force.tick = message.tick;
  force.input_sequence = message.input_sequence;
  force.input_stamp_ns = message.input_stamp_ns;
  force.received_ns = received_ns;
  copy(message.forces.force_n, force.force_n);
  copy(message.forces.tip_torque_nmm, force.tip_torque_nmm);
  copy(message.forces.hub_torque_nmm, force.hub_torque_nmm);
  force.axial_n = message.forces.axial_n;
  force.lateral_n = message.forces.lateral_n;
  force.cutting_n = message.forces.cutting_n;
  force.friction_n = message.forces.friction_n;
  force.needle = message.needle;
  force.flags = message.flags;
  force.valid_ms = message.valid_ms == 0 ? kDefaultValidMs : message.valid_ms;
  return force;
}

BrachydState state_of(const net::StateMessage& message) {
  BrachydState state{};
  state.ticks = message.ticks;
  state.overruns = message.overruns;
  state.tick_p50_ms = message.tick_ms.p50;
  state.tick_p99_ms = message.tick_ms.p99;
  state.tick_max_ms = message.tick_ms.max;
  state.latency_p50_ms = message.latency_ms.p50;
  state.latency_p99_ms = message.latency_ms.p99;
  state.latency_max_ms = message.latency_ms.max;
  state.poses_accepted = message.poses_accepted;
  for (const net::PoseRefusals& refusals : message.refusals) state.poses_refused += refusals.count;
  state.snapshots = message.snapshots;
  state.snapshots_sent = message.snapshots_sent;
  state.snapshots_dropped = message.snapshots_dropped;
  state.events_dropped = message.events_dropped;
  state.clients = message.clients;
  state.viewers = message.viewers;
  state.support_radius_mm = message.controls.support_radius_mm;
  state.controls = message.controls.flags;
  copy_text(message.controls.kernel, state.kernel);
  copy_text(message.device_holder, state.device_holder);
  return state;
}

BrachydWelcome welcome_of(const net::WelcomeMessage& message) {
  BrachydWelcome welcome{};
  welcome.session = message.session;
  welcome.role = static_cast<std::int32_t>(message.role);
  welcome.subscription = message.subscription;
  welcome.needle = message.needle;
  welcome.needle_count = message.needle_count;
  welcome.deformation_hz = message.deformation_hz;
  welcome.snapshot_hz = message.snapshot_hz;
  welcome.max_poses_per_s = message.max_poses_per_s;
  copy_text(message.server, welcome.server);
  return welcome;
}

std::chrono::milliseconds in_ms(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(1e3 * seconds)));
}

bool is_wait(double seconds) {
  return seconds >= 0 && seconds <= kLongestWaitS;  // not a NaN either
}

// Throws UserError for an option out of its range.
net::ClientOptions client_options(const BrachydOptions& given) {
  if (given.struct_size < sizeof(BrachydOptions))
    throw brachy::UserError("BrachydOptions: call brachyd_init_options first");
  if (given.role < kBrachydViewer || given.role > kBrachydOperator)
    throw brachy::UserError("BrachydOptions.role must be kBrachydViewer, kBrachydDevice or kBrachydOperator");
  if (!is_wait(given.timeout_s) || given.timeout_s == 0)
    throw brachy::UserError("BrachydOptions.timeout_s must be above 0 and at most 3600");
  if (given.needle > kBrachydAnyNeedle)
    throw brachy::UserError("BrachydOptions.needle must be at most 65535, which is any");
  if (!std::memchr(given.name, 0, sizeof given.name) || !std::memchr(given.tls_ca, 0, sizeof given.tls_ca))
    throw brachy::UserError("BrachydOptions: a text does not end");
  net::ClientOptions options;
  options.role = static_cast<net::Role>(given.role);
  options.subscription = given.subscription;
  options.limits = {given.max_force_n, given.max_stiffness_n_per_mm, given.damping_n_s_per_mm, given.rate_hz};
  options.needle = static_cast<std::uint16_t>(given.needle);
  options.name = given.name;
  if (given.has_token) {
    options.token.emplace();
    std::memcpy(options.token->data(), given.token, sizeof given.token);
  }
  if (given.tls) options.tls = net::make_client_context({given.tls_ca, {}, {}});
  options.connect_timeout = in_ms(given.timeout_s);
  return options;
}

struct ReceivedImage {
  net::ImageMessage message;
  std::vector<std::uint8_t> pixels;
};

}  // namespace

/// What came last by one connection; `client` is first destroyed, since its handlers write all the rest.
struct BrachydClient {
  mutable std::string error_text;
  bool is_refused = false;    // by a fatal ERROR
  std::string closed_reason;  // empty: the connection did not end by itself
  int news = 0;
  std::optional<net::WelcomeMessage> welcome;
  std::optional<net::TopologyMessage> topology;
  std::optional<BrachydFrame> frame;
  std::vector<BrachydNeedle> needles;
  std::optional<BrachydForce> force;
  std::optional<BrachydState> state;
  std::optional<net::ScannerMessage> scanner;
  std::deque<BrachydEvent> events;
  std::deque<BrachydError> errors;
  std::array<ReceivedImage, 3> images;  // of kBrachydTransverse, kBrachydSagittal, kBrachydEndFire
  int newest_image = 0;                 // array of it; 0: none
  boost::asio::io_context io{1};
  std::unique_ptr<net::Client> client;

  net::ClientHandlers handlers();
  void forget();
  // Runs what is ready.
  void run_ready() {
    for (int i = 0; i < kMostHandlers && io.poll_one() > 0; ++i) {
    }
  }
  // Runs until `is_done` or that time has passed.
  template <class Condition>
  void run_until(const Condition& is_done, double seconds) {
    const std::int64_t end_ns = net::real_clock().now_ns() + net::in_ns(in_ms(seconds));
    if (io.stopped()) io.restart();
    run_ready();
    while (!is_done()) {
      const std::int64_t left_ns = end_ns - net::real_clock().now_ns();
      if (left_ns <= 0 || io.run_one_for(std::chrono::nanoseconds(left_ns)) == 0) break;
      run_ready();
    }
  }
};

net::ClientHandlers BrachydClient::handlers() {
  net::ClientHandlers h;
  h.on_welcome = [this](const net::WelcomeMessage& message) { welcome = message; };
  h.on_topology = [this](const net::TopologyMessage& message) {
    topology = message;
    news |= kBrachydNewTopology;
  };
  h.on_frame = [this](const net::FrameMessage& message) {
    frame = frame_of(message);
    frame->seed_count = static_cast<std::uint32_t>(client->mesh().seeds().size());
    needles.clear();
    for (const net::NeedleRecord& record : message.needles) needles.push_back(needle_of(record));
    news |= kBrachydNewFrame;
  };
  h.on_force = [this](const net::ForceMessage& message) {
    force = force_of(message, net::real_clock().now_ns());
    news |= kBrachydNewForce;
  };
  h.on_state = [this](const net::StateMessage& message) {
    state = state_of(message);
    news |= kBrachydNewState;
  };
  h.on_event = [this](const net::EventMessage& message) {
    if (events.size() == kMostWaiting) events.pop_front();
    BrachydEvent& event = events.emplace_back();
    event.tick = message.tick;
    event.kind = static_cast<std::uint32_t>(message.kind);
    event.needle = message.needle;
    copy_text(message.text, event.text);
    news |= kBrachydNewEvent;
  };
  h.on_error = [this](const net::ErrorMessage& message) {
    if (errors.size() == kMostWaiting) errors.pop_front();
    BrachydError& error = errors.emplace_back();
    error.about_sequence = message.about_sequence;
    error.code = static_cast<std::uint32_t>(message.code);
    error.reason = message.reason;
    error.fatal = message.fatal;
    copy_text(message.text, error.text);
    if (message.fatal) {
      is_refused = true;
      closed_reason = message.text;
    }
    news |= kBrachydNewError;
  };
  h.on_image = [this](const net::ImageMessage& message) {
    const auto array = static_cast<int>(message.array);
    if (array < kBrachydTransverse || array > kBrachydEndFire) return;  // of a later version
    ReceivedImage received;
    if (!net::read_pixels(message, received.pixels).empty()) return;  // what is set stays shown
    received.message = message;
    received.message.data.clear();
    images[static_cast<std::size_t>(array - 1)] = std::move(received);
    newest_image = array;
    news |= kBrachydNewImage;
  };
  h.on_scanner = [this](const net::ScannerMessage& message) {
    scanner = message;
    news |= kBrachydNewScanner;
  };
  h.on_closed = [this](const std::string& reason) { closed_reason = reason; };
  return h;
}

void BrachydClient::forget() {
  client.reset();
  is_refused = false;
  closed_reason.clear();
  news = 0;
  welcome.reset();
  topology.reset();
  frame.reset();
  needles.clear();
  force.reset();
  state.reset();
  scanner.reset();
  events.clear();
  errors.clear();
  images = {};
  newest_image = 0;
}

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
  copy_text("client", options->name);
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
      checked = client_options(options ? *options : defaults);
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
    if (!is_wait(timeout_s)) return fail(client, kBrachydBadArgument, "the time must be 0 to 3600 s");
    if (client->client)
      client->run_until([&] { return client->news != 0 || !client->client->is_open(); }, timeout_s);
    if (client->news == 0 && !brachyd_is_open(client)) return ended(client);
    return std::exchange(client->news, 0);
  });
}

int brachyd_get_welcome(const BrachydClient* client, BrachydWelcome* welcome) {
  return guarded(client, [&] {
    const auto& got = client->welcome;
    return give(client, got ? std::optional(welcome_of(*got)) : std::nullopt, welcome);
  });
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
    const brachy::Seed& got = client->client->mesh().seeds()[index];
    *seed = BrachydSeed{};
    seed->id = got.id;
    seed->planned = got.planned;
    seed->needle = got.needle;
    seed->fixed = got.is_fixed;
    seed->air_kerma_strength_u = got.air_kerma_strength_u;
    copy(got.position, seed->position);
    copy(got.axis, seed->axis);
    copy(got.rest, seed->rest);
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
    const ReceivedImage& got = client->images[static_cast<std::size_t>(wanted - 1)];
    *image = BrachydImage{};
    image->array = wanted;
    image->flags = got.message.flags;
    image->width = got.message.width;
    image->height = got.message.height;
    image->sequence = got.message.sequence;
    image->tick = got.message.tick;
    image->spacing_mm = got.message.spacing_mm;
    copy(got.message.X_WI, image->X_WI);
    image->pixels = got.pixels.data();
    return static_cast<int>(kBrachydOk);
  });
}

int brachyd_get_scanner(const BrachydClient* client, BrachydScanner* scanner) {
  return guarded(client, [&] {
    const auto& got = client->scanner;
    std::optional<BrachydScanner> value;
    if (got)
      value = {static_cast<std::int32_t>(got->array),
               static_cast<std::int32_t>(got->freeze),
               got->depth_mm,
               got->gain_db,
               got->dynamic_range_db,
               got->tgc_extra_db_per_cm,
               got->focus_mm,
               got->probe_depth_mm,
               got->probe_rotation_deg};
    return give(client, value, scanner);
  });
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
    net::ScannerMessage message;
    message.array = static_cast<net::ScannerArray>(scanner->array);
    message.freeze = static_cast<net::ScannerFreeze>(scanner->freeze);
    message.depth_mm = scanner->depth_mm;
    message.gain_db = scanner->gain_db;
    message.dynamic_range_db = scanner->dynamic_range_db;
    message.tgc_extra_db_per_cm = scanner->tgc_extra_db_per_cm;
    message.focus_mm = scanner->focus_mm;
    message.probe_depth_mm = scanner->probe_depth_mm;
    message.probe_rotation_deg = scanner->probe_rotation_deg;
    return send(client, [&](net::Client& out) { out.send(message); });
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
