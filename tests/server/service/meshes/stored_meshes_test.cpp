// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/stored_meshes.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "server/service/base/service_error.h"
#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// A store in memory that can be broken. The test's thread looks at it only while nothing is asked.
struct FakeStore {
  std::map<std::string, std::string> meshes;
  std::atomic<int> asked{0};
  std::atomic<bool> fails{false};
  std::atomic<StoreFault> fault{StoreFault::kFails};
  std::atomic<bool> hangs{false};
  std::counting_semaphore<> go_on{0};

  void enter() {
    ++asked;
    if (hangs) go_on.acquire();
    if (fails) throw StoreError(fault, "broken");
  }
};

class FakeMeshStore final : public MeshStore {
 public:
  explicit FakeMeshStore(FakeStore& fake) : fake_(fake) {}
  bool read(const std::string& mesh_id, const Sink& sink) override {
    fake_.enter();
    const auto mesh = fake_.meshes.find(mesh_id);
    if (mesh == fake_.meshes.end()) return false;
    sink.begin(mesh->second.size());
    sink.append(mesh->second);
    return true;
  }
  void write(const std::string& mesh_id, const std::vector<std::string>& blocks, const Progress&) override {
    fake_.enter();
    fake_.meshes[mesh_id].clear();
    for (const std::string& block : blocks) fake_.meshes[mesh_id] += block;
  }
  bool contains(const std::string& mesh_id) override {
    fake_.enter();
    return fake_.meshes.contains(mesh_id);
  }
  bool erase(const std::string& mesh_id) override {
    fake_.enter();
    return fake_.meshes.erase(mesh_id) > 0;
  }
  std::vector<std::string> last_used(std::size_t, const Progress&) override {
    fake_.enter();
    std::vector<std::string> ids;
    for (const auto& [id, bytes] : fake_.meshes) ids.push_back(id);
    return ids;
  }
  void check() override { fake_.enter(); }

 private:
  FakeStore& fake_;
};

class StoredMeshesTest : public ::testing::Test {
 protected:
  struct Loaded {
    std::shared_ptr<Upload> upload;
    std::exception_ptr error;
  };
  std::future<Loaded> load(const std::string& id) { return load(stored_, id, "client"); }
  static std::future<Loaded> load(StoredMeshes& stored, const std::string& id, const std::string& client) {
    auto promise = std::make_shared<std::promise<Loaded>>();
    std::future<Loaded> future = promise->get_future();
    stored.load(id, client, [promise](const std::shared_ptr<Upload>& upload, const std::exception_ptr& error) {
      promise->set_value({upload, error});
    });
    return future;
  }
  std::optional<bool> keep(const std::string& bytes) {
    const auto upload = std::make_shared<Upload>(budget_, 1000);
    upload->start(mesh_id_of(bytes), bytes.size());
    upload->append(bytes);
    std::promise<std::optional<bool>> done;
    stored_.keep(upload, "client", [&done](const std::optional<bool>& kept) { done.set_value(kept); });
    return done.get_future().get();
  }
  std::vector<bool> find(const std::vector<std::string>& ids) {
    std::promise<std::vector<bool>> done;
    stored_.find(ids, "client", [&done](const std::vector<bool>& held) { done.set_value(held); });
    return done.get_future().get();
  }
  std::optional<bool> erase(const std::string& id) {
    std::promise<std::optional<bool>> done;
    stored_.erase(id, "client", [&done](const std::optional<bool>& was_there) { done.set_value(was_there); });
    return done.get_future().get();
  }

  FakeStore fake_;
  MemoryBudget budget_{2000};
  StoredMeshes stored_{std::make_unique<FakeMeshStore>(fake_),
                       budget_,
                       {.max_mesh_bytes = 1000, .patience = 100ms, .rest = 300ms, .mark_every = 1h}};
  const std::string id_ = mesh_id_of("bytes");
};

TEST_F(StoredMeshesTest, KeepsFindsLoadsAndErases) {
  EXPECT_EQ(keep("bytes"), true);
  EXPECT_EQ(find({mesh_id_of("others"), id_}), (std::vector<bool>{false, true}));
  const Loaded loaded = load(id_).get();
  ASSERT_TRUE(loaded.upload);
  EXPECT_EQ(loaded.upload->bytes().blocks(), std::vector<std::string>{"bytes"});
  EXPECT_EQ(stored_.last_used(5), std::vector<std::string>{id_});
  EXPECT_EQ(erase(id_), true);
  EXPECT_EQ(erase(id_), false);
  const Loaded gone = load(id_).get();
  EXPECT_FALSE(gone.upload || gone.error);
  EXPECT_EQ(stored_.count(StoreOperation::kRead, StoreOutcome::kFound), 1u);
  EXPECT_EQ(stored_.count(StoreOperation::kRead, StoreOutcome::kMissing), 1u);
  EXPECT_EQ(stored_.count(StoreOperation::kErase, StoreOutcome::kFound), 1u);
}

