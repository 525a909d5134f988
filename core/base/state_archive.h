#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/base/error.h"

namespace brachy {

/// The state of a run as bytes, from which it goes on bit for bit (core/simulation/saved_state.cpp). A class lists its
/// members once, for writing and reading:
///
///     template <class Archive>
///     void list_state(Archive& archive) { archive(tick_, flags_, needles_); }
///
/// and a struct whose members are public is listed by a function `list_state(archive, structure)`. What an object is
/// constructed with is not part of its state. Bytes are this machine's: 64 bits, little-endian, as all that we run on.
class StateWriter {
 public:
  static constexpr bool kReads = false;

  /// Writes over what `bytes` holds; within its capacity without allocation. It must outlive this.
  explicit StateWriter(std::vector<std::byte>& bytes) : bytes_(bytes) { bytes_.clear(); }

  template <class... Members>
  void operator()(const Members&... members) {
    (put(members), ...);
  }

 private:
  void put_bytes(const void* from, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void put(const T& value) { put_bytes(&value, sizeof value); }
  template <class Scalar, int kRows, int kColumns>
  requires(kRows != Eigen::Dynamic &&
           kColumns != Eigen::Dynamic) void put(const Eigen::Matrix<Scalar, kRows, kColumns>& matrix) {
    put_bytes(matrix.data(), sizeof(Scalar) * kRows * kColumns);
  }
  void put(const std::string& text) {
    put(text.size());
    put_bytes(text.data(), text.size());
  }
  template <class T, std::size_t kCount>
  void put(const T (&values)[kCount]) {
    put_all(std::span<const T>(values));
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put(values.size());
    put_all(std::span<const T>(values));
  }
  template <class T, std::size_t kCount>
  void put(const std::array<T, kCount>& values) {
    put_all(std::span<const T>(values));
  }
  template <class T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class T>
  void put_all(std::span<const T> values) {
    if constexpr (std::is_arithmetic_v<T>)
      put_bytes(values.data(), values.size_bytes());
    else
      for (const T& value : values) put(value);
  }
  template <class T>
  requires std::is_class_v<T>
  void put(const T& object) {
    // Members are listed once, for reading too, so the list of a class is not const; writing changes nothing.
    auto& listed = const_cast<T&>(object);
    if constexpr (requires { listed.list_state(*this); })
      listed.list_state(*this);
    else
      list_state(*this, listed);
  }

  std::vector<std::byte>& bytes_;
};

/// Reads what a StateWriter has written, into objects that were constructed alike.
/// Errors: UserError where the bytes end too early, an array in them is longer than they are, or there are more or
/// fewer of what is constructed with a scene. Objects are then half read: do not use them.
class StateReader {
 public:
  static constexpr bool kReads = true;

  explicit StateReader(std::span<const std::byte> bytes) : left_(bytes) {}

  template <class... Members>
  void operator()(Members&... members) {
    (get(members), ...);
  }
  std::size_t bytes_left() const { return left_.size(); }

 private:
  static void require(bool is_alike) {
    if (!is_alike) throw UserError("the saved state is another scene's");
  }
  void get_bytes(void* to, std::size_t size) {
    if (size > left_.size()) throw UserError("the saved state ends too early");
    std::memcpy(to, left_.data(), size);
    left_ = left_.subspan(size);
  }
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void get(T& value) { get_bytes(&value, sizeof value); }
  template <class Scalar, int kRows, int kColumns>
  requires(kRows != Eigen::Dynamic &&
           kColumns != Eigen::Dynamic) void get(Eigen::Matrix<Scalar, kRows, kColumns>& matrix) {
    get_bytes(matrix.data(), sizeof(Scalar) * kRows * kColumns);
  }
  template <class T, std::size_t kCount>
  void get(T (&values)[kCount]) {
    get_all(std::span<T>(values));
  }
  template <class T>
  void get(std::vector<T>& values) {
    std::size_t count = 0;
    get(count);
    if (count > left_.size())
      throw UserError("the saved state ends too early");  // an element has a byte at least
    if constexpr (std::default_initializable<T>)
      values.resize(count);
    else
      require(count == values.size());
    get_all(std::span<T>(values));
  }
  template <class T, std::size_t kCount>
  void get(std::array<T, kCount>& values) {
    get_all(std::span<T>(values));
  }
  template <class T>
  void get(std::optional<T>& value) {
    bool has_value = false;
    get(has_value);
    if constexpr (std::default_initializable<T>)
      has_value ? void(value.emplace()) : value.reset();
    else
      require(has_value == value.has_value());
    if (value) get(*value);
  }
  template <class T>
  void get_all(std::span<T> values) {
    if constexpr (std::is_arithmetic_v<T>)
      get_bytes(values.data(), values.size_bytes());
    else
      for (T& value : values) get(value);
  }
  template <class T>
  requires std::is_class_v<T>
  void get(T& object) {
    if constexpr (requires { object.list_state(*this); })
      object.list_state(*this);
    else
      list_state(*this, object);
  }

  std::span<const std::byte> left_;
};

}  // namespace brachy
