// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/work_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

WorkQueue::CallPtr make_call(const std::string& client, Pieces pieces = Pieces::kBatch) {
  return std::make_shared<WorkQueue::Call>(client, pieces);
}

/// Some workers and the work that they do, on a clock of their own. Calls never run out of work unless they say so.
class Simulation {
 public:
  struct Source {
    WorkQueue::CallPtr call;
    milliseconds piece;
    int at_once = 1;  // Pieces that are queued or running at the same time.
    nanoseconds had{0};
    nanoseconds longest_wait{0};
    nanoseconds waiting_since{0};
  };

  explicit Simulation(std::size_t workers, std::size_t max_long = 1) : queue_(max_long), workers_(workers) {}

  Source& add(const std::string& client, milliseconds piece, Pieces pieces = Pieces::kBatch, int at_once = 4) {
    sources_.push_back(std::make_unique<Source>());
    Source& source = *sources_.back();
    source = {.call = make_call(client, pieces), .piece = piece, .at_once = at_once};
    for (int i = 0; i < at_once; ++i) post(source);
    return source;
  }
  /// A call that ends after each piece, and is followed by the next one at once.
  Source& add_short_calls(const std::string& client, milliseconds piece) {
    Source& source = add(client, piece, Pieces::kBatch, 1);
    short_calls_ = &source;
    return source;
  }

  void run(milliseconds time) {
    const nanoseconds end = now_ + time;
    while (true) {
      for (Worker& worker : workers_) {
        if (!worker.taken) begin(worker);
      }
      const auto first = std::min_element(workers_.begin(), workers_.end(),
                                          [](const Worker& a, const Worker& b) { return a.end < b.end; });
      if (first->end > end) break;
      now_ = first->end;
      finish(*first);
    }
    now_ = end;
  }

 private:
  struct Worker {
    std::optional<WorkQueue::Taken> taken;
    nanoseconds end = nanoseconds::max();
  };

  Source& source_of(const WorkQueue::CallPtr& call) {
    return **std::find_if(sources_.begin(), sources_.end(), [&](const auto& source) { return source->call == call; });
  }
  void post(Source& source) {
    if (source.waiting_since == 0ns) source.waiting_since = now_;
    queue_.push(source.call, {.work = [] {}}, WorkQueue::Place::kBack);
  }
  void begin(Worker& worker) {
    worker.taken = queue_.take(/*interactive_only=*/false);
    if (!worker.taken) return;
    Source& source = source_of(worker.taken->call);
    source.longest_wait = std::max(source.longest_wait, now_ - source.waiting_since);
    source.waiting_since = now_;
    worker.end = now_ + source.piece;
  }
  void finish(Worker& worker) {
    const WorkQueue::CallPtr call = std::exchange(worker.taken, std::nullopt)->call;
    worker.end = nanoseconds::max();
    Source& source = source_of(call);
    queue_.charge(*call, source.piece);
    source.had += source.piece;
    if (&source == short_calls_) {
      queue_.end(call);
      source.call = make_call(call->client);
      post(source);
    } else {
      post(source);
      queue_.end(call);
    }
  }

  WorkQueue queue_;
  std::vector<Worker> workers_;
  std::vector<std::unique_ptr<Source>> sources_;
  Source* short_calls_ = nullptr;
  nanoseconds now_{0};
};

double seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

TEST(WorkQueue, SharesTimeAndNotTurns) {
  Simulation simulation(1);
  const auto& slow = simulation.add("slow", 300ms);
  const auto& fast = simulation.add("fast", 2ms);
  simulation.run(100s);
  EXPECT_NEAR(seconds(slow.had), 50, 1);
  EXPECT_NEAR(seconds(fast.had), 50, 1);
}

