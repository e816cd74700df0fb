// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The servers that a client may call, one channel to each. All of them give the same bytes, but each one that meets a
// mesh has to get it and to prepare it. So all clients send the calls of a mesh to the same server, and where that one
// fails to the same next one: servers are ordered by a hash of server and mesh (rendezvous hashing). A server that
// comes or goes moves the meshes of that server alone.
//
// A name that stands for several addresses is several servers. A thread looks such names up again, now and then and
// after failures; nobody but the first calls waits for that, and not for long. TLS and servers see the name, whatever
// the address.

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ccslice/v1/service.grpc.pb.h"
#include "client/client.h"

namespace ccslice::client {

struct Endpoint {
  std::string address;  // Names it in messages and in the order.
  std::shared_ptr<grpc::ChannelInterface> channel;
  std::unique_ptr<v1::SlicerService::Stub> stub;
  std::shared_ptr<const TokenFile> token;  // May be null.
};

using EndpointList = std::vector<std::shared_ptr<const Endpoint>>;

/// Thread-safe.
class Endpoints {
 public:
  /// Throws ClientError (ADDRESS_INVALID, CREDENTIALS_INVALID).
  explicit Endpoints(const ClientOptions& options);
  explicit Endpoints(std::shared_ptr<grpc::ChannelInterface> channel);
  ~Endpoints();
  Endpoints(const Endpoints&) = delete;
  Endpoints& operator=(const Endpoints&) = delete;

  /// All of them, at least one, in the order in which calls of the mesh go to them; as given where it is about no mesh.
  EndpointList in_order(const std::string& mesh_id) const;
  /// A server has failed: has names looked up again, but not more often than once a second.
  void look_up_soon() const;

 private:
  struct State;
  static void watch_names(const std::shared_ptr<State>& state);

  std::shared_ptr<State> state_;  // With the thread, which may still wait for an answer of DNS when this ends.
};

/// Puts endpoints into the order of a mesh.
void order_for(const std::string& mesh_id, EndpointList& endpoints);

}  // namespace ccslice::client