TEST_F(StoredMeshesTest, ServesClientsInTurn) {
  StoredMeshes patient(std::make_unique<FakeMeshStore>(fake_), budget_, {.max_mesh_bytes = 1000, .patience = 1h});
  fake_.meshes[id_] = "bytes";
  fake_.hangs = true;
  std::vector<std::future<Loaded>> of_many;
  for (int i = 0; i < 50; ++i) of_many.push_back(load(patient, mesh_id_of(std::to_string(i)), "many"));
  while (fake_.asked == 0) std::this_thread::yield();
  std::future<Loaded> other = load(patient, id_, "one");
  fake_.go_on.release(2);
  EXPECT_TRUE(other.get().upload);
  EXPECT_LE(fake_.asked, 3) << "right after the one that was being served";
  fake_.hangs = false;
  fake_.go_on.release(1);
  for (std::future<Loaded>& each : of_many) EXPECT_FALSE(each.get().upload);
}

TEST_F(StoredMeshesTest, WhoeverJoinsAReadBringsItToHisTurn) {
  StoredMeshes patient(std::make_unique<FakeMeshStore>(fake_), budget_, {.max_mesh_bytes = 1000, .patience = 1h});
  fake_.meshes[id_] = "bytes";
  fake_.hangs = true;
  std::vector<std::future<Loaded>> of_many;
  for (int i = 0; i < 50; ++i) of_many.push_back(load(patient, mesh_id_of(std::to_string(i)), "many"));
  while (fake_.asked == 0) std::this_thread::yield();
  of_many.push_back(load(patient, id_, "many"));
  std::vector<std::future<Loaded>> joined;
  for (const char* client : {"one", "other", "one"}) joined.push_back(load(patient, id_, client));
  fake_.go_on.release(2);
  for (std::future<Loaded>& each : joined) {
    EXPECT_EQ(each.wait_for(5s), std::future_status::ready);
  }
  EXPECT_LE(fake_.asked, 3);
  fake_.hangs = false;
  fake_.go_on.release(60);
  for (std::future<Loaded>& each : joined) EXPECT_TRUE(each.get().upload);
  for (std::future<Loaded>& each : of_many) (void)each.get();
  EXPECT_EQ(fake_.asked, 51) << "read once";
}

TEST_F(StoredMeshesTest, LooksOneMeshUpAtATimeWhereOthersWait) {
  StoredMeshes patient(std::make_unique<FakeMeshStore>(fake_), budget_, {.max_mesh_bytes = 1000, .patience = 1h});
  fake_.meshes[id_] = "bytes";
  fake_.hangs = true;
  std::vector<std::string> ids(99, mesh_id_of("others"));
  ids.push_back(id_);
  std::promise<std::vector<bool>> of_many;
  patient.find(ids, "many", [&](const std::vector<bool>& held) { of_many.set_value(held); });
  while (fake_.asked == 0) std::this_thread::yield();
  std::future<Loaded> other = load(patient, id_, "one");
  fake_.go_on.release(2);
  EXPECT_EQ(other.wait_for(5s), std::future_status::ready);
  EXPECT_LE(fake_.asked, 3);
  fake_.hangs = false;
  fake_.go_on.release(200);
  EXPECT_TRUE(other.get().upload);
  std::vector<bool> expected(100, false);
  expected.back() = true;
  EXPECT_EQ(of_many.get_future().get(), expected);
  EXPECT_EQ(fake_.asked, 101);
}

TEST_F(StoredMeshesTest, AFullQueueLeavesAQuarterToOthers) {
  StoredMeshes patient(std::make_unique<FakeMeshStore>(fake_), budget_, {.max_mesh_bytes = 1000, .patience = 1h});
  fake_.meshes[id_] = "bytes";
  fake_.hangs = true;
  std::atomic<int> refused = 0, answered = 0;
  const auto find_one = [&](const std::string& client) {
    patient.find({id_}, client, [&](const std::vector<bool>& held) { ++(held.empty() ? refused : answered); });
  };
  find_one("many");
  while (fake_.asked == 0) std::this_thread::yield();
  for (int i = 0; i < 3072; ++i) find_one("many");
  EXPECT_EQ(refused, 0);
  find_one("many");
  EXPECT_EQ(refused, 1);
  for (int i = 0; i < 1024; ++i) find_one("one");
  EXPECT_EQ(refused, 1);
  find_one("one");
  EXPECT_EQ(refused, 2);
  fake_.hangs = false;
  fake_.go_on.release(5000);
  while (answered < 1 + 3072 + 1024) std::this_thread::yield();
}

