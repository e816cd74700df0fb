// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page of `ccslice view`, and the HTTP interface behind it (docs/view_api.md), on a port of this machine alone.

#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "client/cli/session/session.h"

namespace ccslice::cli {

struct ViewedMesh {
  std::string id;    // On the server.
  std::string name;  // What the page calls it.
};

class ViewServer {
 public:
  /// `port`: 0 for any. Throws Error{kFileUnwritable} if it is taken.
  ViewServer(Session& session, ViewedMesh mesh, std::uint16_t port);
  ~ViewServer();

  /// "http://127.0.0.1:PORT/#token=TOKEN".
  std::string address() const;
  /// Serves until stop().
  void run();
  /// From any thread, both. What doesn't run yet isn't stopped.
  bool is_running() const;
  void stop();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice::cli
