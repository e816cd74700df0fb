// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/admission.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// A call that asks for a place and remembers what came of it.
class Caller {
 public:
  explicit Caller(Admission& admission, const std::string& client = {})
      : admission_(admission), place_(admission, client) {
    admission.request(place_, [this](const std::exception_ptr& refusal) {
      refused_ = refusal;
      decided_ = true;
    });
  }
  bool decided() const { return decided_; }
  bool runs() const { return decided_ && !refused_; }
  std::optional<ServiceError> refusal() const {
    if (!decided_ || !refused_) return std::nullopt;
    try {
      std::rethrow_exception(refused_);
    } catch (const ServiceError& error) {
      return error;
    }
  }
  void end() { admission_.give_back(place_); }
  bool leave() { return admission_.leave_queue(place_); }

 private:
  Admission& admission_;
  Admission::Place place_;
  std::atomic<bool> decided_{false};
  std::exception_ptr refused_;
};

template <class Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(5ms);
  return condition();
}

TEST(Admission, RunsSoManyAndLetsTheOthersWaitInOrder) {
  Admission admission({.running = 2, .waiting = 2, .longest_wait = 1h});
  Caller first(admission), second(admission), third(admission), fourth(admission);
  EXPECT_TRUE(first.runs() && second.runs());
  EXPECT_FALSE(third.decided() || fourth.decided());
  EXPECT_EQ(admission.running(), 2u);
  EXPECT_EQ(admission.waiting(), 2u);
  second.end();
  EXPECT_TRUE(third.runs());
  EXPECT_FALSE(fourth.decided());
  second.end();  // Nothing any more.
  EXPECT_EQ(admission.running(), 2u);
  first.end();
  EXPECT_TRUE(fourth.runs());
  third.end();
  fourth.end();
  EXPECT_EQ(admission.running(), 0u);
}

TEST(Admission, RefusesWhoFindsTheQueueFullAndSaysWhenToComeAgain) {
  Admission admission({.running = 1, .waiting = 1, .longest_wait = 1h});
  Caller first(admission), second(admission), third(admission);
  ASSERT_TRUE(third.refusal());
  EXPECT_EQ(third.refusal()->code(), ServiceErrorCode::kServerBusy);
  ASSERT_TRUE(third.refusal()->retry_delay());
  EXPECT_GE(*third.refusal()->retry_delay(), 1s);
  EXPECT_LE(*third.refusal()->retry_delay(), 30s);
}

TEST(Admission, TakesClientsInTurnHoweverManyCallsOneMakes) {
  Admission admission({.running = 2, .waiting = 10, .longest_wait = 1h});
  Caller first(admission, "many"), second(admission, "many"), third(admission, "many"), fourth(admission, "many");
  Caller one(admission, "one"), other(admission, "one"), last(admission, "last");
  first.end();
  EXPECT_TRUE(one.runs()) << "as none of that client's runs";
  second.end();
  EXPECT_TRUE(last.runs()) << "as neither runs one of the last client's, nor of the first one's, which had its turn";
  one.end();
  EXPECT_TRUE(third.runs());
  last.end();
  EXPECT_TRUE(other.runs());
  third.end();
  EXPECT_TRUE(fourth.runs());
}

TEST(Admission, LeavesAQuarterOfManyPlacesToOtherClients) {
  Admission admission({.running = 8, .waiting = 4, .longest_wait = 1h});
  std::list<Caller> many;
  for (int i = 0; i < 7; ++i) many.emplace_back(admission, "many");
  EXPECT_EQ(admission.running(), 6u);
  EXPECT_FALSE(many.back().decided());
  Caller one(admission, "one"), other(admission, "other");
  EXPECT_TRUE(one.runs() && other.runs());
  many.front().end();
  EXPECT_TRUE(many.back().runs());
}

