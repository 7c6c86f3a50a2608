// Many calls at once on the real service: turns, deadlines, cancellation, batches that break off, one surface for all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <map>
#include <set>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/plant_registry.h"
#include "storage/record.h"
#include "storage/scans.h"
#include "tests/services/registration/fake_plant.h"
#include "tests/support/sanitizer.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::registration {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

using Clock = std::chrono::steady_clock;

constexpr int kBladeCount = 6;

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

std::string BladeName(int blade) { return "blades/b" + std::to_string(blade); }
std::string ScanName(int blade, int view) { return "scans/b" + std::to_string(blade) + "_" + std::to_string(view); }

// Takes its time, and counts how many scans are under way at once.
class CountingIngest final : public ingest::v1::ScanService::Service {
 public:
  explicit CountingIngest(testing::StandInIngest* ingest) : ingest_(ingest) {}
  std::atomic<int> greatest{0};
  grpc::Status DownloadScan(grpc::ServerContext* context, const ingest::v1::DownloadScanRequest* request,
                            grpc::ServerWriter<ingest::v1::DownloadScanResponse>* writer) override {
    const int now = ++under_way_;
    for (int seen = greatest; now > seen && !greatest.compare_exchange_weak(seen, now);) {
    }
    std::this_thread::sleep_for(5ms);
    const grpc::Status status = ingest_->DownloadScan(context, request, writer);
    --under_way_;
    return status;
  }

 private:
  testing::StandInIngest* ingest_;
  std::atomic<int> under_way_{0};
};

class ConcurrencyTest : public FakePlantTest {
 protected:
  ConcurrencyTest() : ingest_(&plant_.ingest), ingest_server_({&ingest_}) { MountBlades(); }
  ~ConcurrencyTest() override { Stop(); }

  void Serve(runtime::PoolLimits pool) {
    RegistrationLimits limits;
    limits.pool = pool;
    FakePlantTest::Serve(limits, ingest_server_.Connect());
  }

  // A part in the shape of a blade, and blades of it that each stand 20 um beside the one before.
  void MountBlades() {
    Design(TrueBlade());
    Scan(TrueBlade());
    for (int view = 0; view < static_cast<int>(plant_.scans.size()); ++view)
      for (int blade = 0; blade < kBladeCount; ++blade) {
        const std::string& scanned = plant_.scans[static_cast<std::size_t>(view)];
        const std::string name = ScanName(blade, view);
        ingest::v1::Scan record = plant_.ingest.scans.at(scanned);
        record.set_name(name);
        ingest::v1::ScanHeader& header = *record.mutable_header();
        header.set_scan_id(name.substr(6));
        header.set_subject(BladeName(blade));
        header.mutable_v0_mm()->set_x_mm(header.v0_mm().x_mm() + 0.02 * blade);
        plant_.ingest.scans[name] = record;
        plant_.ingest.blocks[name] = plant_.ingest.blocks.at(scanned);
      }
    StoreRows();
  }

