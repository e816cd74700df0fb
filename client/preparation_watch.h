// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Asks a server now and then how far it is with a mesh, while a call waits for it.

#pragma once

#include <exception>
#include <string>
#include <thread>

#include "client/cancellation.h"
#include "client/client.h"
#include "client/endpoints.h"

namespace ccslice::client {

/// Asks as long as it lives, on a thread of its own. What fails is kept quiet: an old server doesn't know the question,
/// another one than the mesh's no answer, and the call itself says what matters.
class PreparationWatch {
 public:
  /// Asks nothing without `report`, which gets an answer only if it is further than the one before. `waiting` is the
  /// call's context: it is cancelled if `report` throws. All of them outlive this.
  PreparationWatch(const Endpoint& endpoint, std::string mesh_id, const PreparationReport& report,
                   grpc::ClientContext& waiting);
  ~PreparationWatch();
  PreparationWatch(const PreparationWatch&) = delete;
  PreparationWatch& operator=(const PreparationWatch&) = delete;

  /// Ends it, at once. Throws what `report` threw.
  void stop();

 private:
  void run();
  /// False if there is no use in asking again.
  bool ask();
  void end();

  const Endpoint& endpoint_;
  const std::string mesh_id_;
  const PreparationReport& report_;
  grpc::ClientContext& waiting_;
  Cancellation over_;
  // Of the thread, until it has ended:
  v1::GetPreparationResponse last_;
  std::exception_ptr thrown_;
  std::thread thread_;
};

}  // namespace ccslice::client