TEST(Admission, LetsAClientTakeAPlaceInAFullQueueOfOneWhoHasMoreOfThem) {
  Admission admission({.running = 1, .waiting = 3, .longest_wait = 1h});
  Caller runs(admission, "many"), first(admission, "many"), second(admission, "many"), third(admission, "many");
  Caller one(admission, "one");
  EXPECT_TRUE(third.refusal());
  EXPECT_FALSE(one.decided() || first.decided() || second.decided());
  Caller last(admission, "last");
  EXPECT_TRUE(second.refusal());
  EXPECT_FALSE(last.decided());
  EXPECT_TRUE(Caller(admission, "one").refusal()) << "none has more than this client would have";
  EXPECT_TRUE(Caller(admission, "more").refusal()) << "each has one";
}

TEST(Admission, RemembersWhoRunsThoughHundredsOfClientsComeAndGo) {
  Admission admission({.running = 2, .waiting = 4, .longest_wait = 1h});
  Caller busy(admission, "busy");
  for (int i = 0; i < 300; ++i) Caller(admission, "passer " + std::to_string(i)).end();
  Caller second(admission, "second"), again(admission, "busy"), other(admission, "other");
  EXPECT_FALSE(again.decided() || other.decided());
  second.end();
  EXPECT_TRUE(other.runs()) << "as one of the busy client's runs";
  busy.end();
  EXPECT_TRUE(again.runs());
}

TEST(Admission, TheRetryDelayFollowsTheQueue) {
  Admission few({.running = 1, .waiting = 1, .longest_wait = 1h}),
      many({.running = 1, .waiting = 20, .longest_wait = 1h});
  const auto delay_of = [](Admission& admission, std::size_t waiting) {
    std::vector<std::unique_ptr<Caller>> callers;
    for (std::size_t i = 0; i < waiting + 2; ++i) callers.push_back(std::make_unique<Caller>(admission));
    return *callers.back()->refusal()->retry_delay();
  };
  EXPECT_LT(delay_of(few, 1), delay_of(many, 20));
}

TEST(Admission, APlaceMayBeAskedForAgainAndIsGivenToThoseWhoRanBeforeWhileCallsDrain) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 1h});
  Admission::Place again(admission);
  std::size_t runs = 0;
  const auto decided = [&runs](const std::exception_ptr& refusal) {
    EXPECT_FALSE(refusal);
    ++runs;
  };
  admission.request(again, decided);
  admission.give_back(again);
  Caller other(admission), fresh(admission);
  EXPECT_TRUE(other.runs());
  admission.request(again, decided);
  EXPECT_EQ(admission.waiting(), 2u) << "behind those who came before";
  admission.drain();
  EXPECT_TRUE(fresh.refusal());
  EXPECT_EQ(admission.waiting(), 1u);
  other.end();
  EXPECT_EQ(runs, 2u);
  admission.give_back(again);
  admission.request(again, decided);
  EXPECT_EQ(runs, 3u) << "and is asked for while they drain";
  EXPECT_TRUE(Caller(admission).refusal());
}

TEST(Admission, TimeInWhichNobodyWaitedDoesNotLengthenTheRetryDelay) {
  Admission admission({.running = 1, .waiting = 20, .longest_wait = 1h});
  Caller(admission).end();
  std::this_thread::sleep_for(1500ms);
  std::vector<std::unique_ptr<Caller>> callers;
  for (int i = 0; i < 21; ++i) callers.push_back(std::make_unique<Caller>(admission));
  callers.front()->end();
  callers.push_back(std::make_unique<Caller>(admission));
  const Caller refused(admission);
  ASSERT_TRUE(refused.refusal());
  EXPECT_LE(*refused.refusal()->retry_delay(), 21s) << "a second for each run";
}

