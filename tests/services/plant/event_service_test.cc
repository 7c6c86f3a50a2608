// The service over real gRPC on a real PostgreSQL: exactly once and in order, whatever ends; and what a client may cost.
#include "services/plant/event_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <numeric>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/support/call.h"
#include "tests/support/customers_parts.h"
#include "tests/support/exposed.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/sanitizer.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

EventServiceOptions Quick() {
  EventServiceOptions options;
  options.heartbeat = 200ms;
  options.write_patience = 1000ms;
  return options;
}

class EventServiceTest : public ::testing::Test {
 protected:
  std::shared_ptr<const storage::EventReader> Journal(int connections) {
    return storage::EventsIn(storage::Database::Open(testing::AsRole(database_.conninfo(), "plant"), connections));
  }
  void Serve(const EventServiceOptions& options) {
    service_ = std::make_unique<EventService>(Journal(1), Journal(2), options);
    server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{service_.get()});
    stub_ = v1::EventService::NewStub(server_->Connect());
  }
  void SetUp() override { Serve(Quick()); }
  ~EventServiceTest() override {
    if (service_) service_->Stop();
  }

  void Record(const std::string& name) { testing::RecordName(database_.database(), "policy", "policies/" + name); }
  std::int64_t Newest() {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT coalesce(max(record_sequence), 0) FROM record_names")->Int(0, 0);
  }
  std::vector<std::int64_t> Recorded(std::int64_t after) {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
    const auto rows = transaction->Execute(
        "SELECT record_sequence FROM record_names WHERE record_sequence > $1 ORDER BY 1", storage::Params().Int(after));
    std::vector<std::int64_t> sequences;
    for (int row = 0; row < rows->count(); ++row) sequences.push_back(rows->Int(row, 0));
    return sequences;
  }

  // One watch, read message by message.
  struct Watch {
    Watch(v1::EventService::Stub* stub, const v1::WatchEventsRequest& request)
        : context(runtime::ContextFor(30)), reader(stub->WatchEvents(context.get(), request)) {}
    ~Watch() {
      context->TryCancel();
      if (!ended) reader->Finish();
    }
    // False at the end. Appends the sequences of what came.
    bool Read(std::vector<std::int64_t>* sequences) {
      v1::WatchEventsResponse response;
      if (!reader->Read(&response)) return false;
      for (const v1::Event& event : response.events()) sequences->push_back(event.entry().record_sequence());
      looked_at = response.looked_at_sequence();
      source = response.source();
      return true;
    }
    absl::Status Finish() {
      ended = true;
      return runtime::FromGrpc(reader->Finish());
    }
    std::unique_ptr<grpc::ClientContext> context;
    std::unique_ptr<grpc::ClientReader<v1::WatchEventsResponse>> reader;
    std::int64_t looked_at = -1;
    std::string source;
    bool ended = false;
  };
  absl::Status Refused(const v1::WatchEventsRequest& request) {
    Watch watch(stub_.get(), request);
    std::vector<std::int64_t> none;
    EXPECT_FALSE(watch.Read(&none));
    return watch.Finish();
  }

  testing::ThrowawayDatabase database_;
  std::unique_ptr<EventService> service_;
  std::unique_ptr<testing::InProcessServer> server_;
  std::unique_ptr<v1::EventService::Stub> stub_;
};

TEST_F(EventServiceTest, TellsWhatWasAndWhatComesOnceInOrderWhileManyWrite) {
  for (int i = 0; i < 300; ++i) Record("before" + std::to_string(i));
  v1::WatchEventsRequest request;
  request.set_after_sequence(Recorded(0)[9]);
  Watch watch(stub_.get(), request);
  std::vector<std::thread> writers;
  for (int w = 0; w < 4; ++w)
    writers.emplace_back([&, w] {
      for (int i = 0; i < 100; ++i) Record("p" + std::to_string(w) + "_" + std::to_string(i));
    });
  std::vector<std::int64_t> told;
  while (told.size() < 690 && watch.Read(&told)) EXPECT_LE(told.size(), 690u);
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(told, Recorded(request.after_sequence()));
  EXPECT_EQ(watch.looked_at, Newest());
  EXPECT_THAT(watch.source, HasSubstr("urn:uuid:"));
}

TEST_F(EventServiceTest, SaysAtOnceWhereItBeginsAndGivesSignsOfLifeThatAFilterGoesOnBy) {
  Record("a");
  v1::WatchEventsRequest request;
  request.set_from_now(true);
  request.mutable_filter()->add_kinds("scan");
  Watch watch(stub_.get(), request);
  std::vector<std::int64_t> told;
  ASSERT_TRUE(watch.Read(&told));
  EXPECT_EQ(watch.looked_at, Newest());
  Record("b");
  const std::int64_t newest = Newest();
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(watch.Read(&told));  // nothing for it, and yet it hears how far that is looked at
  EXPECT_EQ(watch.looked_at, newest);
  EXPECT_THAT(told, IsEmpty());
  testing::RecordName(database_.database(), "scan", "scans/s1");
  while (told.empty() && watch.Read(&told)) continue;
  EXPECT_THAT(told, ElementsAre(newest + 1));
}

