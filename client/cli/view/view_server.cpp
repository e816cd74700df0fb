// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/view/view_server.h"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <bit>
#include <exception>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/base/message_json.h"
#include "client/cli/view/growing_pool.h"
#include "client/cli/view/view_guard.h"
#include "client/cli/view/view_previews.h"
#include "client/cli/view/web_files.h"
#include "client/client_error.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr std::size_t kMostBodyBytes = 4 << 20, kMostSessionBytes = 256;
constexpr const char* kSessionPath = "/api/session";
constexpr int kBadRequest = 400, kConflict = 409, kNotFound = 404, kLengthRequired = 411, kBadRange = 416,
              kTooMany = 429, kInternal = 500, kAway = 503;

void answer_error(int status, const std::string& reason, const std::string& message, httplib::Response& response) {
  v1::FailureDocument document;
  document.mutable_error()->set_reason(reason);
  document.mutable_error()->set_message(message);
  response.status = status;
  response.set_content(json_of(document), "application/json");
}

int status_of(const client::ClientError& error) {
  switch (error.code()) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE: return kBadRequest;
    case grpc::StatusCode::NOT_FOUND:
    case grpc::StatusCode::FAILED_PRECONDITION: return kNotFound;
    case grpc::StatusCode::RESOURCE_EXHAUSTED: return kTooMany;
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DEADLINE_EXCEEDED: return kAway;
    default: return kInternal;
  }
}

/// Whether the body is such a message; otherwise the answer says what is wrong.
bool parse(const httplib::Request& request, google::protobuf::Message& message, httplib::Response& response) {
  const auto status = google::protobuf::util::JsonStringToMessage(request.body, &message);
  if (status.ok()) return true;
  answer_error(kBadRequest, "REQUEST_MALFORMED",
               "the body isn't a " + message.GetDescriptor()->name() + " as JSON: " + std::string(status.message()),
               response);
  return false;
}

/// Reads the token of {"token": "..."}. Empty if the body isn't that, or is longer than any: anybody may send one.
std::string token_of(const httplib::Request& request) {
  if (request.body.size() > kMostSessionBytes) return {};
  google::protobuf::Struct session;
  if (!google::protobuf::util::JsonStringToMessage(request.body, &session).ok()) return {};
  const auto found = session.fields().find("token");
  return found == session.fields().end() ? std::string() : found->second.string_value();
}

ViewRequest headers_of(const httplib::Request& request, std::array<std::string, 4>& texts) {
  texts = {request.get_header_value("Host"), request.get_header_value("Origin"), request.get_header_value("Cookie"),
           request.get_header_value("Authorization")};
  return {texts[0], texts[1], texts[2], texts[3]};
}

template <typename Number>
void append(const std::vector<Number>& numbers, std::string& bytes) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof(Number) * numbers.size());
}

/// 4-byte numbers, little-endian: x, y, z of every vertex, the channel of every vertex, three vertices a triangle.
std::string surface_bytes(const client::Surface& surface, std::optional<std::size_t> channel) {
  std::vector<float> numbers;
  for (const std::array<double, 3>& point : surface.points_mm) {
    for (const double x : point) numbers.push_back(static_cast<float>(x));
  }
  const auto channels = static_cast<std::size_t>(surface.header.channels_size());
  for (std::size_t v = 0; channel && v < surface.points_mm.size(); ++v) {
    numbers.push_back(surface.channel_values[channels * v + *channel]);
  }
  std::string bytes;
  append(numbers, bytes);
  append(surface.triangles, bytes);
  return bytes;
}

const char* type_of(std::string_view path) {
  if (path.ends_with(".css")) return "text/css; charset=utf-8";
  return path.ends_with(".js") ? "text/javascript; charset=utf-8" : "text/html; charset=utf-8";
}

}  // namespace

struct ViewServer::State {
  State(Session& the_session, ViewedMesh the_mesh)
      : session(the_session), mesh(std::move(the_mesh)), pages(the_session.client()) {}

