#pragma once

#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {

/// What must become of a connection after a request.
enum class After { goes_on, closes };

/// One request, byte by byte, and the exact status it must get.
struct Case {
  std::string name;
  std::string bytes;
  int status = 400;
  After after = After::closes;
};

inline std::ostream& operator<<(std::ostream& stream, const Case& wire) {
  return stream << wire.name;
}

inline const std::string kHost = "Host: localhost\r\n";
inline const std::string kOptics =
    R"({"camera": {"lens": {"focal_length_mm": 50, "f_number": 2}}})";
inline const std::string kPostHead =
    "POST /v1/optics HTTP/1.1\r\n" + kHost + "Content-Type: application/json\r\n";

inline std::string get(const std::string& headers,
                       const std::string& line = "GET /livez HTTP/1.1") {
  return line + "\r\n" + headers + "\r\n";
}

inline std::string post(const std::string& headers, const std::string& body) {
  return kPostHead + headers + "\r\n" + body;
}

inline std::string chunked(const std::string& chunks) {
  return post("Transfer-Encoding: chunked\r\n", chunks);
}

inline std::string chunk(const std::string& data, const std::string& extension = {}) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string size;
  for (std::size_t rest = data.size(); rest > 0; rest /= 16) size.insert(0, 1, kDigits[rest % 16]);
  return size + extension + "\r\n" + data + "\r\n";
}

/// The canary: answered once if the connection goes on, never if it closes.
inline void expect_canary(Client& client, After after) {
  if (after == After::goes_on) {
    const auto canary = client.read();
    ASSERT_TRUE(canary) << "the next request was not answered";
    EXPECT_EQ(canary->status, 200);
    EXPECT_EQ(canary->header("content-type"), "application/json");
  } else {
    EXPECT_TRUE(client.is_closed_by_server()) << "bytes behind the request were answered";
  }
}

/// Sends `wire` and a second request behind it; holds both answers against what must come.
inline void expect_answers(std::uint16_t port, const Case& wire) {
  Client client(port);
  client.send(wire.bytes + get(kHost, "GET /readyz HTTP/1.1"));
  const auto answer = client.read(false);
  ASSERT_TRUE(answer) << "no reply";
  EXPECT_EQ(answer->status, wire.status) << answer->body;
  if (wire.status >= 400) {
    EXPECT_EQ(answer->header("content-type"), "application/problem+json");
    EXPECT_LE(answer->body.size(), 16384U);
  }
  if (wire.after == After::closes) {
    EXPECT_EQ(answer->header("connection"), "close");
  }
  expect_canary(client, wire.after);
}

}  // namespace fstop::test
