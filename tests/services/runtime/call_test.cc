#include "services/runtime/call.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "services/runtime/errors.h"
#include "services/runtime/trace.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::runtime {
namespace {

using ingest::v1::GetScanRequest;
using ingest::v1::Scan;
using ingest::v1::ScanService;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Answers with what it sees of its own call.
class Mirror : public ScanService::Service {
 public:
  grpc::Status GetScan(grpc::ServerContext* context, const GetScanRequest* request, Scan*) override {
    ++calls;
    if (request->name() == "unavailable twice" && calls < 3) return {grpc::StatusCode::UNAVAILABLE, "not yet"};
    if (request->name() == "aborted") return {grpc::StatusCode::ABORTED, "once is enough"};
    if (request->name() == "wait") {
      const std::function<bool()> keep_going = KeepGoing(*context);
      while (keep_going()) std::this_thread::sleep_for(milliseconds(5));
      const absl::Status stopped = Stopped(*context, "nothing is kept");
      told = stopped.code();
      ended = true;
      return ToGrpc(stopped);
    }
    deadline = DeadlineOf(*context);
    const std::unique_ptr<grpc::ClientContext> onward = ContextFor(*context);
    onward_deadline = DeadlineOf(*onward);
    return grpc::Status::OK;
  }
  std::atomic<int> calls{0};
  std::atomic<bool> ended{false};
  std::atomic<absl::StatusCode> told{absl::StatusCode::kOk};
  steady_clock::time_point deadline, onward_deadline;
};

class CallTest : public ::testing::Test {
 protected:
  grpc::Status Get(const std::string& name, grpc::ClientContext* context) {
    GetScanRequest request;
    request.set_name(name);
    Scan scan;
    return stub_->GetScan(context, request, &scan);
  }
  Mirror mirror_;
  sixpoint::testing::InProcessServer server_{{&mirror_}};
  std::unique_ptr<ScanService::Stub> stub_ = ScanService::NewStub(server_.Connect());
};

TEST_F(CallTest, TheClientsDeadlineIsOursAndAnEarlierOneGoesOn) {
  const std::unique_ptr<grpc::ClientContext> context = ContextFor(10.0);
  ASSERT_TRUE(Get("x", context.get()).ok());
  const double off_s = std::chrono::duration<double>(mirror_.deadline - DeadlineOf(*context)).count();
  EXPECT_LT(std::abs(off_s), 0.5);  // the wire carries what is left, not the instant
  EXPECT_LT(mirror_.onward_deadline, mirror_.deadline);
  EXPECT_GT(mirror_.onward_deadline, mirror_.deadline - milliseconds(500));
}

TEST_F(CallTest, WithoutADeadlineThereIsOneAllTheSame) {
  grpc::ClientContext context;
  ASSERT_TRUE(Get("x", &context).ok());
  const double left_s = std::chrono::duration<double>(mirror_.deadline - steady_clock::now()).count();
  EXPECT_GT(left_s, 100);
  EXPECT_LE(left_s, 120);
}

TEST_F(CallTest, WorkStopsWhenTheClientIsGone) {
  grpc::ClientContext context;
  std::thread leaves([&] {
    while (mirror_.calls == 0) std::this_thread::sleep_for(milliseconds(1));
    context.TryCancel();
  });
  EXPECT_EQ(Get("wait", &context).error_code(), grpc::StatusCode::CANCELLED);
  leaves.join();
  for (int i = 0; i < 400 && !mirror_.ended; ++i) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(mirror_.ended);
  EXPECT_EQ(mirror_.told, absl::StatusCode::kCancelled);
}

TEST_F(CallTest, WorkStopsAtTheDeadline) {
  const std::unique_ptr<grpc::ClientContext> context = ContextFor(0.2);
  EXPECT_EQ(Get("wait", context.get()).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  for (int i = 0; i < 400 && !mirror_.ended; ++i) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(mirror_.ended);
  EXPECT_EQ(mirror_.told, absl::StatusCode::kDeadlineExceeded);
}

TEST_F(CallTest, UnavailableIsRetriedAndNothingElse) {
  EXPECT_TRUE(Get("unavailable twice", ContextFor(10.0).get()).ok());
  EXPECT_EQ(mirror_.calls, 3);
  EXPECT_EQ(Get("aborted", ContextFor(10.0).get()).error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(mirror_.calls, 4);
}

TEST(Trace, NewOnesAreWellFormedAndDiffer) {
  const std::string first = NewTraceparent(), second = NewTraceparent();
  EXPECT_EQ(TraceIdOf(first).size(), 32u);
  EXPECT_NE(TraceIdOf(first), TraceIdOf(second));
  EXPECT_EQ(TraceIdOf("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"),  // W3C's example
            "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(TraceIdOf("00-4bf92f3577b34da6a3ce929d0e0e473G-00f067aa0ba902b7-01"), "");
  EXPECT_EQ(TraceIdOf("00-00000000000000000000000000000000-00f067aa0ba902b7-01"), "");
  EXPECT_EQ(TraceIdOf(""), "");
}

}  // namespace
}  // namespace sixpoint::runtime