  // What foreign keys ask for.
  void StoreRows() {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    const auto entry = [](const std::string& kind, const std::string& name) {
      storage::RecordEntry out;
      out.kind = kind;
      out.name = name;
      out.software_version = "test";
      return out;
    };
    for (int blade = 0; blade < kBladeCount; ++blade) {
      const std::string serial = BladeName(blade).substr(7);
      ASSERT_TRUE(storage::InsertBlade(*transaction, {serial, "p1", {}}, entry("blade", "")).ok());
      for (int view = 0; view < static_cast<int>(plant_.scans.size()); ++view) {
        storage::ScanRow scan;
        scan.scan_id = ScanName(blade, view).substr(6);
        scan.machine_id = "m1";
        scan.machine_revision = 1;
        scan.blade_serial = serial;
        scan.kind = "airfoil";
        scan.profile_pitch_mm = 0.1;
        scan.columns_per_profile = 1280;
        scan.point_count = 1;
        scan.encoding = scan.stored_encoding = "draco";
        scan.block_count = scan.profile_count = 1;
        scan.stored_bytes = 1;
        scan.stored_sha256 = scan.sent_sha256 = std::string(64, '0');
        const auto stored = storage::InsertScan(*transaction, scan, {}, entry("scan", ScanName(blade, view)));
        ASSERT_TRUE(stored.ok()) << stored.status();
      }
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }

  v1::RegisterRequest Request(int blade) const {
    v1::RegisterRequest request;
    request.set_blade(BladeName(blade));
    for (int view = 0; view < static_cast<int>(plant_.scans.size()); ++view) request.add_scans(ScanName(blade, view));
    request.set_method(v1::METHOD_BEST_FIT);
    return request;
  }
  // Its angles' influence takes six fits.
  v1::RegisterRequest SlowRequest(int blade) {
    if (plant_.calibration.axes.empty()) {
      plant_.Characterise(false, std::vector<double>(8, 0), std::vector<double>(8, 0), 0.001);
      plant_.Characterise(true, std::vector<double>(8, 0), std::vector<double>(8, 0), 0.001);
    }
    v1::RegisterRequest request = Request(blade);
    request.set_apply_axis_tables(true);
    return request;
  }
  v1::RegisterBatchRequest Batch() const {
    v1::RegisterBatchRequest batch;
    for (int blade = 0; blade < kBladeCount; ++blade) *batch.add_requests() = Request(blade);
    batch.set_request_id(kSomeUuid);
    return batch;
  }
  struct BatchAnswer {
    std::map<int, v1::Registration> registrations;
    std::map<int, v1::RegistrationRefusal> refusals;
    std::set<v1::RegistrationStep> steps;
    absl::Status status;
  };
  // Broken off by the client once so many are finished; 0: never.
  BatchAnswer RegisterBatch(const v1::RegisterBatchRequest& batch, int break_off_after = 0) {
    BatchAnswer answer;
    const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 120);
    const auto stub = v1::RegistrationService::NewStub(channel_);
    const auto reader = stub->RegisterBatch(context.get(), batch);
    v1::RegisterBatchResponse response;
    while (reader->Read(&response)) {
      if (response.has_progress()) answer.steps.insert(response.progress().step());
      if (!response.has_finished()) continue;
      const v1::FinishedRegistration& finished = response.finished();
      if (finished.has_registration()) answer.registrations[finished.index()] = finished.registration();
      if (finished.has_refusal()) answer.refusals[finished.index()] = finished.refusal();
      if (response.finished_count() == break_off_after) context->TryCancel();
    }
    answer.status = runtime::FromGrpc(reader->Finish());
    return answer;
  }
  // Pose, covariances and evidence, but for the time that it took.
  static std::string Bits(v1::Registration registration) {
    registration.clear_name();
    registration.clear_recorded_at();
    registration.clear_record_sequence();
    registration.clear_requested_by();  // by whose connection
    registration.mutable_evidence()->clear_seconds();
    return registration.SerializeAsString();
  }

  CountingIngest ingest_;
  testing::InProcessServer ingest_server_;
};

TEST_F(ConcurrencyTest, SixteenAtOnceGetTheBitsThatTheyGetAlone) {
  Serve({4, 32});
  std::map<int, std::string> alone;
  for (int blade = 0; blade < kBladeCount; ++blade) {
    const auto registration = TryRegister(Request(blade));
    ASSERT_TRUE(registration.ok()) << registration.status();
    ASSERT_EQ(registration->evidence().outcome(), v1::OUTCOME_CONVERGED) << registration->evidence().remark();
    alone[blade] = Bits(*registration);
  }
  Stop();
  Serve({4, 32});  // with no surface yet
  blades_.download_count = 0;
  std::vector<std::future<absl::StatusOr<v1::Registration>>> callers;
  for (int i = 0; i < 16; ++i)
    callers.push_back(std::async(std::launch::async, [this, i] { return TryRegister(Request(i % kBladeCount)); }));
  std::set<std::string> names;
  for (int i = 0; i < 16; ++i) {
    const auto registration = callers[static_cast<std::size_t>(i)].get();
    ASSERT_TRUE(registration.ok()) << registration.status();
    EXPECT_EQ(Bits(*registration), alone.at(i % kBladeCount)) << i;
    names.insert(registration->name());
  }
  EXPECT_EQ(names.size(), 16u);
  EXPECT_EQ(blades_.download_count, 1);  // prepared once for all
  EXPECT_NE(alone.at(0), alone.at(1));
}

// Points are held only in a slot: of the scan at hand and the next one, whoever else waits, batches too.
TEST_F(ConcurrencyTest, OnlyWhatHasASlotHoldsPoints) {
  Serve({1, 32});
  std::vector<std::future<absl::Status>> callers;
  for (int i = 0; i < 8; ++i)
    callers.push_back(
        std::async(std::launch::async, [this, i] { return TryRegister(Request(i % kBladeCount)).status(); }));
  callers.push_back(std::async(std::launch::async, [this] { return RegisterBatch(Batch()).status; }));
  for (auto& caller : callers) {
    const absl::Status status = caller.get();
    EXPECT_TRUE(status.ok()) << status;
  }
  EXPECT_GE(ingest_.greatest, 1);
  EXPECT_LE(ingest_.greatest, 2);

  Stop();
  Serve({4, 32});
  callers.clear();
  for (int i = 0; i < 16; ++i)
    callers.push_back(
        std::async(std::launch::async, [this, i] { return TryRegister(Request(i % kBladeCount)).status(); }));
  for (auto& caller : callers) EXPECT_TRUE(caller.get().ok());
  EXPECT_GT(ingest_.greatest, 2);  // so it can be seen
  EXPECT_LE(ingest_.greatest, 8);
}