// The bound on what the tail keeps is a bound on memory alone: who needs more reads pages.
TEST_F(EventServiceTest, WhoIsFurtherBehindThanWhatIsKeptReadsTheJournalItself) {
  EventServiceOptions options = Quick();
  options.tail.most_kept_bytes = 2000;  // a few entries
  service_->Stop();
  Serve(options);
  Watch idle(stub_.get(), [] {
    v1::WatchEventsRequest request;
    request.set_from_now(true);
    return request;
  }());
  std::vector<std::int64_t> told, told_late;
  ASSERT_TRUE(idle.Read(&told));
  for (int i = 0; i < 50; ++i) Record("p" + std::to_string(i));
  Watch late(stub_.get(), {});
  while (told_late.size() < 50 && late.Read(&told_late)) continue;
  while (told.size() < 50 && idle.Read(&told)) continue;
  EXPECT_EQ(told, Recorded(0));
  EXPECT_EQ(told_late, told);
}

TEST_F(EventServiceTest, ACrashOfTheDatabaseEndsTheWatchAndTheNextGoesOnWhereItWas) {
  Record("a");
  std::vector<std::int64_t> told;
  Watch watch(stub_.get(), {});
  while (told.empty() && watch.Read(&told)) continue;
  testing::ThrowawayDatabase::KillServer();
  while (watch.Read(&told)) continue;
  EXPECT_TRUE(absl::IsUnavailable(watch.Finish()));
  testing::ThrowawayDatabase::StartServer();
  Record("b");
  v1::WatchEventsRequest request;
  request.set_after_sequence(watch.looked_at);
  Watch next(stub_.get(), request);
  while (told.size() < 2 && next.Read(&told)) continue;
  EXPECT_EQ(told, Recorded(0));
}

std::int64_t Resident_bytes() {
  std::int64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

// Six clients that read nothing of 25 MB each: none of it is kept for them, and all are gone within their time.
TEST_F(EventServiceTest, WhoStopsReadingIsCutOffAndCostsNoMemory) {
  {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon(60));
    const auto filled = transaction->Execute(
        "WITH named AS (INSERT INTO record_names (record_id, name) SELECT (lpad(to_hex((extract(epoch FROM "
        "clock_timestamp()) * 1000)::bigint), 12, '0') || '7' || substr(md5(i::text), 1, 3) || '8' || "
        "substr(md5(i::text), 4, 15))::uuid, 'policies/p' || i FROM generate_series(1, 2000) i "
        "RETURNING record_id, record_sequence, recorded_at) INSERT INTO record_entries (record_id, record_sequence, "
        "recorded_at, kind, method, software_version, requested_by, summary) SELECT record_id, record_sequence, "
        "recorded_at, 'policy', '', 'test', 'test', (SELECT jsonb_build_object('noise', string_agg(md5(record_sequence "
        "* k || ''), '')) FROM generate_series(1, 400) k) FROM named");
    ASSERT_TRUE(filled.ok()) << filled.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  EventServiceOptions options = Quick();
  options.watches = {6, 6};
  service_->Stop();
  Serve(options);
  std::vector<std::unique_ptr<Watch>> watches;
  const auto watch = [&] {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel = grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments);
    watches.push_back(std::make_unique<Watch>(v1::EventService::NewStub(channel).get(), v1::WatchEventsRequest()));
  };
  watch();
  std::this_thread::sleep_for(300ms);
  const std::int64_t before_bytes = Resident_bytes();
  const auto began = std::chrono::steady_clock::now();
  for (int i = 1; i < 6; ++i) watch();
  std::int64_t greatest_bytes = 0;
  v1::WatchEventsRequest one_more;
  absl::Status status;
  // Its place is free again once the first of them is gone.
  do {
    greatest_bytes = std::max(greatest_bytes, Resident_bytes());
    Watch asked(stub_.get(), one_more);
    v1::WatchEventsResponse response;
    if (asked.reader->Read(&response)) break;
    status = asked.Finish();
    std::this_thread::sleep_for(20ms);
  } while (absl::IsResourceExhausted(status) && std::chrono::steady_clock::now() < began + 25s);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  EXPECT_GT(took_s, 0.2);
  EXPECT_LT(took_s, 15);  // a second of patience, and what a machine that does other things takes to read for them
  // A page of 1 MB in work and one in gRPC's hands, of each.
  EXPECT_TRUE(testing::kSanitized || greatest_bytes - before_bytes < (60 << 20)) << greatest_bytes - before_bytes;
  // Who reads too early is told again instead, on a machine that is slow to cut off.
  while (testing::Exposed("sixpoint_event_watches") > 0 && std::chrono::steady_clock::now() < began + 25s)
    std::this_thread::sleep_for(20ms);
  int cut_off_count = 0;
  for (const auto& each : watches) {
    v1::WatchEventsResponse response;
    while (each->reader->Read(&response)) continue;
    cut_off_count += absl::IsCancelled(each->Finish());
  }
  EXPECT_EQ(cut_off_count, 6);
}