TEST(Admission, CallsThatEndAsSoonAsTheyBeginDontStackUp) {
  constexpr std::size_t kMany = 200'000;
  Admission admission({.running = 1, .waiting = kMany, .longest_wait = 1h});
  Caller first(admission);
  std::list<Admission::Place> places;
  std::size_t ended = 0;
  for (std::size_t i = 0; i < kMany; ++i) {
    Admission::Place& place = places.emplace_back(admission);
    admission.request(place, [&admission, &place, &ended](const std::exception_ptr&) {
      admission.give_back(place);
      ++ended;
    });
  }
  first.end();
  EXPECT_EQ(ended, kMany);
  EXPECT_EQ(admission.running(), 0u);
}

TEST(Admission, NobodyWaitsForever) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 20ms});
  Caller first(admission), second(admission), third(admission);
  EXPECT_TRUE(comes_true([&] { return second.decided() && third.decided(); }));
  EXPECT_EQ(second.refusal()->code(), ServiceErrorCode::kServerBusy);
  EXPECT_EQ(third.refusal()->code(), ServiceErrorCode::kServerBusy);
  EXPECT_EQ(admission.waiting(), 0u);
  first.end();
  EXPECT_TRUE(Caller(admission).runs());
}

TEST(Admission, WhoLeavesTheQueueHearsNothingMore) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 1h});
  Caller first(admission), second(admission), third(admission);
  EXPECT_TRUE(second.leave());
  EXPECT_FALSE(second.leave());
  EXPECT_FALSE(first.leave()) << "it runs";
  first.end();
  EXPECT_FALSE(second.decided());
  EXPECT_TRUE(third.runs());
}

TEST(Admission, ADrainRefusesThoseWhoWaitAndThoseWhoCome) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 1h});
  Caller first(admission), second(admission);
  admission.drain();
  EXPECT_EQ(second.refusal()->code(), ServiceErrorCode::kServerDraining);
  Caller third(admission);
  EXPECT_EQ(third.refusal()->code(), ServiceErrorCode::kServerDraining);
  EXPECT_TRUE(first.runs());
}

TEST(Admission, APlaceThatGoesIsGivenBack) {
  Admission admission({.running = 1, .waiting = 1, .longest_wait = 1h});
  auto first = std::make_unique<Caller>(admission);
  Caller second(admission);
  first = nullptr;
  EXPECT_TRUE(second.runs());
}

TEST(Admission, ManyThreadsNeverRunMoreThanTheLimit) {
  Admission admission({.running = 3, .waiting = 100, .longest_wait = 1h});
  std::atomic<int> running{0}, most{0}, done{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      for (int round = 0; round < 200; ++round) {
        std::atomic<bool> admitted{false};
        Admission::Place place(admission);
        admission.request(place, [&](const std::exception_ptr& refusal) {
          EXPECT_FALSE(refusal);
          const int now = ++running;
          for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
          }
          admitted = true;
        });
        if (round % 7 == 0 && admission.leave_queue(place)) continue;
        while (!admitted) std::this_thread::yield();
        --running;
        ++done;
        admission.give_back(place);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(most, 3);
  EXPECT_GT(done, 1000);
  EXPECT_EQ(admission.running(), 0u);
  EXPECT_EQ(admission.waiting(), 0u);
}

/// So much memory, and calls that want some of it.
class AdmissionToMemory : public ::testing::Test {
 protected:
  /// A call that has a place and asks for memory, or one that gave its place back before.
  class Wanting {
   public:
    Wanting(AdmissionToMemory& test, int units, bool is_short = false, bool resumes = false,
            const std::string& client = {})
        : test_(test), place_(test.admission_, client), units_(units) {
      if (!resumes) test.admission_.request(place_, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); });
      resumes ? test.admission_.resume(place_, memory(is_short), decided())
              : test.admission_.request_memory(place_, memory(is_short), decided());
    }
    bool runs() const { return runs_; }
    bool refused() const { return refused_; }
    void end() { test_.admission_.give_back(place_); }
    bool leave() { return test_.admission_.leave_memory_queue(place_); }
    bool leave_as_new() { return test_.admission_.leave_queue(place_); }
    bool is_told() const { return is_told_; }
    /// Gives all back, and asks for it again.
    void give_way() {
      runs_ = false;
      end();
      test_.free(units_);
      test_.admission_.wait_again(place_, memory(/*is_short=*/false), decided());
    }

   private:
    Admission::Memory memory(bool is_short) {
      return {.reserve = [this] { return test_.take(units_); },
              .is_short = is_short,
              .give_way = [this] { is_told_ = true; }};
    }
    Admission::Decision decided() {
      return [this](const std::exception_ptr& refusal) { (refusal ? refused_ : runs_) = true; };
    }

    AdmissionToMemory& test_;
    Admission::Place place_;
    const int units_;
    std::atomic<bool> runs_ = false, refused_ = false, is_told_ = false;
  };

  std::unique_ptr<Wanting> wanting(int units, const std::string& client) {
    return std::make_unique<Wanting>(*this, units, /*is_short=*/false, /*resumes=*/false, client);
  }
  bool take(int units) {
    const std::lock_guard lock(mutex_);
    if (units > free_) return false;
    free_ -= units;
    return true;
  }
  void free(int units) {
    {
      const std::lock_guard lock(mutex_);
      free_ += units;
    }
    admission_.retry();
  }

  explicit AdmissionToMemory(const AdmissionLimits& limits = {.running = 4, .waiting = 2, .longest_wait = 1h})
      : admission_(limits) {}

  std::mutex mutex_;
  int free_ = 10;
  Admission admission_;
};

