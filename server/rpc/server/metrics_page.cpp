// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/server/metrics_page.h"

#include <google/protobuf/descriptor.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "core/base/engine_version.h"
#include "core/base/version.h"
#include "server/service/base/logging.h"
#include "server/service/scheduling/heap_trim.h"

namespace ccslice::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

/// Families in the order in which they are added; samples go to the last one.
class Families {
 public:
  void begin(const std::string& name, const std::string& help, MetricType type) {
    families_.push_back({.name = "ccslice_" + name, .help = help, .type = type, .metric = {}});
  }
  void add(double value, Labels labels = {}) {
    ClientMetric& sample = families_.back().metric.emplace_back();
    sample.label = std::move(labels);
    (families_.back().type == MetricType::Counter ? sample.counter.value : sample.gauge.value) = value;
  }
  void add(std::uint64_t value, Labels labels = {}) { add(static_cast<double>(value), std::move(labels)); }
  void gauge(const std::string& name, const std::string& help, std::uint64_t value) {
    begin(name, help, MetricType::Gauge);
    add(value);
  }
  void counter(const std::string& name, const std::string& help, std::uint64_t value) {
    begin(name, help, MetricType::Counter);
    add(value);
  }
  void histogram(const std::string& name, const std::string& help, const DurationHistogram& durations) {
    histograms(name, help, {{{}, &durations}});
  }
  void histograms(const std::string& name, const std::string& help,
                  const std::vector<std::pair<Labels, const DurationHistogram*>>& all) {
    begin(name, help, MetricType::Histogram);
    for (const auto& [labels, durations] : all) add(*durations, labels);
  }
  std::string text() const { return prometheus::TextSerializer().Serialize(families_); }

 private:
  void add(const DurationHistogram& durations, const Labels& labels) {
    const DurationHistogram::Counts counts = durations.counts();
    ClientMetric& sample = families_.back().metric.emplace_back();
    sample.label = labels;
    ClientMetric::Histogram& histogram = sample.histogram;
    histogram.sample_count = counts.all;
    histogram.sample_sum = counts.sum_s;
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < counts.in.size(); ++i) {
      below += counts.in[i];
      const double bound = i < DurationHistogram::kBounds.size() ? DurationHistogram::kBounds[i]
                                                                 : std::numeric_limits<double>::infinity();
      histogram.bucket.push_back({.cumulative_count = below, .upper_bound = bound});
    }
  }

  std::vector<MetricFamily> families_;
};

void add_calls(ServiceState& state, Families& families) {
  const Metrics& metrics = state.metrics;
  families.begin("calls_total", "Calls that ended, by method and reason (OK, or why they failed).",
                 MetricType::Counter);
  std::map<CallCounts::Key, std::uint64_t> counts = metrics.calls.counts();
  // Rates want a beginning at zero: else the first call that ends well is one of which nobody knows.
  const auto& service =
      *google::protobuf::DescriptorPool::generated_pool()->FindServiceByName("ccslice.v1.SlicerService");
  for (int i = 0; i < service.method_count(); ++i) counts.try_emplace({service.method(i)->name(), "OK"}, 0);
  for (const auto& [key, count] : counts) families.add(count, {{"method", key.first}, {"reason", key.second}});
  families.histograms(
      "queue_seconds", "Waits of calls, those in vain too: for a place among the running ones, and for memory.",
      {{{{"awaited", "place"}}, &metrics.seconds_for_place}, {{{"awaited", "memory"}}, &metrics.seconds_for_memory}});
  families.histogram("first_layer_seconds", "From the begin of SliceRange calls to their first layer.",
                     metrics.seconds_to_first_layer);
  families.histogram("call_seconds", "Of whole calls, without previews, points and GetPreparation.",
                     metrics.seconds_in_all);
  families.gauge("calls_running", "Calls that have a place.", state.admission.running());
  families.gauge("calls_waiting", "Calls that wait for a place or for memory.", state.admission.waiting());
  families.gauge("calls_waiting_for_memory", "Of those, calls for which there is a place, and no memory.",
                 state.admission.waiting_for_memory());
  families.gauge("call_places", "Calls that may run at the same time, a fifth of them short ones alone.",
                 state.options.max_concurrent_calls + state.options.max_concurrent_calls / kShortShareOfCalls);
  families.gauge("calls_open", "Calls whose status isn't on its way.", state.calls.open());
  families.counter("calls_shed_total", "Times that a call gave back what it held, as its client didn't read.",
                   metrics.shed);
  families.counter("calls_gave_way_total",
                   "Times that a call gave back what it held, for a client of whom fewer calls run.", metrics.gave_way);
  families.counter("layers_total", "Layers on their way to clients.", metrics.layers);
  families.counter("voxels_total", "Voxels inside parts, of those layers.", metrics.voxels);
  families.counter("layer_bytes_total", "Encoded bytes of those layers.", metrics.layer_bytes);
  families.counter("preview_pictures_total", "Pictures of previews.", metrics.preview_pictures);
}