TEST(WorkQueue, SharesBetweenClientsBeforeItSharesBetweenTheirCalls) {
  for (const std::size_t workers : {1u, 2u, 4u}) {
    Simulation simulation(workers);
    const auto& alone = simulation.add("a", 20ms);
    std::vector<const Simulation::Source*> many;
    for (int i = 0; i < 24; ++i) many.push_back(&simulation.add("b", milliseconds(5 + 3 * i)));
    simulation.run(100s);
    const double all = 100.0 * static_cast<double>(workers);
    EXPECT_NEAR(seconds(alone.had), all / 2, 0.02 * all) << workers;
    for (const auto* call : many) EXPECT_NEAR(seconds(call->had), all / 2 / 24, 0.02 * all) << workers;
  }
}

TEST(WorkQueue, LeavesNothingUnusedWhereAClientCannotUseItsShare) {
  Simulation simulation(4);
  const auto& narrow = simulation.add("narrow", 10ms, Pieces::kBatch, /*at_once=*/1);
  const auto& wide = simulation.add("wide", 10ms, Pieces::kBatch, /*at_once=*/8);
  simulation.run(100s);
  EXPECT_NEAR(seconds(narrow.had), 100, 1);
  EXPECT_NEAR(seconds(wide.had), 300, 3);
}

TEST(WorkQueue, WhoComesBackHasNeitherAClaimNorADebt) {
  Simulation simulation(1);
  const auto& old = simulation.add("old", 10ms);
  simulation.run(1000s);
  const auto& fresh = simulation.add("fresh", 10ms);
  const nanoseconds before = old.had;
  simulation.run(10s);
  EXPECT_NEAR(seconds(fresh.had), 5, 0.1);
  EXPECT_NEAR(seconds(old.had - before), 5, 0.1);
}

TEST(WorkQueue, ARowOfShortCallsDoesNotKeepALongOneWaiting) {
  Simulation simulation(1);
  const auto& lasting = simulation.add("a", 20ms);
  const auto& row = simulation.add_short_calls("a", 20ms);
  simulation.run(100s);
  EXPECT_NEAR(seconds(lasting.had), 50, 5);
  EXPECT_NEAR(seconds(row.had), 50, 5);
}

TEST(WorkQueue, InteractiveWorkComesAsSoonAsAPieceEnds) {
  Simulation simulation(1);
  for (int i = 0; i < 8; ++i) (void)simulation.add("job " + std::to_string(i), 10ms);
  auto& points = simulation.add("points", 2ms, Pieces::kInteractive, /*at_once=*/1);
  simulation.run(100s);
  EXPECT_LE(points.longest_wait, 20ms + 2ms);
}

TEST(WorkQueue, MuchInteractiveWorkTakesHalfOfTheTime) {
  Simulation simulation(2);
  const auto& job = simulation.add("job", 10ms);
  const auto& points = simulation.add("points", 10ms, Pieces::kInteractive);
  simulation.run(100s);
  EXPECT_NEAR(seconds(job.had), 100, 2);
  EXPECT_NEAR(seconds(points.had), 100, 2);
}

/// The clients of what is taken, one piece after the other, in no time.
std::string order_of(WorkQueue& queue, bool interactive_only = false) {
  std::string order;
  while (auto taken = queue.take(interactive_only)) {
    order += taken->call->client;
    queue.charge(*taken->call, 0ns);
    queue.end(taken->call);
  }
  return order;
}

TEST(WorkQueue, EqualsTakeTurns) {
  WorkQueue queue(1);
  for (const char* client : {"a", "b", "c"}) {
    const WorkQueue::CallPtr call = make_call(client);
    for (int i = 0; i < (client[0] == 'a' ? 4 : 2); ++i) queue.push(call, {.work = [] {}}, WorkQueue::Place::kBack);
  }
  EXPECT_EQ(order_of(queue), "abcabcaa");
  EXPECT_EQ(queue.size(), 0u);
}

TEST(WorkQueue, TakesInteractiveWorkOnlyWhereItIsAskedTo) {
  WorkQueue queue(1);
  queue.push(make_call("b"), {.work = [] {}}, WorkQueue::Place::kBack);
  EXPECT_FALSE(queue.take(/*interactive_only=*/true));
  queue.push(make_call("i", Pieces::kInteractive), {.work = [] {}}, WorkQueue::Place::kBack);
  EXPECT_EQ(order_of(queue, /*interactive_only=*/true), "i");
  EXPECT_EQ(order_of(queue), "b");
}

