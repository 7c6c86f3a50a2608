// The batch alone: what it makes of answers, failures, clients and deadlines.
#include "services/registration/batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <mutex>
#include <new>
#include <set>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::registration {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;
using namespace std::chrono_literals;

using Clock = std::chrono::steady_clock;

v1::RegisterBatchRequest BatchOf(int count) {
  v1::RegisterBatchRequest batch;
  for (int i = 0; i < count; ++i) batch.add_requests()->set_blade("blades/sn" + std::to_string(i));
  batch.set_request_id(kSomeUuid);
  return batch;
}

v1::Registration Answer(const v1::RegisterRequest& request) {
  v1::Registration registration;
  registration.set_blade(request.blade());
  return registration;
}

class BatchTest : public ::testing::Test {
 protected:
  BatchTest() {
    caller_.deadline = Clock::now() + 60s;
    caller_.make_context = [] { return std::make_unique<grpc::ClientContext>(); };
    caller_.keep_going = [this] { return alive_.load(); };
    limits_.away_s = 0.3;
    limits_.full_s = 0.3;
  }
  absl::Status Run(const v1::RegisterBatchRequest& batch, const RegisterOne& register_one) {
    return RunBatch(
        batch, caller_, register_one,
        [this](const v1::RegisterBatchResponse& response) {
          if (response.has_progress()) progress_.push_back(response.progress());
          if (!response.has_finished()) return true;
          counts_.push_back(response.finished_count());
          const v1::FinishedRegistration& finished = response.finished();
          results_[finished.index()] = finished.has_registration()
                                           ? finished.registration().blade()
                                           : finished.refusal().code() + " " + finished.refusal().reason();
          return true;
        },
        limits_);
  }

  std::atomic<bool> alive_{true};
  Caller caller_;
  BatchLimits limits_;
  std::map<int, std::string> results_;
  std::vector<int> counts_;
  std::vector<v1::RegistrationProgress> progress_;
};

TEST_F(BatchTest, ARefusalEndsNothingButItsOwn) {
  const absl::Status status = Run(BatchOf(5), [](const v1::RegisterRequest& request, const Caller&) {
    if (request.blade() == "blades/sn2")
      return absl::StatusOr<v1::Registration>(runtime::Failure(errors::v1::CALIBRATION_EXPIRED, "machine: expired"));
    return absl::StatusOr<v1::Registration>(Answer(request));
  });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_THAT(results_, ElementsAre(Pair(0, "blades/sn0"), Pair(1, "blades/sn1"),
                                    Pair(2, "FAILED_PRECONDITION CALIBRATION_EXPIRED"), Pair(3, "blades/sn3"),
                                    Pair(4, "blades/sn4")));
  EXPECT_THAT(counts_, ElementsAre(1, 2, 3, 4, 5));
}

