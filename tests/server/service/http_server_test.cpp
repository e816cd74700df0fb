// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/http_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

namespace ccslice::server {
namespace {

/// What a server answers to these bytes.
std::string ask_http(const std::string& address, const std::string& request) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to = {};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (::connect(descriptor, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0) {
    (void)!::write(descriptor, request.data(), request.size());
    std::array<char, 4096> piece;
    ssize_t count = 0;
    while ((count = ::read(descriptor, piece.data(), piece.size())) > 0) {
      answer.append(piece.data(), static_cast<std::size_t>(count));
    }
  }
  ::close(descriptor);
  return answer;
}

std::string get(const std::string& path) { return "GET " + path + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"; }

TEST(HttpServerTest, ServesPages) {
  const HttpServer server("127.0.0.1:0", [](const std::string& path) {
    return path == "/page" ? HttpAnswer{.status = 200, .text = "text"} : HttpAnswer{.status = 404, .text = "none"};
  });
  const std::string good = ask_http(server.address(), get("/page"));
  EXPECT_NE(good.find("200"), std::string::npos) << good;
  EXPECT_TRUE(good.ends_with("text")) << good;
  EXPECT_NE(ask_http(server.address(), get("/../page")).find("404"), std::string::npos);
  EXPECT_EQ(ask_http(server.address(), "nonsense\r\n\r\n").find("200"), std::string::npos);
  EXPECT_NE(ask_http(server.address(), get("/page")).find("200"), std::string::npos);
}

TEST(HttpServerTest, SaysThatAPortIsTaken) {
  const auto none = [](const std::string&) { return HttpAnswer{}; };
  const HttpServer server("127.0.0.1:0", none);
  EXPECT_THROW(HttpServer(server.address(), none), std::runtime_error);
}

}  // namespace
}  // namespace ccslice::server