TEST_F(ConcurrencyTest, MoreThanMayWaitAreToldToComeAgain) {
  Serve({1, 1});
  const v1::RegisterRequest request = SlowRequest(0);
  std::vector<std::future<absl::Status>> callers;
  for (int i = 0; i < 8; ++i)
    callers.push_back(std::async(std::launch::async, [&] { return TryRegister(request).status(); }));
  int done = 0, full = 0;
  for (auto& caller : callers) {
    const absl::Status status = caller.get();
    if (status.ok()) {
      ++done;
    } else {
      EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
      EXPECT_EQ(runtime::ReasonOf(status), "REGISTRATIONS_FULL");
      EXPECT_GT(runtime::RetryDelayOf(status), 0ms);
      ++full;
    }
  }
  EXPECT_GE(done, 2);  // one that ran, one that waited
  EXPECT_GE(full, 1);
  EXPECT_TRUE(TryRegister(Request(0)).ok());
}

TEST_F(ConcurrencyTest, ADeadlineEndsTheFitAndStoresNothing) {
  Serve({1, 0});
  ASSERT_TRUE(TryRegister(Request(0)).ok());  // the surface is there
  const std::int64_t before = Count("registrations");
  const v1::RegisterRequest request = SlowRequest(0);
  auto begin = Clock::now();
  ASSERT_TRUE(TryRegister(request).ok());
  const double whole_s = SecondsSince(begin);
  begin = Clock::now();
  EXPECT_TRUE(absl::IsDeadlineExceeded(TryRegister(request, 0.05).status()));
  EXPECT_LT(SecondsSince(begin), 0.05 + 0.5 * whole_s);
  // The slot is free long before the fit would have been done.
  absl::Status status;
  do {
    status = TryRegister(Request(1), 30).status();
  } while (absl::IsResourceExhausted(status) && SecondsSince(begin) < 60);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(Count("registrations"), before + 2);
}

TEST_F(ConcurrencyTest, ACancelledFitFreesItsSlot) {
  Serve({1, 0});
  v1::RegisterBatchRequest batch;
  *batch.add_requests() = SlowRequest(0);
  const auto register_anew = [&] {
    batch.set_request_id(storage::NewUuid());
    return RegisterBatch(batch).status;
  };
  ASSERT_TRUE(register_anew().ok());
  auto begin = Clock::now();
  ASSERT_TRUE(register_anew().ok());
  const double whole_s = SecondsSince(begin);
  const std::int64_t before = Count("registrations");

  batch.set_request_id(storage::NewUuid());
  const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 120);
  const auto stub = v1::RegistrationService::NewStub(channel_);
  const auto reader = stub->RegisterBatch(context.get(), batch);
  v1::RegisterBatchResponse response;
  while (reader->Read(&response) && response.progress().step() != v1::REGISTRATION_STEP_FITTING) {
  }
  ASSERT_EQ(response.progress().step(), v1::REGISTRATION_STEP_FITTING);
  begin = Clock::now();
  context->TryCancel();
  v1::RegisterRequest unknown = Request(1);
  unknown.set_scans(0, "scans/none");  // refused as soon as it has a slot
  absl::Status status;
  do {
    status = TryRegister(unknown).status();
  } while (absl::IsResourceExhausted(status) && SecondsSince(begin) < 60);
  const double freed_s = SecondsSince(begin);
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  EXPECT_LT(freed_s, 0.5 * whole_s);
  RecordProperty("whole_ms", static_cast<int>(1e3 * whole_s));
  RecordProperty("freed_ms", static_cast<int>(1e3 * freed_s));
  std::printf("a fit of %.0f ms, cancelled: its slot is free after %.0f ms\n", 1e3 * whole_s, 1e3 * freed_s);
  while (reader->Read(&response)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(Count("registrations"), before);
}

