// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/call_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <random>
#include <string_view>

#include "server/rpc/convert/status.h"

namespace ccslice::server {
namespace {

/// Names by code, as gRPC's documentation has them.
constexpr std::array<const char*, 17> kCodeNames = {
    "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};

const char* name_of(grpc::StatusCode code) {
  const auto index = static_cast<std::size_t>(code);
  return index < kCodeNames.size() ? kCodeNames[index] : "UNKNOWN";
}

constexpr std::size_t kMaxRequestIdBytes = 128;

std::string metadata_of(const grpc::CallbackServerContext& context, const char* name) {
  const auto found = context.client_metadata().find(name);
  if (found == context.client_metadata().end()) return "";
  return {found->second.data(), found->second.size()};
}

bool is_request_id(std::string_view text) {
  return !text.empty() && text.size() <= kMaxRequestIdBytes &&
         std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

/// 128 random bits.
std::string make_request_id() {
  thread_local std::mt19937_64 random{std::random_device()()};
  return fmt::format("{:016x}{:016x}", random(), random());
}

/// Calls that last as long as their clients like.
bool is_conversation(std::string_view method) {
  return method == "Preview" || method == "ProbePoints" || method == "EvaluatePoints";
}

/// Asked again and again by everybody who waits: lines and times of it would bury those of other calls.
bool is_poll(std::string_view method) { return method == "GetPreparation"; }

double ms_of(std::chrono::nanoseconds time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

std::string trace_id_of(std::string_view traceparent) {
  constexpr std::size_t kVersion = 2, kTrace = 32, kSpan = 16, kFlags = 2;
  constexpr std::size_t kBytes = kVersion + 1 + kTrace + 1 + kSpan + 1 + kFlags;
  if (traceparent.size() < kBytes || traceparent[kVersion] != '-' || traceparent[kVersion + 1 + kTrace] != '-')
    return "";
  const std::string_view trace = traceparent.substr(kVersion + 1, kTrace);
  const bool good =
      std::all_of(trace.begin(), trace.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  const bool is_null = trace.find_first_not_of('0') == std::string_view::npos;
  return good && !is_null && !traceparent.starts_with("ff") ? std::string(trace) : "";
}

CallLog::CallLog(grpc::CallbackServerContext& context, const char* method, Metrics& metrics)
    : method_(method),
      metrics_(metrics),
      peer_(context.peer()),
      start_(std::chrono::steady_clock::now()),
      request_id_(metadata_of(context, "x-request-id")),
      trace_id_(trace_id_of(metadata_of(context, "traceparent"))) {
  if (!is_request_id(request_id_)) request_id_ = make_request_id();
  context.AddTrailingMetadata("x-request-id", request_id_);
}

void CallLog::note(const std::string& text) {
  const std::lock_guard lock(mutex_);
  notes_ += " " + text;
}

void CallLog::add_bytes(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  bytes_ += bytes;
}

void CallLog::note_mesh(const std::string& mesh_id) {
  note(mesh_id);
  const std::lock_guard lock(mutex_);
  noted_.push_back({"mesh", mesh_id});
}

void CallLog::note_layers(std::uint32_t first, std::uint32_t count) {
  note("layers " + std::to_string(first) + "+" + std::to_string(count));
  const std::lock_guard lock(mutex_);
  noted_.push_back({"first_layer", std::uint64_t{first}});
  noted_.push_back({"layers", std::uint64_t{count}});
}

void CallLog::note_wait(Awaited awaited, std::chrono::nanoseconds waited) {
  (awaited == Awaited::kPlace ? metrics_.seconds_for_place : metrics_.seconds_for_memory).add(waited);
  const std::lock_guard lock(mutex_);
  waited_ = waited_.value_or(std::chrono::nanoseconds(0)) + waited;
}

std::vector<LogField> CallLog::fields_locked(const grpc::Status& status) const {
  std::vector<LogField> fields = {{"method", std::string(method_)},
                                  {"client", client_},
                                  {"peer", peer_},
                                  {"status", std::string(name_of(status.error_code()))},
                                  {"reason", reason_of(status)},
                                  {"ms", ms_of(elapsed())},
                                  {"request_id", request_id_}};
  if (!trace_id_.empty()) fields.push_back({"trace_id", trace_id_});
  if (bytes_ > 0) fields.push_back({"bytes", bytes_});
  if (waited_) fields.push_back({"queue_ms", ms_of(*waited_)});
  fields.insert(fields.end(), noted_.begin(), noted_.end());
  return fields;
}

void CallLog::finish(const grpc::Status& status) const {
  const std::string reason = reason_of(status);
  const char* const name = name_of(status.error_code());
  metrics_.calls.add(method_, reason.empty() ? name : reason);
  if (!is_conversation(method_) && !is_poll(method_)) metrics_.seconds_in_all.add(elapsed());
  const std::lock_guard lock(mutex_);
  if (status.ok()) {
    log_with_fields(is_poll(method_) ? LogLevel::kDebug : LogLevel::kInfo,
                    fmt::format("{} from {}: OK in {:.1f} ms{}", method_, peer_, ms_of(elapsed()), notes_),
                    fields_locked(status));
    return;
  }
  const LogLevel level = status.error_code() == grpc::StatusCode::INTERNAL ? LogLevel::kError : LogLevel::kInfo;
  log_with_fields(level,
                  fmt::format("{} from {}: {} {} in {:.1f} ms{}: {}", method_, peer_, name, reason, ms_of(elapsed()),
                              notes_, status.error_message()),
                  fields_locked(status));
}

bool deadline_passed(const grpc::CallbackServerContext& context) {
  return std::chrono::system_clock::now() >= context.deadline();
}

}  // namespace ccslice::server
