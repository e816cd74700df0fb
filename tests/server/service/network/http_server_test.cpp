// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/http_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "server/service/network/listen_socket.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// Connects to a server of this machine, or holds nothing. `flags`: of a socket's type.
Descriptor connect_to(const std::string& address, int flags = 0) {
  Descriptor descriptor(::socket(AF_INET, SOCK_STREAM | flags, 0));
  sockaddr_in to = {};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool connected = ::connect(descriptor.get(), reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0;
  if (!connected && errno != EINPROGRESS) descriptor.close();
  return descriptor;
}

/// What a server answers to these bytes.
std::string ask_http(const std::string& address, const std::string& request) {
  const Descriptor connection = connect_to(address);
  (void)!::write(connection.get(), request.data(), request.size());
  std::string answer;
  std::array<char, 4096> piece;
  ssize_t count = 0;
  while ((count = ::read(connection.get(), piece.data(), piece.size())) > 0) {
    answer.append(piece.data(), static_cast<std::size_t>(count));
  }
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

TEST(HttpServerTest, IgnoresRanges) {
  const HttpServer server("127.0.0.1:0",
                          [](const std::string&) { return HttpAnswer{.status = 200, .text = std::string(1000, 'a')}; });
  std::string request = "GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\nRange: bytes=0-";
  for (int i = 0; i < 500; ++i) request += ",0-";
  const std::string answer = ask_http(server.address(), request + "\r\n\r\n");
  EXPECT_NE(answer.find("200"), std::string::npos) << answer.substr(0, 500);
  EXPECT_LT(answer.size(), 2000u);
}

TEST(HttpServerTest, TakesFewHeaders) {
  const HttpServer server("127.0.0.1:0", [](const std::string&) { return HttpAnswer{.status = 200, .text = "text"}; });
  const auto answer_to = [&](int headers) {
    std::string request = "GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n";
    for (int i = 0; i < headers; ++i) request += "a: b\r\n";
    return ask_http(server.address(), request + "\r\n");
  };
  EXPECT_NE(answer_to(1000).find("200"), std::string::npos);
  EXPECT_EQ(answer_to(10'000).find("200"), std::string::npos);
}

TEST(HttpServerTest, SaysThatAPortIsTaken) {
  const auto none = [](const std::string&) { return HttpAnswer{}; };
  const HttpServer server("127.0.0.1:0", none);
  EXPECT_THROW(HttpServer(server.address(), none), std::runtime_error);
}

HttpAnswer no_page(const std::string&) { return {}; }

TEST(HttpServerTest, AConnectionThatDripsEndsAllTheSame) {
  const HttpServer server("127.0.0.1:0", no_page);
  const Descriptor slow = connect_to(server.address());
  const auto begin = std::chrono::steady_clock::now();
  ssize_t sent = 1;
  while (sent == 1 && std::chrono::steady_clock::now() < begin + 20s) {
    sent = ::send(slow.get(), "G", 1, MSG_NOSIGNAL);
    std::this_thread::sleep_for(100ms);
  }
  EXPECT_EQ(sent, -1);
}

TEST(HttpServerTest, AFloodOfConnectionsTakesFewDescriptorsAndPasses) {
  const HttpServer server("127.0.0.1:0", no_page);
  const std::size_t before = open_descriptors();
  std::vector<Descriptor> flood;
  for (int i = 0; i < 100; ++i) flood.push_back(connect_to(server.address(), SOCK_NONBLOCK));
  std::this_thread::sleep_for(300ms);
  EXPECT_LE(open_descriptors(), before + flood.size() + 10);
  flood.clear();
  EXPECT_NE(ask_http(server.address(), get("/")).find("200"), std::string::npos);
}

TEST(HttpServerTest, StopsBesideConnectionsThatSayNothing) {
  std::vector<Descriptor> silent;
  const auto begin = std::chrono::steady_clock::now();
  {
    const HttpServer server("127.0.0.1:0", no_page);
    for (int i = 0; i < 20; ++i) silent.push_back(connect_to(server.address(), SOCK_NONBLOCK));
    std::this_thread::sleep_for(100ms);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 20s);
}

}  // namespace
}  // namespace ccslice::server