TEST_F(ConcurrencyTest, ABatchRegistersAsSingleCallsDo) {
  Serve({4, 32});
  v1::RegisterBatchRequest batch = Batch();
  batch.mutable_requests(2)->set_scans(1, ScanName(3, 1));  // of another blade
  const BatchAnswer answer = RegisterBatch(batch);
  EXPECT_TRUE(answer.status.ok()) << answer.status;
  ASSERT_EQ(answer.registrations.size(), kBladeCount - 1u);
  ASSERT_EQ(answer.refusals.count(2), 1u);
  EXPECT_EQ(answer.refusals.at(2).code(), "INVALID_ARGUMENT");
  EXPECT_THAT(answer.refusals.at(2).message(), HasSubstr("subject: blades/b3, want blades/b2"));
  // A look every 200 ms: a step that is over before one is not told (batch_test has each).
  EXPECT_FALSE(answer.steps.empty());
  for (const auto& [index, registration] : answer.registrations) {
    const auto alone = TryRegister(Request(index));
    ASSERT_TRUE(alone.ok()) << alone.status();
    EXPECT_EQ(Bits(registration), Bits(*alone)) << index;
  }
}

TEST_F(ConcurrencyTest, ABatchThatBrokeOffGoesOnWhereItWas) {
  Serve({4, 32});
  const std::int64_t before = Count("registrations");
  const BatchAnswer broken = RegisterBatch(Batch(), 2);
  EXPECT_TRUE(absl::IsCancelled(broken.status)) << broken.status;
  ASSERT_GE(broken.registrations.size(), 2u);
  ASSERT_LT(broken.registrations.size(), static_cast<std::size_t>(kBladeCount));

  const BatchAnswer all = RegisterBatch(Batch());
  EXPECT_TRUE(all.status.ok()) << all.status;
  ASSERT_EQ(all.registrations.size(), static_cast<std::size_t>(kBladeCount));
  for (const auto& [index, registration] : broken.registrations)
    EXPECT_EQ(registration.SerializeAsString(), all.registrations.at(index).SerializeAsString());
  EXPECT_EQ(Count("registrations"), before + kBladeCount);

  // The same again, from a restarted server: the same answers, and nothing new. `skip` leaves out.
  Stop();
  Serve({4, 32});
  v1::RegisterBatchRequest rest = Batch();
  rest.add_skip(0);
  const BatchAnswer again = RegisterBatch(rest);
  EXPECT_TRUE(again.status.ok()) << again.status;
  EXPECT_EQ(again.registrations.size(), kBladeCount - 1u);
  EXPECT_EQ(again.registrations.at(5).SerializeAsString(), all.registrations.at(5).SerializeAsString());
  EXPECT_EQ(Count("registrations"), before + kBladeCount);

  // Another list under the same id is no repetition.
  v1::RegisterBatchRequest other = Batch();
  other.mutable_requests(0)->set_method(v1::METHOD_LOCAL);
  EXPECT_EQ(RegisterBatch(other).refusals.at(0).code(), "ALREADY_EXISTS");
}

// The operator at the machine does not wait for the end of somebody's batch.
TEST_F(ConcurrencyTest, ASingleCallPassesThroughARunningBatch) {
  Serve({1, 4});
  const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 120);
  const auto stub = v1::RegistrationService::NewStub(channel_);
  const auto reader = stub->RegisterBatch(context.get(), Batch());
  v1::RegisterBatchResponse response;
  ASSERT_TRUE(reader->Read(&response));
  const auto single = TryRegister(Request(0));
  ASSERT_TRUE(single.ok()) << single.status();
  std::int64_t last_of_batch = 0;
  while (reader->Read(&response))
    last_of_batch = std::max(last_of_batch, response.finished().registration().record_sequence());
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(response.finished_count(), kBladeCount);
  EXPECT_LT(single->record_sequence(), last_of_batch);
}

TEST_F(ConcurrencyTest, OnlySoManyBatchesAtOnce) {
  Serve({1, 0});
  std::vector<std::future<BatchAnswer>> batches;
  for (int i = 0; i < 8; ++i)
    batches.push_back(std::async(std::launch::async, [this, i] {
      v1::RegisterBatchRequest batch = Batch();
      batch.set_request_id("00000000-0000-4000-8000-0000000000b" + std::to_string(i));
      return RegisterBatch(batch);
    }));
  int done = 0;
  for (auto& batch : batches) {
    const BatchAnswer answer = batch.get();
    if (answer.status.ok()) {
      EXPECT_EQ(answer.registrations.size(), static_cast<std::size_t>(kBladeCount));
      ++done;
    } else {
      EXPECT_EQ(runtime::ReasonOf(answer.status), "BATCHES_FULL") << answer.status;
    }
  }
  EXPECT_GE(done, 4);
  EXPECT_LT(done, 8);
}

}  // namespace
}  // namespace sixpoint::registration