  Session& session;
  ViewedMesh mesh;
  ViewPages pages;
  httplib::Server server;
  std::map<std::string, httplib::Server::Handler> gets;  // By path.
  std::unique_ptr<ViewGuard> guard;
  int port = 0;

  void add_get(const std::string& path, httplib::Server::Handler handler) {
    server.Get(path, gets[path] = std::move(handler));
  }
  void add_files();
  void add_calls();
  /// Before a body is read.
  httplib::Server::HandlerResponse admit(const httplib::Request& request, httplib::Response& response);
  /// The library refuses ranges that are none before anybody can tell it to ignore them.
  httplib::Server::HandlerResponse answer_in_spite_of_range(const httplib::Request& request,
                                                            httplib::Response& response);
  /// A handler whose errors become answers.
  template <typename Handle>
  httplib::Server::Handler answering(Handle handle);
  std::shared_ptr<const client::PreviewPicture> shown(const v1::PreviewRequest& asked, const std::string& page);
  /// A request, or a job, that names no mesh is of the one that is viewed.
  template <typename Message>
  void take_viewed(Message& asked) const {
    if (asked.mesh_id().empty()) asked.set_mesh_id(mesh.id);
  }
  void take_viewed(v1::SliceJob& job) const {
    if (job.parts().empty()) job.add_parts();
    take_viewed(*job.mutable_parts(0));
  }
  void show(const httplib::Request& request, httplib::Response& response);
  void probe(const httplib::Request& request, httplib::Response& response);
  void plan(const httplib::Request& request, httplib::Response& response);
  void tessellate(const httplib::Request& request, httplib::Response& response);
  void list(httplib::Response& response);
};

template <typename Handle>
httplib::Server::Handler ViewServer::State::answering(Handle handle) {
  return [handle](const httplib::Request& request, httplib::Response& response) {
    try {
      handle(request, response);
    } catch (const client::ClientError& error) {
      answer_error(status_of(error), error.reason(), error.what(), response);
    } catch (const std::exception& error) {
      answer_error(kInternal, "INTERNAL", error.what(), response);
    }
  };
}

void ViewServer::State::add_files() {
  for (const WebFile& file : web_files()) {
    const auto serve = [&file](const httplib::Request&, httplib::Response& response) {
      response.set_content(file.text.data(), file.text.size(), type_of(file.path));
    };
    add_get(std::string(file.path), serve);
    if (file.path == "/index.html") add_get("/", serve);
  }
}

void ViewServer::State::show(const httplib::Request& request, httplib::Response& response) {
  v1::PreviewRequest asked;
  if (!parse(request, asked, response)) return;
  asked.plane().has_layer() ? take_viewed(*asked.mutable_plane()->mutable_layer()->mutable_job()) : take_viewed(asked);
  asked.set_encoding(v1::PREVIEW_ENCODING_PNG);
  asked.set_coarse(request.get_param_value("stage") == "coarse");
  const auto picture = shown(asked, request.get_param_value("page"));
  if (!picture) return answer_error(kConflict, "STALE", "a newer picture has been asked for", response);
  response.set_header("Ccslice-Preview", protobuf_json(picture->header, true));
  response.set_content(picture->bytes, "image/png");
}

/// A server that has lost the mesh gets it again.
std::shared_ptr<const client::PreviewPicture> ViewServer::State::shown(const v1::PreviewRequest& asked,
                                                                       const std::string& page) {
  const std::shared_ptr<ViewPreviews> previews = pages.of(page);
  try {
    return previews->show(asked);
  } catch (const client::ClientError& error) {
    if (error.missing_mesh_id().empty()) throw;
  }
  (void)session.client().mesh_summary(client::mesh_id_of(asked), session.call());
  return previews->show(asked);
}

