// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pages for who watches over the server: small, in plain text, made anew for each request. No encryption and no
// identity: for a network of operators.

#pragma once

#include <functional>
#include <memory>
#include <string>

namespace ccslice::server {

struct HttpAnswer {
  int status = 200;
  std::string text;
};

class HttpServer {
 public:
  /// The page of a path; status 404 where there is none. Any thread. Mustn't throw.
  using Page = std::function<HttpAnswer(const std::string& path)>;

  /// Serves from here on. `address`: HOST:PORT, [IPV6]:PORT; port 0 takes a free one. Throws std::runtime_error if it
  /// can't.
  HttpServer(const std::string& address, Page page);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// With the port that was taken.
  const std::string& address() const noexcept { return address_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string address_;
};

}  // namespace ccslice::server
