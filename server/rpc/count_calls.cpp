// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/count_calls.h"

#include <grpcpp/server_context.h>

#include <optional>

namespace ccslice::server {
namespace {

/// Lives as long as its call.
class CountedCall final : public grpc::experimental::Interceptor {
 public:
  CountedCall(ConnectionTable& connections, const std::optional<Peer>& peer)
      : connections_(connections), connection_(peer ? connections.begin_call(*peer) : 0) {}
  ~CountedCall() override { connections_.end_call(connection_, ConnectionTable::Clock::now(), served_); }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE) &&
        methods->GetRecvMessage() != nullptr) {  // None: the end of a stream.
      connections_.note_message(connection_, ConnectionTable::Clock::now());
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      served_ = methods->GetSendStatus().error_code() != grpc::StatusCode::CANCELLED;
    }
    methods->Proceed();
  }

 private:
  ConnectionTable& connections_;
  const ConnectionTable::ConnectionId connection_;
  bool served_ = false;
};

class CountedCalls final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CountedCalls(ConnectionTable& connections) : connections_(connections) {}

  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override {
    return new CountedCall(connections_, parse_peer(info->server_context()->peer()));
  }

 private:
  ConnectionTable& connections_;
};

}  // namespace

InterceptorFactories count_calls(ConnectionTable& connections) {
  InterceptorFactories factories;
  factories.push_back(std::make_unique<CountedCalls>(connections));
  return factories;
}

}  // namespace ccslice::server
