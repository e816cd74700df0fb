// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/preparation_watch.h"

#include <chrono>
#include <utility>

#include "client/call.h"

namespace ccslice::client {
namespace {

constexpr std::chrono::milliseconds kPause{500};
constexpr std::chrono::seconds kLongestAnswer{5};

/// Another server than the one that prepares may know nothing of the mesh, hold it already, or be less far.
bool is_further(const v1::GetPreparationResponse& answer, const v1::GetPreparationResponse& last) {
  if (answer.phase() >= v1::PREPARATION_PHASE_PREPARED) return false;
  return std::pair(answer.phase(), answer.done_cells()) > std::pair(last.phase(), last.done_cells());
}

}  // namespace

PreparationWatch::PreparationWatch(const Endpoint& endpoint, std::string mesh_id, const PreparationReport& report,
                                   grpc::ClientContext& waiting)
    : endpoint_(endpoint), mesh_id_(std::move(mesh_id)), report_(report), waiting_(waiting) {
  if (report_) thread_ = std::thread([this] { run(); });
}

PreparationWatch::~PreparationWatch() { end(); }

void PreparationWatch::stop() {
  end();
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
}

void PreparationWatch::end() {
  over_.cancel();
  if (thread_.joinable()) thread_.join();
}

void PreparationWatch::run() {
  try {
    while (!over_.wait_for(kPause) && ask()) continue;
  } catch (...) {
    return;  // It is over, or the token can't be read, of which the call speaks. An upload fails of nothing here.
  }
}

bool PreparationWatch::ask() {
  const CallOptions options{.deadline = std::chrono::system_clock::now() + kLongestAnswer, .cancellation = &over_};
  Call one(options, endpoint_, mesh_id_);
  v1::GetPreparationRequest request;
  request.set_mesh_id(mesh_id_);
  v1::GetPreparationResponse answer;
  const grpc::Status status = endpoint_.stub->GetPreparation(&one.context(), request, &answer);
  if (!status.ok()) return status.error_code() != grpc::StatusCode::UNIMPLEMENTED;
  if (!is_further(answer, last_)) return true;
  last_ = answer;
  try {
    report_(answer);
    return true;
  } catch (...) {
    thrown_ = std::current_exception();
    waiting_.TryCancel();
    return false;
  }
}

}  // namespace ccslice::client