TEST(WorkQueue, BeginsOnlySoManyLongPiecesThoughTheyGiveWay) {
  WorkQueue queue(2);
  std::vector<WorkQueue::CallPtr> calls;
  for (int i = 0; i < 3; ++i) {
    calls.push_back(make_call("client", Pieces::kLong));
    queue.push(calls.back(), {.work = [] {}}, WorkQueue::Place::kBack);
  }
  const auto a = queue.take(false), b = queue.take(false);
  ASSERT_TRUE(a && b);
  EXPECT_FALSE(queue.take(false));
  Worker* const worker = reinterpret_cast<Worker*>(&queue);  // Any address: nobody looks at it.
  queue.park(a->call, *worker);
  const auto again = queue.take(false);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->call, a->call);
  EXPECT_EQ(again->item.parked, worker);
  EXPECT_FALSE(queue.take(false));
  queue.end(b->call);
  const auto c = queue.take(false);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->call, calls.back());
}

TEST(WorkQueue, BeginsLongPiecesOfAFewOthersThoughOneClientHasBegunAllThatThereMayBe) {
  WorkQueue queue(1);
  const auto push = [&](const std::string& client) {
    queue.push(make_call(client, Pieces::kLong), {.work = [] {}}, WorkQueue::Place::kBack);
  };
  const auto next = [&]() -> WorkQueue::CallPtr {
    const auto taken = queue.take(/*interactive_only=*/false);
    return taken ? taken->call : nullptr;
  };
  for (const char* client : {"many", "many", "one"}) push(client);
  const auto many = next(), one = next();
  ASSERT_TRUE(many && one);
  EXPECT_EQ(many->client + one->client, "manyone");
  EXPECT_FALSE(next()) << "the first has one";
  for (const char* client : {"second", "third", "fourth"}) push(client);
  const auto second = next(), third = next();
  ASSERT_TRUE(second && third);
  EXPECT_FALSE(next()) << "memory has an end";
  queue.end(many);
  const auto again = next();
  ASSERT_TRUE(again);
  EXPECT_EQ(again->client, "many") << "it has none now";
  EXPECT_FALSE(next());
  queue.end(one);
  const auto last = next();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->client, "fourth");
}

TEST(WorkQueue, GivesOutWhatWasPutInOnceWhateverHappens) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto below = [&](int end) { return std::uniform_int_distribution<int>(0, end - 1)(random); };
  WorkQueue queue(2);
  std::vector<WorkQueue::CallPtr> calls;
  for (int i = 0; i < 20; ++i) {
    calls.push_back(make_call(std::string(1, static_cast<char>('a' + i % 5)), static_cast<Pieces>(below(3))));
  }
  std::vector<WorkQueue::Taken> running;
  int pushed = 0, ended = 0, done = 0;
  const auto take = [&] {
    auto taken = queue.take(below(4) == 0);
    if (taken) running.push_back(std::move(*taken));
    return taken.has_value();
  };
  const auto end_one = [&] {
    const auto one = running.begin() + below(static_cast<int>(running.size()));
    one->item.work();
    queue.charge(*one->call, milliseconds(below(100)));
    queue.end(one->call);
    running.erase(one);
    ++ended;
  };
  for (int step = 0; step < 20'000; ++step) {
    if (below(2) == 0) {
      ++pushed;
      queue.push(calls[static_cast<std::size_t>(below(20))], {.work = [&done] { ++done; }},
                 below(2) == 0 ? WorkQueue::Place::kFront : WorkQueue::Place::kBack);
    } else if (running.size() < 6) {
      (void)take();
    }
    if (running.size() == 6 || (!running.empty() && below(3) == 0)) end_one();
  }
  while (queue.size() > 0 || !running.empty()) {
    if (!take() && !running.empty()) end_one();
  }
  EXPECT_EQ(ended, pushed);
  EXPECT_EQ(done, pushed);
}

}  // namespace
}  // namespace ccslice::server