TEST_F(StoredMeshesTest, AnswersAllUnderConcurrentUse) {
  for (int i = 0; i < 4; ++i) fake_.meshes[mesh_id_of(std::to_string(i))] = std::to_string(i);
  StoredMeshes patient(std::make_unique<FakeMeshStore>(fake_), budget_, {.max_mesh_bytes = 1000, .patience = 1h});
  std::vector<std::thread> clients;
  for (int client = 0; client < 4; ++client) {
    clients.emplace_back([&, client] {
      for (int round = 0; round < 100; ++round) {
        std::vector<std::future<Loaded>> loads;
        for (int i = 0; i < 4; ++i) {
          loads.push_back(load(patient, mesh_id_of(std::to_string((i + client) % 4)), std::to_string(client)));
        }
        std::promise<std::vector<bool>> found;
        patient.find(std::vector<std::string>(20, mesh_id_of("0")), std::to_string(client % 2),
                     [&](const std::vector<bool>& held) { found.set_value(held); });
        EXPECT_EQ(found.get_future().get(), std::vector<bool>(20, true));
        for (std::future<Loaded>& each : loads) EXPECT_TRUE(each.get().upload);
      }
    });
  }
  for (std::thread& client : clients) client.join();
}

TEST_F(StoredMeshesTest, DropsDamagedBytes) {
  for (const std::string& damaged : {std::string("bytez"), std::string(), std::string("byte"), std::string(900, 'x')}) {
    fake_.meshes[id_] = damaged;
    const Loaded loaded = load(id_).get();
    EXPECT_FALSE(loaded.upload || loaded.error);
    EXPECT_FALSE(fake_.meshes.contains(id_));
  }
  EXPECT_EQ(stored_.count(StoreOperation::kRead, StoreOutcome::kDamaged), 4u);
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

TEST_F(StoredMeshesTest, LeavesMeshesThatAreTooLargeToOthers) {
  const std::string large(1001, 'x');
  fake_.meshes[mesh_id_of(large)] = large;
  const Loaded loaded = load(mesh_id_of(large)).get();
  EXPECT_FALSE(loaded.upload || loaded.error);
  EXPECT_TRUE(fake_.meshes.contains(mesh_id_of(large)));
}

TEST_F(StoredMeshesTest, RefusalsAreNoReasonToLeaveItAlone) {
  fake_.meshes[id_] = "bytes";
  fake_.fails = true;
  fake_.fault = StoreFault::kRefuses;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(keep("bytes"), std::nullopt);
  fake_.fails = false;
  EXPECT_TRUE(load(id_).get().upload);
}

TEST_F(StoredMeshesTest, SaysWhenTheBytesDoNotFit) {
  fake_.meshes[id_] = "bytes";
  MemoryBudget::Share all(budget_);
  ASSERT_TRUE(all.resize(2000));
  const Loaded loaded = load(id_).get();
  EXPECT_FALSE(loaded.upload);
  EXPECT_THROW(std::rethrow_exception(loaded.error), ServiceError);
  EXPECT_TRUE(fake_.meshes.contains(id_));
}

TEST_F(StoredMeshesTest, ManyReadersShareOneRead) {
  fake_.meshes[id_] = "bytes";
  fake_.hangs = true;
  std::vector<std::future<Loaded>> loads;
  for (int i = 0; i < 5; ++i) loads.push_back(load(id_));
  fake_.hangs = false;
  fake_.go_on.release();
  std::shared_ptr<Upload> first;
  for (std::future<Loaded>& future : loads) {
    const Loaded loaded = future.get();
    ASSERT_TRUE(loaded.upload);
    if (!first) first = loaded.upload;
    EXPECT_EQ(loaded.upload, first);
  }
  EXPECT_EQ(fake_.asked, 1);
}

bool comes_true(const std::function<bool()>& condition) {
  for (int i = 0; i < 500 && !condition(); ++i) std::this_thread::sleep_for(10ms);
  return condition();
}

class CheckedStoredMeshesTest : public StoredMeshesTest {
 protected:
  StoredMeshes checked_{
      std::make_unique<FakeMeshStore>(fake_),
      budget_,
      {.max_mesh_bytes = 1000, .patience = 100ms, .rest = 50ms, .mark_every = 1h, .check_every = 20ms}};
};

TEST_F(CheckedStoredMeshesTest, KnowWhetherTheStoreIsThereThoughNobodyAsks) {
  EXPECT_TRUE(comes_true([this] { return checked_.is_there(); }));
  EXPECT_FALSE(stored_.is_there()) << "nobody has asked";
  for (const StoreFault fault : {StoreFault::kFails, StoreFault::kRefuses, StoreFault::kHangs}) {
    fake_.fault = fault;
    fake_.fails = true;
    EXPECT_TRUE(comes_true([this] { return !checked_.is_there(); }));
    const std::uint64_t failed = checked_.count(StoreOperation::kCheck, StoreOutcome::kFailed);
    EXPECT_TRUE(comes_true([&] { return checked_.count(StoreOperation::kCheck, StoreOutcome::kFailed) > failed + 5; }));
    EXPECT_FALSE(checked_.is_there());
    fake_.fails = false;
    EXPECT_TRUE(comes_true([this] { return checked_.is_there(); }));
  }
  fake_.hangs = true;
  EXPECT_TRUE(comes_true([this] { return !checked_.is_there(); }));
  fake_.hangs = false;
  fake_.go_on.release();
  EXPECT_TRUE(comes_true([this] { return checked_.is_there(); }));
}

TEST_F(StoredMeshesTest, CallsTellWhetherTheStoreIsThere) {
  EXPECT_FALSE(stored_.is_there());
  EXPECT_FALSE(load(id_).get().upload);
  EXPECT_TRUE(stored_.is_there());
  fake_.fails = true;
  fake_.fault = StoreFault::kRefuses;
  EXPECT_EQ(keep("bytes"), std::nullopt);
  EXPECT_TRUE(stored_.is_there()) << "it may be full";
  fake_.fault = StoreFault::kFails;
  EXPECT_FALSE(load(id_).get().upload);
  EXPECT_FALSE(stored_.is_there());
}

TEST_F(StoredMeshesTest, IsLeftAloneAfterThreeFailures) {
  fake_.meshes[id_] = "bytes";
  fake_.fails = true;
  EXPECT_FALSE(load(id_).get().upload);
  EXPECT_TRUE(find({id_}).empty());
  EXPECT_EQ(erase(id_), std::nullopt);
  EXPECT_EQ(fake_.asked, 3);
  EXPECT_EQ(keep("bytes"), std::nullopt);
  EXPECT_TRUE(stored_.last_used(3).empty());
  EXPECT_EQ(fake_.asked, 3);
  fake_.fails = false;
  std::this_thread::sleep_for(350ms);
  EXPECT_TRUE(load(id_).get().upload);
  EXPECT_EQ(stored_.count(StoreOperation::kWrite, StoreOutcome::kFailed), 1u);
}

TEST_F(StoredMeshesTest, IsLeftAloneAfterOneFailureThatTookItsTime) {
  fake_.fails = true;
  fake_.fault = StoreFault::kHangs;
  EXPECT_FALSE(load(id_).get().upload);
  EXPECT_EQ(erase(id_), std::nullopt);
  EXPECT_EQ(fake_.asked, 1);
}

TEST_F(StoredMeshesTest, ThoseBehindOneThatWaitedInVainDoNotWaitToo) {
  fake_.hangs = fake_.fails = true;
  fake_.fault = StoreFault::kHangs;
  std::vector<std::future<Loaded>> loads;
  for (int i = 0; i < 5; ++i) loads.push_back(load(mesh_id_of(std::to_string(i))));
  fake_.go_on.release();
  for (std::future<Loaded>& future : loads) EXPECT_FALSE(future.get().upload);
  EXPECT_EQ(fake_.asked, 1);
}

TEST_F(StoredMeshesTest, NobodyWaitsForAStoreThatHangs) {
  fake_.meshes[id_] = "bytes";
  fake_.hangs = true;
  std::future<Loaded> running = load(id_);
  std::future<Loaded> queued = load(mesh_id_of("other"));
  ASSERT_EQ(running.wait_for(5s), std::future_status::ready);
  ASSERT_EQ(queued.wait_for(5s), std::future_status::ready);
  EXPECT_FALSE(running.get().upload || queued.get().upload);
  EXPECT_EQ(erase(id_), std::nullopt);  // At once.
  fake_.hangs = false;
  fake_.go_on.release();
  std::this_thread::sleep_for(350ms);
  EXPECT_TRUE(load(id_).get().upload);
}

TEST_F(StoredMeshesTest, TellsTheStoreOfUsesNowAndThen) {
  for (int i = 0; i < 5; ++i) stored_.mark_used(id_);
  (void)find({id_});
  EXPECT_EQ(fake_.asked, 2);
}

}  // namespace
}  // namespace ccslice::server