TEST_F(AdmissionToMemory, IsInOrderAndHoldsUpNobodyElse) {
  Wanting first(*this, 8), second(*this, 6), third(*this, 2);
  EXPECT_TRUE(first.runs());
  EXPECT_FALSE(second.runs());
  EXPECT_FALSE(third.runs()) << "the second comes first, although there is enough for this one";
  EXPECT_EQ(admission_.running(), 1u) << "who waits has no place";
  EXPECT_TRUE(admission_.wants_memory());
  Caller needs_none(admission_);
  EXPECT_TRUE(needs_none.runs());
  Wanting hasty(*this, 2, /*is_short=*/true);
  EXPECT_TRUE(hasty.runs());
  needs_none.end();
  free(8);
  EXPECT_TRUE(second.runs() && third.runs());
  EXPECT_FALSE(admission_.wants_memory());
}

TEST_F(AdmissionToMemory, LetsShortOnesOvertakeLongOnesAndNotEachOther) {
  Wanting first(*this, 8), is_long(*this, 6), is_short(*this, 4, /*is_short=*/true), later(*this, 1, /*is_short=*/true);
  EXPECT_TRUE(first.runs());
  EXPECT_FALSE(is_long.runs() || is_short.runs());
  EXPECT_TRUE(later.refused()) << "although there is enough for this one: two wait";
  later.end();
  free(5);
  EXPECT_TRUE(is_short.runs()) << "though there is enough for the long one, too, which came first";
  EXPECT_FALSE(is_long.runs());
  free(3);
  EXPECT_TRUE(is_long.runs());
}

TEST_F(AdmissionToMemory, WaitsForAPlaceTooBeforeThoseWhoAreNew) {
  Wanting first(*this, 10), second(*this, 10);
  Caller a(admission_), b(admission_), c(admission_), is_new(admission_);
  EXPECT_TRUE(a.runs() && b.runs() && c.runs());
  EXPECT_FALSE(is_new.decided());
  free(10);
  EXPECT_FALSE(second.runs()) << "there is no place";
  a.end();
  EXPECT_TRUE(second.runs());
  EXPECT_FALSE(is_new.decided());
  b.end();
  EXPECT_TRUE(is_new.runs());
}

TEST_F(AdmissionToMemory, LetsThoseResumeFirstAndRefusesNoneOfThem) {
  Wanting first(*this, 10), waits(*this, 5), waits_too(*this, 5);
  Wanting refused(*this, 1);
  EXPECT_TRUE(refused.refused()) << "the queue is full";
  EXPECT_EQ(admission_.running(), 2u) << "and it still has its place";
  Wanting resumes(*this, 10, false, /*resumes=*/true);
  admission_.drain();
  EXPECT_TRUE(waits.refused() && waits_too.refused());
  EXPECT_FALSE(resumes.runs() || resumes.refused());
  free(10);
  EXPECT_TRUE(resumes.runs());
}