TEST_F(EventServiceTest, AsManyWatchAsMayAndTheNextIsRefused) {
  EventServiceOptions options = Quick();
  options.watches = {32, 2};
  service_->Stop();
  Serve(options);
  std::vector<std::int64_t> told;
  Watch first(stub_.get(), {});
  {
    Watch second(stub_.get(), {});
    ASSERT_TRUE(first.Read(&told));
    ASSERT_TRUE(second.Read(&told));
    const absl::Status refused = Refused({});
    EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
    EXPECT_TRUE(runtime::HasReason(refused, errors::v1::CALLS_FULL)) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("2 of one identity"));
  }
  for (int i = 0; i < 100; ++i) {  // its place is free again, soon
    Watch third(stub_.get(), {});
    if (third.Read(&told)) return;
    std::this_thread::sleep_for(20ms);
  }
  FAIL() << "a place was not given back";
}

TEST_F(EventServiceTest, AServiceThatStopsEndsItsWatchesAtOnce) {
  Watch watch(stub_.get(), {});
  std::vector<std::int64_t> told;
  ASSERT_TRUE(watch.Read(&told));
  const auto began = std::chrono::steady_clock::now();
  service_->Stop();
  while (watch.Read(&told)) continue;
  EXPECT_TRUE(absl::IsUnavailable(watch.Finish()));
  EXPECT_LT(std::chrono::steady_clock::now() - began, 2s);
}

// Without a door a caller is nobody, from whom all that has a customer is hidden: of what was, and of what comes.
TEST_F(EventServiceTest, WhatAReaderMayNotSeeIsNotToldNeitherFromPagesNorFromTheEnd) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  testing::PutCustomersPart(database_.database(), "kappa", true, calibrations);
  Watch watch(stub_.get(), {});
  std::vector<std::string> names;
  const auto read = [&](const std::string& last) {
    v1::WatchEventsResponse response;
    while ((names.empty() || names.back() != last) && watch.reader->Read(&response))
      for (const v1::Event& event : response.events()) names.push_back(event.entry().name());
  };
  Record("between");
  read("policies/between");
  testing::PutCustomersPart(database_.database(), "sigma", true, calibrations);
  const testing::CustomersPart omega = testing::PutCustomersPart(database_.database(), "omega", false, calibrations);
  Record("last");
  read("policies/last");
  for (const std::string& name : names) {
    EXPECT_THAT(name, ::testing::Not(HasSubstr("kappa")));
    EXPECT_THAT(name, ::testing::Not(HasSubstr("sigma")));
  }
  for (const std::string& name : omega.names())
    EXPECT_THAT(names, ::testing::Contains(name == omega.part ? name + "@1" : name));
}

// A journal that does not answer is said to be away, not silent for ever.
TEST(EventTail, SaysThatTheJournalIsAwayWhereItIs) {
  class Away : public storage::EventReader {
   public:
    absl::StatusOr<storage::EventPage> Events(const storage::EventQuery&, storage::Deadline) const override {
      return absl::UnavailableError("away");
    }
    absl::StatusOr<storage::JournalNow> Now(storage::Deadline) const override { return absl::UnavailableError("away"); }
    absl::StatusOr<std::vector<std::string>> HiddenParts(const storage::Reader&, storage::Deadline) const override {
      return absl::UnavailableError("away");
    }
  };
  EventTailOptions options;
  options.patience = 100ms;
  EventTail tail(std::make_shared<Away>(), options);
  const EventTail::Listener listener(&tail);
  const auto soon = tail.Wait(5, 10, EventTail::Clock::now() + 20ms);
  ASSERT_TRUE(soon.ok()) << soon.status();
  EXPECT_EQ(soon->looked_at_sequence, 5);
  EXPECT_THAT(soon->entries, IsEmpty());
  const auto late = tail.Wait(5, 10, EventTail::Clock::now() + 200ms);
  EXPECT_TRUE(absl::IsUnavailable(late.status())) << late.status();
}

}  // namespace
}  // namespace sixpoint::plant
