// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// preview_bench: pictures of planes through the samples, and points in them, from a server process and through the
// client library. How long pictures take one by one, how old what is shown is in a drag, and both beside whole jobs;
// how many points a second are probed. A table of figures, each beside its bar. Exit code 1 if one is missed.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/meshes/mesh_convert.h"
#include "client/client.h"
#include "client/mesh_bytes.h"
#include "client/preview.h"
#include "core/models/models.h"
#include "tests/bench/bars.h"
#include "tests/integration/running_server.h"

namespace ccslice::bench {
namespace {

using Clock = std::chrono::steady_clock;
using client::PreviewPicture;
using client::PreviewStream;

constexpr std::uint32_t kPixels = 512;
constexpr int kPlanes = 50;
constexpr std::size_t kPointsAlone = 500;
constexpr int kProbeRuns = 3;
constexpr double kRingPoints = 900'000;  // A second: what it was when points were solved one after the other.

struct Options {
  std::vector<std::string> parts = {"pictures", "drag", "busy", "probes"};
  std::vector<std::string> models = {"ring", "coyote", "engine", "bracket", "grid"};
  double seconds = 20;
  std::size_t points = 1'000'000;
  std::string json;

  bool wants(const char* part) const { return std::find(parts.begin(), parts.end(), part) != parts.end(); }
};

double ms_since(Clock::time_point then) {
  return std::chrono::duration<double, std::milli>(Clock::now() - then).count();
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

/// A sample on a server.
struct Subject {
  std::string name, id, channel;
  Box3 box;
};

Subject upload(client::Client& client, const std::string& name) {
  const std::span<const SampleModel> models = sample_models();
  const auto model = std::ranges::find_if(models, [&](const SampleModel& m) { return m.name == name; });
  if (model == models.end()) throw std::runtime_error("there is no sample " + name);
  const ControlMesh mesh = model->make();
  const auto bytes = std::make_shared<const client::MeshBytes>(cli::to_proto(mesh));
  const v1::MeshSummary summary = client.ensure_uploaded(bytes).mesh;
  const v1::Box3& box = summary.bounding_box();
  return {name, bytes->id(), summary.channels(0).name(),
          Box3(Vec3(box.min_mm().x(), box.min_mm().y(), box.min_mm().z()),
               Vec3(box.max_mm().x(), box.max_mm().y(), box.max_mm().z()))};
}

void set(const Vec3& value, v1::Vector3& message) {
  message.set_x(value.x());
  message.set_y(value.y());
  message.set_z(value.z());
}

/// 512 x 512 pixels of a channel round the part, across a share of its extent along the normal.
v1::PreviewRequest plane_request(const Subject& subject, const Vec3& normal, double share) {
  const Vec3 n = normal.normalized();
  const Vec3 half = 0.5 * subject.box.sizes();
  const double reach = n.cwiseAbs().dot(half);
  Vec3 up = Vec3::UnitZ() - n.z() * n;
  if (up.norm() < 1e-9) up = Vec3::UnitY();
  up.normalize();
  v1::PreviewRequest request;
  request.set_mesh_id(subject.id);
  v1::FreePlane& plane = *request.mutable_plane()->mutable_free();
  set(subject.box.center() + (2 * share - 1) * reach * n, *plane.mutable_middle_mm());
  set(up.cross(n), *plane.mutable_across());
  set(up, *plane.mutable_up());
  plane.set_across_mm_per_pixel(subject.box.diagonal().norm() / kPixels);
  request.set_width(kPixels);
  request.set_height(kPixels);
  request.mutable_content()->mutable_channel()->set_channel(subject.channel);
  request.set_encoding(v1::PREVIEW_ENCODING_PNG);
  request.set_coarse(true);
  return request;
}

struct Times {
  std::vector<double> coarse, full;  // ms, from the request.
};

/// One request after the other.
void time_requests(client::Client& client, const std::vector<v1::PreviewRequest>& requests, Times& times) {
  PreviewStream stream(client, requests.front().mesh_id());
  for (const v1::PreviewRequest& request : requests) {
    const auto asked = Clock::now();
    stream.ask(request);
    for (bool full = false; !full;) {
      const std::optional<PreviewPicture> picture = stream.next();
      if (!picture) throw std::runtime_error("the server ended the pictures early");
      full = picture->stage == v1::PREVIEW_STAGE_FULL;
      (full ? times.full : times.coarse).push_back(ms_since(asked));
    }
  }
  stream.done();
  while (stream.next()) {
  }
}

std::vector<v1::PreviewRequest> random_planes(const Subject& subject, bool oblique, int count) {
  std::mt19937 random(20261125);
  std::uniform_real_distribution<double> share(0.05, 0.95);
  std::normal_distribution<double> gauss;
  std::vector<v1::PreviewRequest> requests;
  for (int i = 0; i < count; ++i) {
    const Vec3 normal = oblique ? Vec3(gauss(random), gauss(random), gauss(random)) : Vec3(Vec3::Unit(i % 3));
    requests.push_back(plane_request(subject, normal, share(random)));
  }
  return requests;
}

void measure_pictures(client::Client& client, const Subject& subject, BarTable& table) {
  for (const bool oblique : {false, true}) {
    Times times;
    time_requests(client, random_planes(subject, oblique, kPlanes), times);
    const std::string what = subject.name + (oblique ? ", oblique" : ", axis-aligned");
    table.add("coarse picture, p95: " + what, percentile(times.coarse, 0.95), "ms", Bound::kAtMost, 10);
    table.add("full picture, p95: " + what, percentile(times.full, 0.95), "ms", Bound::kAtMost, 40);
  }
  // The first of a normal against those that follow along it.
  std::vector<double> firsts, others;
  std::mt19937 random(7);
  std::normal_distribution<double> gauss;
  for (int direction = 0; direction < 8; ++direction) {
    const Vec3 normal(gauss(random), gauss(random), gauss(random));
    Times times;
    std::vector<v1::PreviewRequest> requests;
    for (int step = 0; step < 8; ++step) requests.push_back(plane_request(subject, normal, 0.3 + 0.05 * step));
    time_requests(client, requests, times);
    firsts.push_back(times.full.front());
    others.insert(others.end(), times.full.begin() + 1, times.full.end());
  }
  table.add("along one normal, median full picture against the first one: " + subject.name,
            percentile(others, 0.5) / percentile(firsts, 0.5), "times", Bound::kAtMost, 0.5);
}

/// 60 requests a second; how old what is shown is, all the time.
void measure_drag(client::Client& client, const Subject& subject, double seconds, BarTable& table) {
  using std::chrono::microseconds;
  constexpr auto kFrame = microseconds(16'667);
  PreviewStream stream(client, subject.id);
  const int frames = static_cast<int>(60 * seconds);
  std::vector<Clock::time_point> asked(static_cast<std::size_t>(frames) + 1);
  std::atomic<std::uint64_t> shown{0};  // The latest request whose picture came.
  std::uint64_t coarse = 0, full = 0;
  std::thread reader([&] {
    while (const auto picture = stream.next()) {
      shown.store(std::max(shown.load(), picture->number));
      ++(picture->stage == v1::PREVIEW_STAGE_COARSE ? coarse : full);
    }
  });
  std::vector<double> ages;
  auto next = Clock::now();
  for (int frame = 1; frame <= frames; ++frame) {
    std::this_thread::sleep_until(next);
    next += kFrame;
    const double share = 0.5 + 0.4 * std::sin(2 * std::numbers::pi * frame / 240.0);
    asked[static_cast<std::size_t>(frame)] = Clock::now();
    stream.ask(plane_request(subject, Vec3(1, 2, 3), share));
    if (const std::uint64_t number = shown.load()) ages.push_back(ms_since(asked[number]));
  }
  stream.done();
  reader.join();
  table.add("drag, age of what is shown, p99: " + subject.name, percentile(ages, 0.99), "ms", Bound::kAtMost, 100);
  table.note("drag, coarse pictures: " + subject.name, static_cast<double>(coarse) / seconds, "a second");
  table.note("drag, full pictures: " + subject.name, static_cast<double>(full) / seconds, "a second");
}

/// The same beside whole jobs.
void measure_busy(client::Client& client, const Subject& subject, const std::string& address, BarTable& table) {
  Times idle, busy;
  time_requests(client, random_planes(subject, true, kPlanes), idle);
  client::Cancellation cancellation;
  std::vector<std::thread> jobs;
  for (int job = 0; job < 8; ++job) {
    jobs.emplace_back([&] {
      client::Client own({.address = address});
      v1::SliceRangeRequest request;
      v1::SliceJob& asked = *request.mutable_job();
      asked.add_parts()->set_mesh_id(subject.id);
      const double pitch = subject.box.sizes().maxCoeff() / 1500;
      asked.mutable_grid()->mutable_pitch()->set_x_mm(pitch);
      asked.mutable_grid()->mutable_pitch()->set_y_mm(pitch);
      asked.mutable_grid()->mutable_pitch()->set_z_mm(pitch);
      v1::PlaneSpec& plane = *asked.add_planes();
      plane.mutable_channel()->set_name(subject.channel);
      plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
      v1::PlanSlicesRequest plan;
      *plan.mutable_job() = asked;
      request.set_layer_count(own.plan(plan).layer_count());
      try {
        for (;;)
          own.slice(request, [](const v1::SliceHeader&, const client::Layer&) {}, {.cancellation = &cancellation});
      } catch (const client::ClientError&) {
        return;  // Cancelled.
      }
    });
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));
  time_requests(client, random_planes(subject, true, kPlanes), busy);
  cancellation.cancel();
  for (std::thread& job : jobs) job.join();
  table.add("beside 8 jobs, full picture, p95, against an idle server: " + subject.name,
            percentile(busy.full, 0.95) / percentile(idle.full, 0.95), "times", Bound::kAtMost, 5);
}

/// All over the part's box: x, y, z of each.
std::vector<double> random_points(const Subject& subject, std::size_t count) {
  std::mt19937_64 random(20261125);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<double> points;
  for (std::size_t p = 0; p < count; ++p) {
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back(subject.box.min()[axis] + share(random) * subject.box.sizes()[axis]);
    }
  }
  return points;
}

/// Each of some points alone, in a call of its own: how many answers aren't the same to the last bit.
int differing_alone(client::Client& client, const Subject& subject, const std::vector<double>& points,
                    const std::vector<v1::ProbePointsResponse>& answers) {
  int differing = 0;
  const int per_answer = answers.front().locations_size();
  for (std::size_t i = 0; i < kPointsAlone; ++i) {
    const std::size_t p = i * (points.size() / 3) / kPointsAlone;
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(3 * p);
    const v1::ProbePointsResponse alone = client.probe(subject.id, {}, {first, first + 3}).front();
    const v1::ProbePointsResponse& together = answers[p / static_cast<std::size_t>(per_answer)];
    const int at = static_cast<int>(p) % per_answer, channels = alone.channel_values_size();
    const auto same = [](const auto& one, const auto& all, int begin) {
      return std::equal(one.begin(), one.end(), all.begin() + begin);
    };
    const bool equal =
        same(alone.locations(), together.locations(), at) && same(alone.limit_cells(), together.limit_cells(), at) &&
        same(alone.control_cells(), together.control_cells(), at) && same(alone.uvw(), together.uvw(), 3 * at) &&
        same(alone.channel_values(), together.channel_values(), channels * at) &&
        same(alone.residuals_mm(), together.residuals_mm(), at);
    differing += equal ? 0 : 1;
  }
  return differing;
}

/// Points of one call; the median of some runs.
void measure_probes(client::Client& client, const Subject& subject, std::size_t count, BarTable& table) {
  const std::map<std::string, double> bars = {
      {"ring", kRingPoints}, {"coyote", 500'000}, {"engine", 200'000}, {"bracket", 200'000}, {"grid", 40'000}};
  const std::vector<double> points = random_points(subject, count);
  std::vector<double> rates;
  std::vector<v1::ProbePointsResponse> answers;
  for (int run = 0; run < kProbeRuns; ++run) {
    answers.clear();
    const auto asked = Clock::now();
    answers = client.probe(subject.id, {}, points);
    rates.push_back(static_cast<double>(count) / (1e-3 * ms_since(asked)));
  }
  const std::string figure = "points probed, two threads: " + subject.name;
  const auto bar = bars.find(subject.name);
  if (bar != bars.end()) {
    table.add(figure, percentile(rates, 0.5), "a second", Bound::kAtLeast, bar->second);
  } else {
    table.note(figure, percentile(rates, 0.5), "a second");
  }
  table.add("of 500 points probed alone, answers that differ: " + subject.name,
            differing_alone(client, subject, points, answers), "points", Bound::kAtMost, 0);
}

void run_probes(const Options& options, BarTable& table) {
  ccslice::server::RunningServer server({"--threads=2"});
  client::Client client({.address = server.address()});
  for (const std::string& name : options.models) measure_probes(client, upload(client, name), options.points, table);
}

void run_pictures(const Options& options, BarTable& table) {
  ccslice::server::RunningServer server({"--threads=1"});
  client::Client client({.address = server.address()});
  for (const std::string& name : options.models) {
    const Subject subject = upload(client, name);
    if (options.wants("pictures")) measure_pictures(client, subject, table);
    if (options.wants("drag")) measure_drag(client, subject, options.seconds, table);
    if (options.wants("busy")) measure_busy(client, subject, server.address(), table);
  }
}

int run(const Options& options) {
  BarTable table;
  if (options.wants("pictures") || options.wants("drag") || options.wants("busy")) run_pictures(options, table);
  if (options.wants("probes")) run_probes(options, table);
  if (!options.json.empty()) table.write_json(options.json);
  return table.missed() > 0 ? 1 : 0;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  Options options;
  CLI::App app(
      "Measures previews: a server of one thread, pictures of 512 x 512 pixels of one channel; one of two, points.");
  app.add_option("--parts", options.parts, "pictures, drag, busy, probes")->delimiter(',');
  app.add_option("--models", options.models, "Samples")->delimiter(',');
  app.add_option("--seconds", options.seconds, "Of each drag")->capture_default_str();
  app.add_option("--points", options.points, "Probed in each sample")
      ->check(CLI::Range(kPointsAlone, std::size_t{100'000'000}))
      ->capture_default_str();
  app.add_option("--json", options.json, "Write the figures to this file, too");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "preview_bench: %s\n", error.what());
    return 2;
  }
}