TEST_F(AdmissionToMemory, GoesToClientsInTurn) {
  const auto runs = wanting(8, "many"), waits = wanting(5, "many"), other = wanting(5, "one");
  EXPECT_TRUE(runs->runs());
  free(3);
  EXPECT_TRUE(other->runs()) << "as none of that client's runs";
  EXPECT_FALSE(waits->runs() || waits->refused());
  free(5);
  EXPECT_TRUE(waits->runs());
}

TEST_F(AdmissionToMemory, GoesToClientsInTurnThoughCallsOfOneOfThemResume) {
  const auto runs = wanting(8, "many"), begun = wanting(5, "many");
  Wanting resumes(*this, 5, /*is_short=*/false, /*resumes=*/true, "many");
  const auto other = wanting(5, "one");
  EXPECT_TRUE(runs->runs());
  EXPECT_FALSE(other->runs());
  free(3);
  EXPECT_TRUE(other->runs()) << "as none of that client's runs";
  EXPECT_FALSE(resumes.runs());
  free(5);
  EXPECT_TRUE(resumes.runs());
  EXPECT_FALSE(begun->runs()) << "of one client those come first that resume";
  free(5);
  EXPECT_TRUE(begun->runs());
}

TEST_F(AdmissionToMemory, TakesTurnsWithClientsOfShortOnesForAShortOneThatResumes) {
  const auto runs = wanting(10, "other");
  std::vector<std::unique_ptr<Wanting>> many;
  for (int i = 0; i < 2; ++i) {
    many.push_back(std::make_unique<Wanting>(*this, 4, /*is_short=*/true, /*resumes=*/false, "many"));
  }
  Wanting resumes(*this, 4, /*is_short=*/true, /*resumes=*/true, "one");
  free(8);
  EXPECT_TRUE(resumes.runs());
  EXPECT_TRUE(many[0]->runs());
  EXPECT_FALSE(many[1]->runs());
}

/// Where a call may wait for a moment only.
class HastyAdmissionToMemory : public AdmissionToMemory {
 protected:
  HastyAdmissionToMemory() : AdmissionToMemory({.running = 20, .waiting = 40, .longest_wait = 200ms}) {}
};

TEST_F(HastyAdmissionToMemory, ComesFirstToTheOldestOfAClientThatResumeOnceItHasWaitedForLong) {
  const auto holds = wanting(1, "slow");
  std::vector<std::unique_ptr<Wanting>> ran;
  for (int i = 0; i < 3; ++i) ran.push_back(wanting(3, "client " + std::to_string(i)));
  Wanting resumes(*this, 9, /*is_short=*/false, /*resumes=*/true, "slow");
  EXPECT_TRUE(holds->runs() && !resumes.runs());
  const auto end = std::chrono::steady_clock::now() + 20s;
  for (std::size_t i = 3; !resumes.runs() && std::chrono::steady_clock::now() < end; ++i) {
    ran.push_back(wanting(3, "client " + std::to_string(i)));
    std::this_thread::sleep_for(10ms);
    std::erase_if(ran, [](const auto& each) { return each->refused(); });
    const auto first = std::ranges::find_if(ran, [](const auto& each) { return each->runs(); });
    if (first == ran.end()) break;
    (*first)->end();
    ran.erase(first);
    free(3);
  }
  EXPECT_TRUE(resumes.runs()) << "though there is always a client of whom less runs";
}

