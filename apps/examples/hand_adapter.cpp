#include "apps/examples/hand_adapter.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/realtime/deadline.h"
#include "net/access/token_file.h"
#include "net/client/client.h"

namespace brachy {
namespace {

/// `count` finite numbers with commas between them.
std::vector<double> numbers_in(const std::string& option, const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool is_good = true; is_good && numbers.size() < count;) {
    double number = 0;
    const auto [last, error] = std::from_chars(at, end, number);
    is_good = error == std::errc() && std::isfinite(number);
    if (is_good) numbers.push_back(number);
    at = last;
    if (numbers.size() < count) is_good = is_good && at != end && *at++ == ',';
  }
  if (numbers.size() < count || at != end)
    throw UserError(option + " " + text + ": expected " +
                    (count == 1 ? "a number" : std::to_string(count) + " numbers with commas between them"));
  return numbers;
}

double number_in(const std::string& option, const std::string& text, double least, double most) {
  const double number = numbers_in(option, text, 1)[0];
  if (number < least || number > most)
    throw UserError(option + " " + text + ": expected " + text_of(least) + " to " + text_of(most));
  return number;
}

std::uint16_t whole_number_in(const std::string& option, const std::string& text, std::uint16_t least,
                              std::uint16_t most) {
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < least || number > most)
    throw UserError(option + " " + text + ": expected a whole number from " + std::to_string(least) + " to " +
                    std::to_string(most));
  return number;
}

/// Where the time of cycles is kept, and told at the end.
class CycleTimes {
 public:
  void add(std::int64_t now_ns) {
    if (last_ns_ != 0 && late_us_.size() < kMost)
      late_us_.push_back(1e-3 * static_cast<double>(now_ns - last_ns_));
    last_ns_ = now_ns;
  }
  void print(double period_us) {
    if (late_us_.empty()) return;
    for (double& interval : late_us_) interval = std::abs(interval - period_us);
    std::ranges::sort(late_us_);
    const auto quantile = [&](double q) {
      return late_us_[static_cast<std::size_t>(q * static_cast<double>(late_us_.size() - 1))];
    };
    std::printf("%zu cycles of %.0f us; jitter p50 %.0f us, p99 %.0f us, most %.0f us\n", late_us_.size() + 1,
                period_us, quantile(0.5), quantile(0.99), late_us_.back());
  }

 private:
  static constexpr std::size_t kMost = 1'000'000;
  std::vector<double> late_us_;
  std::int64_t last_ns_ = 0;
};

class Adapter {
 public:
  Adapter(HandDevice& device, const AdapterLine& line)
      : device_(device),
        facts_(device.facts()),
        line_(line),
        loop_(device, line.mapping),
        client_(io_, options(), handlers()),
        signals_(io_, SIGINT, SIGTERM) {
    signals_.async_wait([this](const auto& error, int) { is_ended_ |= !error; });
  }

  int run() {
    client_.connect(line_.host, line_.port);
    const auto period_ns = static_cast<std::int64_t>(1e9 / facts_.rate_hz);
    const std::int64_t begin_ns = monotonic_ns();
    CycleTimes times;
    for (std::int64_t due_ns = begin_ns; !is_over(begin_ns) || loop_.renders_force();) {
      due_ns += period_ns;
      const std::int64_t now_ns = monotonic_ns();
      times.add(now_ns);
      if (is_over(begin_ns)) loop_.disconnect();
      if (!cycle(now_ns)) break;
      io_.restart();
      io_.poll();
      if (due_ns < monotonic_ns()) due_ns = monotonic_ns();  // missed cycles are skipped
      std::this_thread::sleep_for(std::chrono::nanoseconds(due_ns - monotonic_ns()));
    }
    HandReading last;
    device_.exchange(Vec3::Zero(), last);
    times.print(1e-3 * static_cast<double>(period_ns));
    std::printf("%llu poses sent\n", static_cast<unsigned long long>(client_.poses_sent()));
    if (!loss_.empty()) std::fprintf(stderr, "%s: %s\n", facts_.name.c_str(), loss_.c_str());
    return loss_.empty() ? 0 : 1;
  }

 private:
  bool is_over(std::int64_t begin_ns) const {
    return is_ended_ || !loss_.empty() ||
           (line_.seconds && 1e-9 * static_cast<double>(monotonic_ns() - begin_ns) >= *line_.seconds);
  }

  bool cycle(std::int64_t now_ns) {
    const auto cycle = loop_.run(now_ns);
    if (!cycle) {
      loss_ = "the device is gone";
      return false;
    }
    if (!is_welcome_ || !loss_.empty()) return true;
    if (cycle->X_WN) client_.send_pose(*cycle->X_WN, now_ns);
    if (cycle->button) client_.press(*cycle->button);
    return true;
  }

  net::ClientOptions options() const {
    net::ClientOptions o;
    o.role = net::Role::kDevice;
    o.subscription = net::kSubscribeNoMesh;
    o.name = facts_.name;
    o.token = line_.token;
    o.needle = line_.needle;
    o.evaluates_local_model = facts_.max_force_n > 0;
    o.limits.rate_hz = facts_.rate_hz;
    if (facts_.max_force_n > 0) {
      o.limits.max_force_n = facts_.max_force_n;
      o.limits.damping_n_s_per_mm = facts_.damping_n_s_per_mm;
    }
    return o;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage&) { is_welcome_ = true; };
    h.on_local_model = [this](const net::LocalModelMessage& local) {
      loop_.take(local.model, local.input_stamp_ns, monotonic_ns());
    };
    h.on_error = [](const net::ErrorMessage& error) { std::fprintf(stderr, "%s\n", error.text.c_str()); };
    h.on_closed = [this](const std::string& reason) {
      loss_ = "the daemon is gone: " + reason;
      loop_.disconnect();
    };
    return h;
  }

  HandDevice& device_;
  const HandDeviceFacts facts_;
  const AdapterLine& line_;
  HandLoop loop_;
  boost::asio::io_context io_{1};
  net::Client client_;
  boost::asio::signal_set signals_;
  bool is_welcome_ = false, is_ended_ = false;
  std::string loss_;
};

}  // namespace

AdapterLine adapter_line(int argc, char** argv, const std::string& usage,
                         const std::set<std::string>& own_options) {
  AdapterLine line;
  const std::string server = argc > 1 ? argv[1] : "";
  const std::size_t colon = server.rfind(':');
  if (colon == std::string::npos || argc % 2 != 0) throw UserError(usage);
  line.host = server.substr(0, colon);
  line.port = whole_number_in("port", server.substr(colon + 1), 1, 65535);
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string option = argv[i], value = argv[i + 1];
    if (option == "--token") {
      line.token = net::load_token(value);
    } else if (option == "--needle") {
      line.needle = whole_number_in(option, value, 0, 1023);
    } else if (option == "--seconds") {
      line.seconds = number_in(option, value, 0, 1e9);
    } else if (option == "--scale") {
      line.mapping.scale = number_in(option, value, 0.01, 100);
    } else if (option == "--start") {
      line.mapping.start_tip_mm = Vec3(numbers_in(option, value, 3).data());
    } else if (own_options.contains(option)) {
      line.own[option] = value;
    } else {
      throw UserError(usage);
    }
  }
  return line;
}

int run_hand_adapter(HandDevice& device, const AdapterLine& line) {
  return Adapter(device, line).run();
}

}  // namespace brachy
