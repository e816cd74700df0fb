// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/count_calls.h"

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <optional>
#include <string>
#include <string_view>

#include "ccslice/v1/service.grpc.pb.h"

namespace ccslice::server {
namespace {

using CallKind = ConnectionTable::CallKind;

CallKind kind_of(std::string_view method) {
  const std::string slicer = "/" + std::string(v1::SlicerService::service_full_name()) + "/";
  return method.starts_with(slicer) ? CallKind::kSlicer : CallKind::kBesides;
}

/// Calls of the slicer take their requests as they came (slicer_service.cpp), and so does gRPC's service of health
/// (default_health_check_service.cc); its reflection doesn't.
bool takes_bytes(std::string_view method) {
  return kind_of(method) == CallKind::kSlicer || method.starts_with("/grpc.health.v1.Health/");
}

/// Lives as long as its call.
class CountedCall final : public grpc::experimental::Interceptor {
 public:
  CountedCall(ConnectionTable& connections, const std::optional<Peer>& peer, std::string_view method)
      : connections_(connections),
        kind_(kind_of(method)),
        connection_(peer ? connections.begin_call(*peer, kind_) : 0),
        has_bytes_(takes_bytes(method)) {}
  ~CountedCall() override { connections_.end_call(connection_, ConnectionTable::Clock::now(), served_, kind_); }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE) &&
        methods->GetRecvMessage() != nullptr) {  // None: the end of a stream.
      take_message(has_bytes_ ? static_cast<grpc::ByteBuffer*>(methods->GetRecvMessage()) : nullptr);
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      served_ = has_request_ && methods->GetSendStatus().error_code() != grpc::StatusCode::CANCELLED;
    }
    methods->Proceed();
  }

 private:
  /// Bytes that aren't valid never came: the call was cancelled before.
  void take_message(const grpc::ByteBuffer* bytes) {
    if (bytes != nullptr && !bytes->Valid()) return;
    if (!has_request_) has_request_ = true;
    connections_.note_message(connection_, bytes != nullptr ? bytes->Length() : 0, ConnectionTable::Clock::now());
  }

  ConnectionTable& connections_;
  const CallKind kind_;
  const ConnectionTable::ConnectionId connection_;
  const bool has_bytes_;
  std::atomic<bool> has_request_ = false;  // Messages may come while the status goes out.
  bool served_ = false;
};

class CountedCalls final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CountedCalls(ConnectionTable& connections) : connections_(connections) {}

  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override {
    return new CountedCall(connections_, parse_peer(info->server_context()->peer()), info->method());
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