TEST_F(AdmissionToMemory, IsLeftByWhoNoLongerWantsIt) {
  Wanting first(*this, 10), second(*this, 10), third(*this, 10);
  EXPECT_FALSE(second.leave_as_new()) << "it has begun";
  EXPECT_TRUE(second.leave());
  EXPECT_FALSE(second.leave());
  third.end();
  free(10);
  EXPECT_FALSE(second.runs() || third.runs());
  EXPECT_FALSE(admission_.wants_memory());
}

TEST_F(AdmissionToMemory, IsNoticedIfItComesJustAsSomebodyBeginsToWaitForIt) {
  for (const bool gave_way : {false, true}) {
    Admission::Place place(admission_);
    bool runs = false, has_come = false;
    const Admission::Memory memory{.reserve = [&] { return std::exchange(has_come, true); }};
    const auto decided = [&runs](const std::exception_ptr&) { runs = true; };
    gave_way ? admission_.wait_again(place, memory, decided) : admission_.resume(place, memory, decided);
    EXPECT_TRUE(runs) << "it came after it had been asked for, when nobody was known to wait";
  }
}

TEST_F(AdmissionToMemory, OfWhoeverGaveWayMakesNobodyDoWithLess) {
  Wanting first(*this, 10);
  Admission::Place place(admission_);
  bool runs = false;
  admission_.wait_again(place, {.reserve = [this] { return take(5); }},
                        [&](const std::exception_ptr&) { runs = true; });
  EXPECT_FALSE(runs || admission_.wants_memory());
  Wanting other(*this, 5);
  EXPECT_TRUE(admission_.wants_memory());
  free(10);
  EXPECT_TRUE(runs && other.runs());
}

TEST_F(AdmissionToMemory, GoesToThoseBehindWhomADrainRefuses) {
  const auto first = wanting(5, "many"), second = wanting(6, "one");
  Admission::Place place(admission_, "many");
  std::atomic<bool> runs = false;
  admission_.wait_again(place, {.reserve = [this] { return take(5); }},
                        [&](const std::exception_ptr&) { runs = true; });
  EXPECT_FALSE(runs);
  admission_.drain();
  EXPECT_TRUE(second->refused());
  EXPECT_TRUE(comes_true([&] { return runs.load(); }));
}

TEST_F(AdmissionToMemory, GoesOnToThoseBehindWhoLeavesTheQueue) {
  Wanting first(*this, 5), second(*this, 6), third(*this, 4);
  EXPECT_FALSE(second.runs() || third.runs());
  EXPECT_TRUE(second.leave());
  EXPECT_TRUE(comes_true([&] { return third.runs(); }));
}

/// Runs soon give way.
class AdmissionOfMany : public AdmissionToMemory {
 protected:
  explicit AdmissionOfMany(std::chrono::milliseconds longest_wait = 1h)
      : AdmissionToMemory({.running = 4, .waiting = 4, .longest_wait = longest_wait, .give_way_after = 200ms}) {}
};

TEST_F(AdmissionOfMany, HasTheLatestRunGiveWayToAClientOfWhomFewerRun) {
  const auto first = wanting(5, "many"), second = wanting(5, "many"), third = wanting(5, "many"),
             other = wanting(5, "one");
  EXPECT_TRUE(first->runs() && second->runs());
  EXPECT_FALSE(third->runs() || other->runs());
  EXPECT_TRUE(comes_true([&] { return second->is_told(); }));
  second->give_way();
  EXPECT_TRUE(other->runs());
  std::this_thread::sleep_for(500ms);
  EXPECT_FALSE(first->is_told() || other->is_told()) << "each client has one run";
  EXPECT_FALSE(second->runs() || second->refused());
  admission_.drain();
  EXPECT_TRUE(third->refused());
  EXPECT_FALSE(second->refused()) << "it is under way";
  first->end();
  free(5);
  EXPECT_TRUE(second->runs());
}

