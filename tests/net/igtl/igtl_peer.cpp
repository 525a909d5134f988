#include "tests/net/igtl/igtl_peer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <stdexcept>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/crc64.h"

namespace brachy::net::igtl::test {

using boost::asio::ip::tcp;

RigidTransform Received::transform() const {
  const auto X = decode_transform(content);
  if (!X) throw std::runtime_error("no TRANSFORM");
  return *X;
}

Status Received::status() const {
  const std::span<const std::byte> all(content);
  Status status;
  status.code = static_cast<StatusCode>(get<std::uint16_t>(all));
  status.sub_code = static_cast<std::int64_t>(get<std::uint64_t>(all.subspan(2)));
  status.name = get_name(all.subspan(10, kNameBytes));
  status.text = get_name(all.subspan(30));
  return status;
}

std::vector<float> Received::points() const {
  const std::span<const std::byte> all(content);
  std::vector<float> points(3 * std::size_t{get<std::uint32_t>(all)});
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = get_float(all.subspan(40 + 4 * i));
  return points;
}

std::vector<TrackedTool> Received::tools() const {
  constexpr std::size_t kToolBytes = kNameBytes + 2 + kTransformBytes;
  std::vector<TrackedTool> tools;
  for (std::span<const std::byte> rest(content); rest.size() >= kToolBytes; rest = rest.subspan(kToolBytes)) {
    tools.push_back({std::string(get_name(rest.first(kNameBytes))),
                     *decode_transform(rest.subspan(kNameBytes + 2, kTransformBytes))});
  }
  return tools;
}

std::vector<std::pair<std::string, Vec3>> Received::named_points() const {
  constexpr std::size_t kElementBytes = 136, kPositionOffset = 100;
  std::vector<std::pair<std::string, Vec3>> points;
  for (std::span<const std::byte> rest(content); rest.size() >= kElementBytes;
       rest = rest.subspan(kElementBytes)) {
    Vec3 p;
    for (int i = 0; i < 3; ++i)
      p[i] = get_float(rest.subspan(kPositionOffset + 4 * static_cast<std::size_t>(i)));
    points.emplace_back(get_name(rest.first(64)), p);
  }
  return points;
}

Bytes with_right_size_and_crc(Bytes message) {
  const Bytes body(message.begin() + kHeaderSize, message.end());
  message.resize(kHeaderSize - 16);
  put(message, static_cast<std::uint64_t>(body.size()));
  put(message, crc64(body));
  message.insert(message.end(), body.begin(), body.end());
  return message;
}

IgtlPeer::IgtlPeer(boost::asio::io_context& io, std::uint16_t port, int receive_buffer) : socket_(io) {
  socket_.open(tcp::v4());
  if (receive_buffer > 0) socket_.set_option(boost::asio::socket_base::receive_buffer_size(receive_buffer));
  socket_.connect({boost::asio::ip::address_v4::loopback(), port});
  socket_.set_option(tcp::no_delay(true));
}

bool IgtlPeer::send(std::span<const std::byte> bytes) {
  boost::system::error_code error;
  boost::asio::write(socket_, boost::asio::buffer(bytes.data(), bytes.size()), error);
  return !error;
}

bool IgtlPeer::send_pose(const std::string& device, const RigidTransform& X, std::uint16_t version) {
  return send(encode_transform({version, device, to_timestamp(stamp_ns_ += 5'000'000)}, X));
}

bool IgtlPeer::send_query(const std::string& type, const std::string& device, std::uint16_t version) {
  return send(encode_empty(type, {version, device, 0}));
}

void IgtlPeer::take(std::size_t max_bytes) {
  std::vector<std::byte> piece(std::min<std::size_t>(max_bytes, 64 * 1024));
  socket_.non_blocking(true);
  while (max_bytes > 0 && !is_ended_) {
    boost::system::error_code error;
    const std::size_t size =
        socket_.read_some(boost::asio::buffer(piece.data(), std::min(max_bytes, piece.size())), error);
    if (error == boost::asio::error::would_block) break;
    if (error) {
      is_ended_ = true;
      break;
    }
    max_bytes -= size;
    buffer_.insert(buffer_.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(size));
    while (buffer_.size() >= kHeaderSize) {
      const Header header = decode_header(buffer_);
      const std::size_t whole = kHeaderSize + header.body_size;
      if (buffer_.size() < whole) break;
      auto body = std::span<const std::byte>(buffer_).subspan(kHeaderSize, header.body_size);
      EXPECT_EQ(crc64(body), header.crc) << header.type;
      std::string metadata;
      if (header.version == 2) {
        const std::size_t counts = get<std::uint16_t>(body.subspan(2)),
                          texts = get<std::uint32_t>(body.subspan(4));
        metadata = get_name(body.last(texts));
        body = body.subspan(kExtendedHeaderSize, body.size() - kExtendedHeaderSize - counts - texts);
      }
      received.push_back({header, Bytes(body.begin(), body.end()), metadata});
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(whole));
    }
  }
  socket_.non_blocking(false);
}

void IgtlPeer::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

std::size_t IgtlPeer::count(const std::string& type, const std::string& device) const {
  return static_cast<std::size_t>(std::count_if(received.begin(), received.end(), [&](const Received& r) {
    return r.header.type == type && (device.empty() || r.header.device == device);
  }));
}

const Received& IgtlPeer::last(const std::string& type, const std::string& device) const {
  for (auto r = received.rbegin(); r != received.rend(); ++r)
    if (r->header.type == type && (device.empty() || r->header.device == device)) return *r;
  throw std::runtime_error("no " + type + " " + device + " came");
}

}  // namespace brachy::net::igtl::test