// On a thread of ours, where nobody else would catch it.
TEST_F(BatchTest, MemoryThatEndsIsOneBladesAnswer) {
  const absl::Status status =
      Run(BatchOf(3), [](const v1::RegisterRequest& request, const Caller&) -> absl::StatusOr<v1::Registration> {
        if (request.blade() == "blades/sn1") throw std::bad_alloc();
        return Answer(request);
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_THAT(results_,
              ElementsAre(Pair(0, "blades/sn0"), Pair(1, HasSubstr("RESOURCE_EXHAUSTED")), Pair(2, "blades/sn2")));
}

TEST_F(BatchTest, SkipsWhatTheCallerHas) {
  v1::RegisterBatchRequest batch = BatchOf(4);
  batch.add_skip(2);
  batch.add_skip(0);
  EXPECT_TRUE(Run(batch, [](const v1::RegisterRequest& request, const Caller&) { return Answer(request); }).ok());
  EXPECT_THAT(results_, ElementsAre(Pair(1, "blades/sn1"), Pair(3, "blades/sn3")));
  EXPECT_THAT(counts_, ElementsAre(3, 4));
  batch.add_skip(1);
  batch.add_skip(3);
  EXPECT_TRUE(Run(batch, [](const v1::RegisterRequest&, const Caller&) -> absl::StatusOr<v1::Registration> {
                ADD_FAILURE() << "nothing is left to do";
                return absl::InternalError("");
              }).ok());
}

TEST_F(BatchTest, EachRequestHasAnIdOfItsOwnThatStays) {
  const v1::RegisterBatchRequest batch = BatchOf(1000);
  std::set<std::string> ids;
  for (int i = 0; i < 1000; ++i) {
    const v1::RegisterRequest request = RequestAt(batch, i);
    EXPECT_EQ(request.request_id(), RequestAt(batch, i).request_id());
    EXPECT_TRUE(runtime::CheckUuid("request_id", request.request_id()).ok()) << request.request_id();
    ids.insert(request.request_id());
  }
  EXPECT_EQ(ids.size(), 1000u);
  v1::RegisterBatchRequest other = batch;
  other.set_request_id("00000000-0000-4000-8000-0000000000ab");
  EXPECT_EQ(ids.count(RequestAt(other, 0).request_id()), 0u);
}

TEST_F(BatchTest, WaitsForAServiceThatRestarts) {
  std::atomic<int> calls{0};
  const absl::Status status =
      Run(BatchOf(1), [&](const v1::RegisterRequest& request, const Caller&) -> absl::StatusOr<v1::Registration> {
        if (++calls == 1) return absl::UnavailableError("ingest: restarting");
        return Answer(request);
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(calls, 2);
  EXPECT_THAT(results_, ElementsAre(Pair(0, "blades/sn0")));
}

// A thousand refusals would say nothing of the blades.
TEST_F(BatchTest, EndsWhereAServiceStaysAway) {
  std::atomic<int> asked{0};
  const absl::Status status =
      Run(BatchOf(100), [&](const v1::RegisterRequest& request, const Caller&) -> absl::StatusOr<v1::Registration> {
        if (request.blade() == "blades/sn0") return Answer(request);
        ++asked;
        return absl::UnavailableError("ingest: gone");
      });
  EXPECT_TRUE(absl::IsUnavailable(status)) << status;
  EXPECT_THAT(results_, ElementsAre(Pair(0, "blades/sn0")));
  EXPECT_LT(asked, 20);
}

TEST_F(BatchTest, OneThatHangsIsRefusedAndTheOthersAreNot) {
  limits_.longest_one = 1s;
  const absl::Status status =
      Run(BatchOf(5), [](const v1::RegisterRequest& request, const Caller& caller) -> absl::StatusOr<v1::Registration> {
        if (request.blade() != "blades/sn1") return Answer(request);
        EXPECT_LE(caller.deadline, Clock::now() + 1s);
        EXPECT_LE(runtime::DeadlineOf(*caller.make_context()), Clock::now() + 1s);
        while (caller.keep_going()) std::this_thread::sleep_for(5ms);
        return absl::DeadlineExceededError("scan: late");
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(results_.size(), 5u);
  EXPECT_EQ(results_.at(1), "DEADLINE_EXCEEDED ");
}

// Alone it has all the batch's time, and is turned away like others where too many wait.
TEST_F(BatchTest, OneAloneIsAsRegister) {
  limits_.longest_one = 1s;
  for (const int count : {1, 2}) {
    const absl::Status status = Run(BatchOf(count), [&](const v1::RegisterRequest& request, const Caller& caller) {
      EXPECT_EQ(caller.deadline == caller_.deadline, count == 1);
      EXPECT_EQ(caller.patience,
                count == 1 ? runtime::ComputePool::Patience::kBounded : runtime::ComputePool::Patience::kPatient);
      return absl::StatusOr<v1::Registration>(Answer(request));
    });
    EXPECT_TRUE(status.ok()) << status;
  }
}

TEST_F(BatchTest, EndsWithItsDeadlineAndRefusesNoBladeForIt) {
  caller_.deadline = Clock::now() + 300ms;
  const absl::Status status = Run(
      BatchOf(50), [](const v1::RegisterRequest& request, const Caller& caller) -> absl::StatusOr<v1::Registration> {
        if (request.blade() == "blades/sn0") return Answer(request);
        while (caller.keep_going()) std::this_thread::sleep_for(5ms);
        return absl::DeadlineExceededError("late");
      });
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
  EXPECT_THAT(results_, ElementsAre(Pair(0, "blades/sn0")));
}

TEST_F(BatchTest, StopsOnceItsClientIsGone) {
  std::atomic<int> stopped{0};
  std::thread leaves([&] {
    std::this_thread::sleep_for(100ms);
    alive_ = false;
  });
  const absl::Status status =
      Run(BatchOf(50), [&](const v1::RegisterRequest&, const Caller& caller) -> absl::StatusOr<v1::Registration> {
        while (caller.keep_going()) std::this_thread::sleep_for(5ms);
        ++stopped;
        return absl::CancelledError("stopped");
      });
  leaves.join();
  EXPECT_TRUE(absl::IsCancelled(status)) << status;
  EXPECT_EQ(stopped, 2);  // those at work
  EXPECT_TRUE(results_.empty());

  // The same where the stream breaks before the call is known to be cancelled.
  alive_ = true;
  std::atomic<int> calls{0};
  const absl::Status broken = RunBatch(
      BatchOf(50), caller_,
      [&](const v1::RegisterRequest& request, const Caller&) {
        ++calls;
        return absl::StatusOr<v1::Registration>(Answer(request));
      },
      [](const v1::RegisterBatchResponse&) { return false; }, limits_);
  EXPECT_TRUE(absl::IsCancelled(broken)) << broken;
  EXPECT_LT(calls, 10);
}

// Nothing piles up in the server for a client that does not read.
TEST_F(BatchTest, AClientThatReadsSlowlyHoldsUpTheWork) {
  std::atomic<int> calls{0}, sent{0}, ahead{0};
  const absl::Status status = RunBatch(
      BatchOf(40), caller_,
      [&](const v1::RegisterRequest& request, const Caller&) {
        ++calls;
        return absl::StatusOr<v1::Registration>(Answer(request));
      },
      [&](const v1::RegisterBatchResponse&) {
        std::this_thread::sleep_for(5ms);
        ahead = std::max(ahead.load(), calls - sent);
        ++sent;
        return true;
      },
      limits_);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(calls, 40);
  // As many as are being sent, wait for that and are at work, two each, and one more that both workers may have let pass.
  EXPECT_LE(ahead, 8);
}

TEST_F(BatchTest, TellsHowFarEachIs) {
  const absl::Status status =
      Run(BatchOf(1), [](const v1::RegisterRequest& request, const Caller& caller) -> absl::StatusOr<v1::Registration> {
        for (const v1::RegistrationStep step :
             {v1::REGISTRATION_STEP_WAITING, v1::REGISTRATION_STEP_FETCHING, v1::REGISTRATION_STEP_FITTING}) {
          for (int i = 1; i <= 50; ++i) {
            v1::RegistrationProgress progress;
            progress.set_step(step);
            progress.set_iteration_count(i);
            caller.on_progress(progress);
            std::this_thread::sleep_for(5ms);
          }
        }
        return Answer(request);
      });
  EXPECT_TRUE(status.ok()) << status;
  std::set<v1::RegistrationStep> steps;
  for (const v1::RegistrationProgress& progress : progress_) steps.insert(progress.step());
  EXPECT_THAT(steps, UnorderedElementsAre(v1::REGISTRATION_STEP_WAITING, v1::REGISTRATION_STEP_FETCHING,
                                          v1::REGISTRATION_STEP_FITTING));
  EXPECT_LT(progress_.size(), 50u);  // not every one
  EXPECT_EQ(results_.size(), 1u);
}

TEST_F(BatchTest, RefusesWhatIsNoBatch) {
  const auto refusal = [](const v1::RegisterBatchRequest& batch) { return std::string(CheckBatch(batch).message()); };
  EXPECT_EQ(refusal(BatchOf(1000)), "");
  EXPECT_THAT(refusal(BatchOf(0)), HasSubstr("requests: 0 requests, want at least one"));
  v1::RegisterBatchRequest batch = BatchOf(2);
  batch.mutable_requests(1)->set_request_id(kSomeUuid);
  EXPECT_THAT(refusal(batch), HasSubstr("requests[1].request_id"));
  batch = BatchOf(2);
  batch.add_skip(2);
  EXPECT_THAT(refusal(batch), HasSubstr("skip[0]: 2, want an index of requests"));
  batch.set_skip(0, 1);
  batch.add_skip(1);
  EXPECT_THAT(refusal(batch), HasSubstr("skip[1]: 1, want each once"));
}

}  // namespace
}  // namespace sixpoint::registration