TEST_F(AdmissionOfMany, LetsWhoGaveWayComeBeforeThoseOfItsClientThatHaveNotBegun) {
  const auto first = wanting(5, "many"), second = wanting(5, "many"), third = wanting(5, "many");
  auto other = wanting(5, "one");
  EXPECT_TRUE(comes_true([&] { return second->is_told(); }));
  second->give_way();
  EXPECT_TRUE(other->runs());
  other->end();
  free(5);
  EXPECT_TRUE(second->runs());
  EXPECT_FALSE(third->runs());
}

TEST_F(AdmissionOfMany, TellsTheNextOneWhereTheFirstIsNotEnough) {
  const auto first = wanting(2, "many"), second = wanting(2, "many"), third = wanting(6, "many");
  const auto other = wanting(4, "one");
  EXPECT_TRUE(comes_true([&] { return third->is_told(); }));
  EXPECT_TRUE(comes_true([&] { return second->is_told(); })) << "the third one did nothing";
  second->give_way();
  EXPECT_TRUE(comes_true([&] { return first->is_told(); }));
  EXPECT_FALSE(other->runs());
  third->give_way();
  EXPECT_TRUE(other->runs());
}

TEST_F(AdmissionOfMany, TellsTheLatestRunThatIsNotOverInAMomentAnyway) {
  const auto first = wanting(3, "many"), second = wanting(3, "many");
  const auto other = wanting(8, "one");
  for (int i = 0; i < 100 && !second->is_told(); ++i) {
    const auto brief = std::make_unique<Wanting>(*this, 1, /*is_short=*/true, /*resumes=*/false, "many");
    EXPECT_TRUE(brief->runs());
    std::this_thread::sleep_for(20ms);
    EXPECT_FALSE(brief->is_told());
    brief->end();
    free(1);
  }
  EXPECT_TRUE(second->is_told());
  EXPECT_FALSE(first->is_told() || other->runs());
}

TEST_F(AdmissionOfMany, TellsACallThatHasAPlaceAndNoMemory) {
  std::atomic<bool> is_told = false;
  Admission::Place only(admission_, "many"), second(admission_, "many");
  for (Admission::Place* place : {&only, &second}) {
    admission_.request(
        *place, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); }, /*is_long=*/false,
        [&, place] { is_told = place == &second; });
  }
  EXPECT_EQ(admission_.begun_of("many"), 2u);
  EXPECT_EQ(admission_.begun_of("one"), 0u);
  const auto other = wanting(11, "one");
  EXPECT_EQ(admission_.begun_of("one"), 1u) << "it waits";
  EXPECT_TRUE(comes_true([&] { return is_told.load(); }));
  admission_.give_back(second);
  EXPECT_EQ(admission_.begun_of("many"), 1u);
}

TEST_F(AdmissionOfMany, TellsNobodyWhereNoClientHasTwoMore) {
  const auto first = wanting(5, "one"), second = wanting(5, "other"), third = wanting(5, "third");
  std::this_thread::sleep_for(500ms);
  EXPECT_FALSE(first->is_told() || second->is_told());
  EXPECT_FALSE(third->runs());
}

/// Nor does anybody wait for long.
class ImpatientAdmissionOfMany : public AdmissionOfMany {
 protected:
  ImpatientAdmissionOfMany() : AdmissionOfMany(/*longest_wait=*/2s) {}
};

TEST_F(ImpatientAdmissionOfMany, LetsThoseBehindOneThatIsRefusedHaveTheMemory) {
  const auto first = wanting(5, "a"), second = wanting(6, "b");
  std::this_thread::sleep_for(100ms);
  const auto third = wanting(5, "c");
  EXPECT_FALSE(second->runs() || third->runs());
  EXPECT_TRUE(comes_true([&] { return third->runs(); }));
  EXPECT_TRUE(second->refused());
}

TEST_F(ImpatientAdmissionOfMany, NeverRefusesWhoGaveWay) {
  const auto first = wanting(5, "many"), second = wanting(5, "many"), other = wanting(5, "one");
  EXPECT_TRUE(comes_true([&] { return second->is_told(); }));
  second->give_way();
  EXPECT_TRUE(other->runs());
  const auto is_new = wanting(5, "many");
  EXPECT_TRUE(comes_true([&] { return is_new->refused(); }));
  EXPECT_FALSE(second->refused());
  EXPECT_EQ(admission_.waiting(), 1u);
}

