#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "api/scene_assets.h"
#include "core/build_stop.h"
#include "core/error.h"

namespace fstop::server {

/// What may be copied byte by byte: numbers, enums and structs of them.
template <typename T>
concept Plain = std::is_trivially_copyable_v<T> && !std::is_pointer_v<T> &&
                !std::is_same_v<T, std::string_view>;

/// Values as bytes, as this machine has them: for other processes of the same build. Structs are
/// passed member by member by their `pass(stream, value)`, one function for both directions.
class ByteWriter {
 public:
  explicit ByteWriter(std::function<void(std::string_view)> sink) : sink_(std::move(sink)) {}

  template <typename... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }

 private:
  template <Plain T>
  void put(const T& value) {
    sink_({reinterpret_cast<const char*>(&value), sizeof value});
  }
  void put(const std::string& text) {
    put(std::uint64_t{text.size()});
    sink_(text);
  }
  void put(const Image& image) {
    for (const int size : {image.width(), image.height(), image.channels()}) put(size);
    put_all(image.pixels());
  }
  template <typename T>
  void put(const std::vector<T>& values) {
    put(std::uint64_t{values.size()});
    put_all(values);
  }
  template <typename Key, typename T>
  void put(const std::map<Key, T>& values) {
    put(std::uint64_t{values.size()});
    for (const auto& [key, value] : values) (*this)(key, value);
  }
  template <typename... Kinds>
  requires(!Plain<std::variant<Kinds...>>) void put(const std::variant<Kinds...>& value) {
    put(std::uint64_t{value.index()});
    std::visit([this](const auto& kind) { put(kind); }, value);
  }
  template <typename T>
  void put(const T& value) requires requires(ByteWriter& writer) {
    pass(writer, value);
  }
  { pass(*this, value); }
  template <typename T>
  void put_all(const std::vector<T>& values) {
    if constexpr (Plain<T>) {
      sink_({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
    } else {
      for (const T& value : values) put(value);
    }
  }

  std::function<void(std::string_view)> sink_;
};

/// Reads what ByteWriter wrote. Throws: Error{internal} where the bytes cannot be that.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <typename... Values>
  void operator()(Values&... values) {
    (get(values), ...);
  }
  void require_end() const { require(rest_.empty()); }

 private:
  // So much is read between two looks at a stop (BuildStop): a scene may be given up meanwhile.
  static constexpr std::size_t kPart = 1 << 20;
  static void copy(std::string_view bytes, void* to) {
    for (std::size_t first = 0; first < bytes.size(); first += kPart) {
      BuildStop::throw_if_requested();
      const std::string_view part = bytes.substr(first, kPart);
      std::memcpy(static_cast<char*>(to) + first, part.data(), part.size());
    }
  }
  template <Plain T>
  void get(T& value) {
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
  }
  void get(std::string& text) { text = take(count(1)); }
  void get(Image& image) {
    int width = 0;
    int height = 0;
    int channels = 0;
    (*this)(width, height, channels);
    if (width == 0 && height == 0) return;
    require(width > 0 && height > 0 && channels > 0 && channels <= 4);
    const std::uint64_t bytes = static_cast<std::uint64_t>(width) *
                                static_cast<std::uint64_t>(height) *
                                static_cast<std::uint64_t>(channels) * sizeof(float);
    const std::string_view floats = take(bytes);
    image = Image(width, height, channels);
    copy(floats, image.pixels().data());
  }
  template <typename T>
  void get(std::vector<T>& values) {
    if constexpr (Plain<T>) {
      const std::uint64_t size = count(sizeof(T));
      const std::string_view bytes = take(size * sizeof(T));
      values.reserve(size);
      constexpr std::size_t kSome = std::max<std::size_t>(1, kPart / sizeof(T));
      for (std::size_t first = 0; first < size; first += kSome) {
        const std::size_t some = std::min(kSome, size - first);
        values.resize(first + some);  // as it is filled: zeros of all at once would take long
        copy(bytes.substr(first * sizeof(T), some * sizeof(T)), values.data() + first);
      }
    } else {
      values.resize(count(1));
      for (T& value : values) get(value);
    }
  }
  template <typename Key, typename T>
  void get(std::map<Key, T>& values) {
    for (std::uint64_t left = count(1); left > 0; --left) {
      Key key = {};
      get(key);
      get(values[key]);
    }
  }
  template <typename... Kinds>
  requires(!Plain<std::variant<Kinds...>>) void get(std::variant<Kinds...>& value) {
    std::uint64_t index = 0;
    get(index);
    require(index < sizeof...(Kinds));
    std::uint64_t i = 0;
    ((i++ == index ? get(value.template emplace<Kinds>()) : void()), ...);
  }
  template <typename T>
  void get(T& value) requires requires(ByteReader& reader) {
    pass(reader, value);
  }
  { pass(*this, value); }

  // How many elements of at least `bytes` bytes follow: never more than there are bytes.
  std::uint64_t count(std::size_t bytes) {
    std::uint64_t number = 0;
    get(number);
    require(number <= rest_.size() / bytes);
    return number;
  }
  std::string_view take(std::uint64_t bytes) {
    require(bytes <= rest_.size());
    const std::string_view taken = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return taken;
  }
  static void require(bool is_so) {
    if (!is_so) throw Error(ErrorCode::internal, "another process sent bytes that mean nothing");
  }

  std::string_view rest_;
};

}  // namespace fstop::server