void ViewServer::State::probe(const httplib::Request& request, httplib::Response& response) {
  v1::ProbePointsRequest asked;
  if (!parse(request, asked, response)) return;
  const std::vector<double> points(asked.points_mm().begin(), asked.points_mm().end());
  if (points.empty() || points.size() % 3 != 0) {
    return answer_error(kBadRequest, "REQUEST_MALFORMED", "points_mm: give 3 numbers a point, and one point at least",
                        response);
  }
  const std::string id = asked.mesh_id().empty() ? mesh.id : asked.mesh_id();
  const auto answers = session.client().probe(id, asked.placement(), points, session.call());
  v1::ProbePointsResponse all;
  for (const v1::ProbePointsResponse& answer : answers) all.MergeFrom(answer);
  response.set_content(protobuf_json(all, true), "application/json");
}

void ViewServer::State::plan(const httplib::Request& request, httplib::Response& response) {
  v1::PlanSlicesRequest asked;
  if (!parse(request, asked, response)) return;
  take_viewed(*asked.mutable_job());
  response.set_content(protobuf_json(session.client().plan(asked, session.call()), true), "application/json");
}

void ViewServer::State::tessellate(const httplib::Request& request, httplib::Response& response) {
  v1::TessellateBoundaryRequest asked;
  if (!parse(request, asked, response)) return;
  take_viewed(asked);
  client::Surface surface = session.client().tessellate(asked, session.call());
  std::optional<std::size_t> channel;
  if (request.has_param("channel")) {
    const std::string name = request.get_param_value("channel");
    const auto& channels = surface.header.channels();
    const auto found = std::ranges::find(channels, name, [](const v1::Channel& each) { return each.name(); });
    if (found == channels.end()) {
      return answer_error(kBadRequest, "CHANNEL_UNKNOWN", "channel: there is no channel " + echoed(name), response);
    }
    channel = static_cast<std::size_t>(found - channels.begin());
  }
  const std::string bytes = surface_bytes(surface, channel);
  surface.header.clear_channels();  // Of the mesh's summary, and perhaps too many for a header.
  response.set_header("Ccslice-Surface", protobuf_json(surface.header, true));
  response.set_content(bytes, "application/octet-stream");
}

void ViewServer::State::list(httplib::Response& response) {
  v1::ViewedMeshes viewed;
  viewed.set_first(mesh.id);
  viewed.set_name(mesh.name);
  const std::vector<v1::MeshSummary> meshes = session.client().list_meshes(session.call());
  *viewed.mutable_meshes() = {meshes.begin(), meshes.end()};
  response.set_content(protobuf_json(viewed, true), "application/json");
}

void ViewServer::State::add_calls() {
  server.Post(kSessionPath, [this](const httplib::Request& request, httplib::Response& response) {
    if (!guard->is_token(token_of(request))) {
      const auto refusal = guard->refuse_without_token({});
      return answer_error(refusal->status, "TOKEN_MISSING", refusal->message, response);
    }
    constexpr int kNoContent = 204;
    response.status = kNoContent;
    response.set_header("Set-Cookie", guard->cookie());
  });
  add_get("/api/meshes", answering([this](const httplib::Request&, httplib::Response& r) { list(r); }));
  server.Post("/api/preview", answering([this](const httplib::Request& q, httplib::Response& r) { show(q, r); }));
  server.Post("/api/plan", answering([this](const httplib::Request& q, httplib::Response& r) { plan(q, r); }));
  server.Post("/api/boundary",
              answering([this](const httplib::Request& q, httplib::Response& r) { tessellate(q, r); }));
  server.Post("/api/probe", answering([this](const httplib::Request& q, httplib::Response& r) { probe(q, r); }));
}