/// Two places for long calls, and one more for short ones.
class AdmissionOfLongCalls : public AdmissionToMemory {
 protected:
  AdmissionOfLongCalls() : AdmissionToMemory({.running = 2, .short_more = 1, .waiting = 4, .longest_wait = 1h}) {}
};

TEST_F(AdmissionOfLongCalls, KeepsAPlaceForShortOnes) {
  Wanting first(*this, 1), second(*this, 1), third(*this, 1);
  EXPECT_TRUE(first.runs() && second.runs());
  EXPECT_FALSE(third.runs() || third.refused());
  EXPECT_EQ(admission_.running(), 2u);
  EXPECT_FALSE(admission_.wants_memory()) << "of that there is plenty";
  Wanting hasty(*this, 1, /*is_short=*/true);
  EXPECT_TRUE(hasty.runs());
  Caller is_new(admission_);
  EXPECT_FALSE(is_new.decided()) << "now all places are taken";
  hasty.end();
  EXPECT_TRUE(is_new.runs());
  EXPECT_FALSE(third.runs());
  second.end();
  EXPECT_TRUE(third.runs());
  EXPECT_EQ(free_, 6);
}

TEST_F(AdmissionOfLongCalls, LetsShortOnesHaveAllPlaces) {
  Wanting first(*this, 1, /*is_short=*/true), second(*this, 1, /*is_short=*/true);
  Caller third(admission_);
  EXPECT_TRUE(first.runs() && second.runs() && third.runs());
  Wanting resumes(*this, 1, /*is_short=*/false, /*resumes=*/true);
  EXPECT_FALSE(resumes.runs());
  third.end();
  EXPECT_TRUE(resumes.runs());
}

TEST_F(AdmissionOfLongCalls, KnowsOfSomeFromTheBeginning) {
  Admission::Place places[3]{Admission::Place(admission_), Admission::Place(admission_), Admission::Place(admission_)};
  int running = 0;
  for (Admission::Place& place : places) {
    admission_.request(
        place, [&](const std::exception_ptr&) { ++running; }, /*is_long=*/true);
  }
  EXPECT_EQ(running, 2);
  Caller is_short(admission_);
  EXPECT_TRUE(is_short.runs());
  admission_.give_back(places[0]);
  EXPECT_EQ(running, 3);
}

TEST_F(AdmissionOfLongCalls, WaitForMemoryOnceTheyHaveAPlace) {
  Wanting first(*this, 8), second(*this, 1), third(*this, 5);
  EXPECT_FALSE(admission_.wants_memory());
  second.end();
  EXPECT_FALSE(third.runs());
  EXPECT_TRUE(admission_.wants_memory());
  free(8);
  EXPECT_TRUE(third.runs());
  EXPECT_FALSE(admission_.wants_memory());
}

TEST(Admission, RefusesWhoWaitsForMemoryTooLong) {
  Admission admission({.running = 1, .waiting = 1, .longest_wait = 20ms});
  Admission::Place place(admission);
  admission.request(place, [](const std::exception_ptr&) {});
  std::atomic<bool> refused = false;
  admission.request_memory(place, {.reserve = [] { return false; }},
                           [&](const std::exception_ptr& refusal) { refused = refusal != nullptr; });
  EXPECT_TRUE(comes_true([&] { return refused.load(); }));
  std::atomic<bool> resumed = false;
  admission.resume(place, {.reserve = [] { return false; }}, [&](const std::exception_ptr&) { resumed = true; });
  std::this_thread::sleep_for(60ms);
  EXPECT_FALSE(resumed) << "it waits for as long as it takes";
  EXPECT_TRUE(admission.leave_memory_queue(place));
}

}  // namespace
}  // namespace ccslice::server