void add_memory(ServiceState& state, Families& families) {
  const std::vector<std::pair<std::string, const MemoryBudget*>> budgets = {{"uploads", &state.uploads},
                                                                            {"requests", &state.requests},
                                                                            {"preparations", &state.preparations},
                                                                            {"streams", &state.streams},
                                                                            {"scratch", &state.scratch}};
  families.begin("budget_used_bytes", "Memory that is reserved, by budget.", MetricType::Gauge);
  for (const auto& [name, budget] : budgets) families.add(budget->used_bytes(), {{"budget", name}});
  families.begin("budget_capacity_bytes", "Memory that may be reserved, by budget.", MetricType::Gauge);
  for (const auto& [name, budget] : budgets) families.add(budget->capacity_bytes(), {{"budget", name}});
  families.gauge("memory_bytes", "What the sizes of the options are shares of.", state.options.memory_bytes);
  families.gauge("process_resident_memory_bytes", "Memory of the process.", resident_memory_bytes());
}

void add_meshes(ServiceState& state, Families& families) {
  const CacheUse use = state.cache.use();
  families.gauge("cache_capacity_bytes", "What prepared meshes may take.", use.capacity_bytes);
  families.gauge("cache_used_bytes", "What they take.", use.used_bytes);
  families.gauge("cache_meshes", "Prepared meshes.", use.meshes);
  families.begin("cache_lookups_total", "Meshes that were looked for, by whether they were there.",
                 MetricType::Counter);
  families.add(use.hits, {{"found", "yes"}});
  families.add(use.misses, {{"found", "no"}});
  families.counter("cache_evictions_total", "Prepared meshes that were dropped for room or age.", use.evictions);
  families.begin("preparations_total", "Meshes that were prepared, by whether it came to an end.", MetricType::Counter);
  families.add(use.prepared, {{"outcome", "prepared"}});
  families.add(use.failed_preparations, {{"outcome", "failed"}});
  families.gauge("preparations_waiting", "Meshes that wait for memory to be prepared in.",
                 state.preparation_memory.waiting());
  if (!state.store) return;
  families.gauge("store_up", "1 if the mesh store worked when it was asked last, by calls or by the server itself.",
                 state.store->is_there() ? 1 : 0);
  families.begin("store_operations_total", "Of the mesh store, by kind and outcome.", MetricType::Counter);
  for (std::size_t operation = 0; operation < kStoreOperations.size(); ++operation) {
    for (std::size_t outcome = 0; outcome < kStoreOutcomes.size(); ++outcome) {
      families.add(state.store->count(static_cast<StoreOperation>(operation), static_cast<StoreOutcome>(outcome)),
                   {{"operation", kStoreOperations[operation]}, {"outcome", kStoreOutcomes[outcome]}});
    }
  }
}

/// No sample for what isn't there: one of zero would be a certificate that ended long ago.
void add_certificates(const CertificateEnds& ends, Families& families) {
  if (ends.certificate_s == 0 && ends.client_authority_s == 0) return;
  families.begin("tls_certificate_expiry_timestamp_seconds",
                 "When the first of the certificates in a file ends, in seconds since 1970.", MetricType::Gauge);
  if (ends.certificate_s != 0) families.add(static_cast<double>(ends.certificate_s), {{"file", "certificate"}});
  if (ends.client_authority_s != 0) {
    families.add(static_cast<double>(ends.client_authority_s), {{"file", "client_authority"}});
  }
}

}  // namespace

std::string metrics_page(ServiceState& state, const NetworkFigures& network) {
  Families families;
  families.begin("build_info", "1, with the versions as labels.", MetricType::Gauge);
  families.add(1.0, {{"version", kVersion}, {"engine", std::string(kEngineVersion)}});
  add_calls(state, families);
  add_memory(state, families);
  add_meshes(state, families);
  families.begin("worker_seconds_total", "Time of worker threads, by class of work.", MetricType::Counter);
  families.add(state.executor.worked_seconds(Pieces::kInteractive), {{"class", "interactive"}});
  families.add(state.executor.worked_seconds(Pieces::kBatch), {{"class", "batch"}});
  families.gauge("worker_threads", "Threads that compute at the same time.", state.executor.threads());
  families.gauge("connections", "Open connections.", network.connections);
  add_certificates(network.ends, families);
  families.counter("log_lines_lost_total", "Lines of the log that nobody read.", lost_log_lines());
  return families.text();
}

}  // namespace ccslice::server