httplib::Server::HandlerResponse ViewServer::State::admit(const httplib::Request& request,
                                                          httplib::Response& response) {
  std::array<std::string, 4> texts;
  if (const auto refusal = guard->refuse_stranger(headers_of(request, texts))) {
    answer_error(refusal->status, "STRANGER", refusal->message, response);
    return httplib::Server::HandlerResponse::Handled;
  }
  // The library bounds bodies by the length that they announce: chunked ones not at all, nor what packed ones become.
  if (request.has_header("Transfer-Encoding") || request.has_header("Content-Encoding")) {
    answer_error(kLengthRequired, "REQUEST_MALFORMED", "a body needs a Content-Length, and no Content-Encoding",
                 response);
    return httplib::Server::HandlerResponse::Handled;
  }
  if (request.path.starts_with("/api/") && request.path != kSessionPath) {
    if (const auto refusal = guard->refuse_without_token(headers_of(request, texts))) {
      answer_error(refusal->status, "TOKEN_MISSING", refusal->message, response);
      return httplib::Server::HandlerResponse::Handled;
    }
  }
  // A thousand ranges of a file would be a thousand copies of it. Servers may ignore ranges.
  const_cast<httplib::Request&>(request).ranges.clear();
  return httplib::Server::HandlerResponse::Unhandled;
}

httplib::Server::HandlerResponse ViewServer::State::answer_in_spite_of_range(const httplib::Request& request,
                                                                             httplib::Response& response) {
  const auto get = gets.find(request.path);
  if (request.method != "GET" || get == gets.end()) return httplib::Server::HandlerResponse::Unhandled;
  constexpr int kOk = 200;
  response.status = kOk;
  if (admit(request, response) == httplib::Server::HandlerResponse::Unhandled) get->second(request, response);
  return httplib::Server::HandlerResponse::Handled;
}

ViewServer::ViewServer(Session& session, ViewedMesh mesh, std::uint16_t port)
    : state_(std::make_unique<State>(session, std::move(mesh))) {
  State& state = *state_;
  constexpr const char* kLoopback = "127.0.0.1";
  // By itself the library lets several programs share a port (SO_REUSEPORT): pages would get now one part, now another.
  state.server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  // An answer is written in pieces. Otherwise the last one waits for 40 ms until the browser acknowledges the others.
  state.server.set_tcp_nodelay(true);
  state.port = port == 0 ? state.server.bind_to_any_port(kLoopback) : port;
  if (state.port <= 0 || (port != 0 && !state.server.bind_to_port(kLoopback, port))) {
    throw Error(ErrorCode::kFileUnwritable,
                "port " + std::to_string(port) + " is taken: leave --port out, or give another one");
  }
  state.guard = std::make_unique<ViewGuard>(static_cast<std::uint16_t>(state.port), random_token());
  state.server.set_payload_max_length(kMostBodyBytes);
  constexpr std::size_t kMostConnections = 500;  // Which select() can tell apart, with all else that is open.
  state.server.new_task_queue = [] { return new GrowingPool(kMostConnections); };
  constexpr std::size_t kRequestsPerConnection = 1000;  // By itself the library ends a connection after five.
  state.server.set_keep_alive_max_count(kRequestsPerConnection);
  state.server.set_default_headers({
      {"Content-Security-Policy",
       "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
       "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
      {"X-Content-Type-Options", "nosniff"},
      {"Referrer-Policy", "no-referrer"},
      {"Cache-Control", "no-store"},
  });
  state.server.set_pre_routing_handler([&state](const httplib::Request& q, httplib::Response& r) {  //
    return state.admit(q, r);
  });
  const httplib::Server::HandlerWithResponse on_error = [&state](const httplib::Request& q, httplib::Response& r) {
    return r.status == kBadRange ? state.answer_in_spite_of_range(q, r) : httplib::Server::HandlerResponse::Unhandled;
  };
  state.server.set_error_handler(on_error);
  state.add_files();
  state.add_calls();
}

ViewServer::~ViewServer() = default;

std::string ViewServer::address() const {
  return "http://127.0.0.1:" + std::to_string(state_->port) + "/#token=" + state_->guard->token();
}

void ViewServer::run() { state_->server.listen_after_bind(); }

bool ViewServer::is_running() const { return state_->server.is_running(); }

void ViewServer::stop() { state_->server.stop(); }

}  // namespace ccslice::cli
