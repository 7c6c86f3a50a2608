// Many blades in one call, against services that only remember.
#include "cli/register_batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/document.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using registration::v1::RegisterBatchRequest;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct FakePlant final : plant::v1::PlantService::Service {
  std::string address;
  grpc::Status ListEndpoints(grpc::ServerContext*, const plant::v1::ListEndpointsRequest*,
                             plant::v1::ListEndpointsResponse* out) override {
    out->add_endpoints()->set_area("registration");
    out->mutable_endpoints(0)->set_address(address);
    return grpc::Status::OK;
  }
};

// Breaks off after so many, as often as is said.
struct FakeRegistration final : registration::v1::RegistrationService::Service {
  std::vector<grpc::Status> breaks;
  int count_until_break = 2;
  std::string refused_blade, unusable_blade;
  std::vector<std::vector<int>> skips;  // of each call
  std::vector<std::string> request_ids;
  std::map<std::string, registration::v1::Registration> latest;

  grpc::Status RegisterBatch(grpc::ServerContext*, const RegisterBatchRequest* in,
                             grpc::ServerWriter<registration::v1::RegisterBatchResponse>* writer) override {
    const std::size_t call = skips.size();
    skips.emplace_back(in->skip().begin(), in->skip().end());
    request_ids.push_back(in->request_id());
    int sent = 0;
    for (int i = 0; i < in->requests_size(); ++i) {
      if (std::find(skips.back().begin(), skips.back().end(), i) != skips.back().end()) continue;
      if (call < breaks.size() && sent == count_until_break) return breaks[call];
      registration::v1::RegisterBatchResponse response;
      response.set_total_count(in->requests_size());
      response.mutable_progress()->set_index(i);
      response.mutable_progress()->set_step(registration::v1::REGISTRATION_STEP_FITTING);
      writer->Write(response);
      auto* finished = response.mutable_finished();
      finished->set_index(i);
      if (in->requests(i).blade() == refused_blade) {
        finished->mutable_refusal()->set_code("FAILED_PRECONDITION");
        finished->mutable_refusal()->set_reason("CALIBRATION_EXPIRED");
      } else {
        auto* registration = finished->mutable_registration();
        registration->set_name("registrations/" + std::to_string(i));
        registration->set_blade(in->requests(i).blade());
        registration->set_method(in->requests(i).method());
        registration->mutable_evidence()->set_outcome(in->requests(i).blade() == unusable_blade
                                                          ? registration::v1::OUTCOME_NOT_DETERMINED
                                                          : registration::v1::OUTCOME_CONVERGED);
      }
      writer->Write(response);
      ++sent;
    }
    return grpc::Status::OK;
  }
  grpc::Status ListRegistrations(grpc::ServerContext*, const registration::v1::ListRegistrationsRequest* in,
                                 registration::v1::ListRegistrationsResponse* out) override {
    if (latest.count(in->blade()) > 0) *out->add_registrations() = latest.at(in->blade());
    return grpc::Status::OK;
  }
};

class RegisterBatchTest : public ::testing::Test {
 protected:
  RegisterBatchTest() : server_({&plant_, &registration_}) {
    plant_.address = server_.address();
    session_.server = server_.address();
  }
  static RegisterBatchRequest BatchOf(int count) {
    RegisterBatchRequest batch;
    for (int i = 0; i < count; ++i) {
      batch.add_requests()->set_blade("blades/SN-" + std::to_string(i));
      batch.mutable_requests(i)->set_method(registration::v1::METHOD_LOCAL);
    }
    batch.set_request_id("00000000-0000-4000-8000-0000000000aa");
    return batch;
  }
  // What was printed; the exit code as Session::Run gives it.
  std::string Run(const RegisterBatchRequest& batch) {
    session_.OnCommand(&app_, [&] { return RegisterBatch(&session_, batch); });
    app_.parse("");
    std::ostringstream out;
    std::streambuf* const before = std::cout.rdbuf(out.rdbuf());
    exit_code_ = session_.Run();
    std::cout.rdbuf(before);
    return out.str();
  }

  FakePlant plant_;
  FakeRegistration registration_;
  testing::InProcessServer server_;
  Session session_;
  CLI::App app_;
  int exit_code_ = -1;
};

TEST_F(RegisterBatchTest, PrintsATableOfAllAndOfWhatWasRefused) {
  registration_.refused_blade = "blades/SN-1";
  const std::string text = Run(BatchOf(3));
  EXPECT_EQ(exit_code_, kNotUsable);
  EXPECT_THAT(text, HasSubstr("SN-0"));
  EXPECT_THAT(text, HasSubstr("CALIBRATION_EXPIRED"));
  EXPECT_THAT(text, HasSubstr("3 of 3 blades done, 1 refused, 0 without a usable pose"));
  registration_.refused_blade.clear();
  registration_.unusable_blade = "blades/SN-2";
  EXPECT_THAT(Run(BatchOf(3)), HasSubstr("0 refused, 1 without a usable pose"));
  EXPECT_EQ(exit_code_, kNotUsable);
}

TEST_F(RegisterBatchTest, PrintsALineOfJsonForEachResult) {
  session_.json = true;
  registration_.refused_blade = "blades/SN-1";
  std::istringstream lines(Run(BatchOf(2)));
  std::vector<nlohmann::json> parsed;
  for (std::string line; std::getline(lines, line);) parsed.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(parsed.size(), 4u);
  EXPECT_EQ(parsed[0]["request_id"], "00000000-0000-4000-8000-0000000000aa");
  EXPECT_EQ(parsed[1]["index"], 0);
  EXPECT_EQ(parsed[1]["registration"]["name"], "registrations/0");
  EXPECT_EQ(parsed[2]["blade"], "blades/SN-1");
  EXPECT_EQ(parsed[2]["refusal"]["reason"], "CALIBRATION_EXPIRED");
  EXPECT_EQ(parsed[3], (nlohmann::json{{"finished_count", 2}, {"refused_count", 1}, {"not_converged_count", 0}}));
}

TEST_F(RegisterBatchTest, GoesOnWhereACallBrokeOff) {
  registration_.breaks = {{grpc::StatusCode::DEADLINE_EXCEEDED, "its time is over"},
                          {grpc::StatusCode::UNAVAILABLE, "restarting"}};
  const std::string text = Run(BatchOf(6));
  EXPECT_EQ(exit_code_, kDone);
  EXPECT_THAT(text, HasSubstr("6 of 6 blades done, 0 refused"));
  EXPECT_THAT(registration_.skips, ElementsAre(IsEmpty(), ElementsAre(0, 1), ElementsAre(0, 1, 2, 3)));
  for (const std::string& id : registration_.request_ids) EXPECT_EQ(id, "00000000-0000-4000-8000-0000000000aa");
}

TEST_F(RegisterBatchTest, EndsWithAFailureThatIsNoBreakAndTellsWhatWasDone) {
  registration_.breaks = {{grpc::StatusCode::INVALID_ARGUMENT, "requests: no"}};
  EXPECT_THAT(Run(BatchOf(6)), HasSubstr("2 of 6 blades done"));
  EXPECT_EQ(exit_code_, kFailed);
  EXPECT_EQ(registration_.skips.size(), 1u);
}

// A server that ends every call without a result is not asked for ever.
TEST_F(RegisterBatchTest, EndsWhereNothingGoesOn) {
  registration_.count_until_break = 0;
  registration_.breaks.assign(50, {grpc::StatusCode::DEADLINE_EXCEEDED, "its time is over"});
  Run(BatchOf(2));
  EXPECT_EQ(exit_code_, kFailed);
  EXPECT_EQ(registration_.skips.size(), 1u);
}

TEST_F(RegisterBatchTest, ReadsAFile) {
  const auto batch = BatchFromDocument(nlohmann::json::parse(R"({"registrations": [
    {"blade": "SN-1", "scans": ["a", "scans/b"], "method": "six-point"},
    {"blade": "SN-2", "scans": ["c"], "method": "local", "axis_tables": true}]})"));
  ASSERT_TRUE(batch.ok()) << batch.status();
  ASSERT_EQ(batch->requests_size(), 2);
  EXPECT_EQ(batch->requests(0).blade(), "blades/SN-1");
  EXPECT_THAT(batch->requests(0).scans(), ElementsAre("scans/a", "scans/b"));
  EXPECT_EQ(batch->requests(0).method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_FALSE(batch->requests(0).apply_axis_tables());
  EXPECT_TRUE(batch->requests(1).apply_axis_tables());

  const auto wrong = BatchFromDocument(nlohmann::json::parse(R"({"registrations": [
    {"blade": "SN-1", "scans": [], "method": "guess", "tables": true}]})"));
  const std::string message(wrong.status().message());
  EXPECT_THAT(message, HasSubstr("registrations[0].scans"));
  EXPECT_THAT(message, HasSubstr("registrations[0].method: \"guess\", want one of best-fit"));
  EXPECT_THAT(message, HasSubstr("tables"));
  EXPECT_FALSE(BatchFromDocument(nlohmann::json::parse(R"({"registrations": []})")).ok());
}

TEST_F(RegisterBatchTest, TakesEachBladesLatestRegistrationAgain) {
  registration::v1::Registration& latest = registration_.latest["blades/SN-1"];
  latest.set_blade("blades/SN-1");
  latest.add_scans("scans/a");
  latest.set_method(registration::v1::METHOD_LOCAL);
  registration_.latest["blades/SN-2"] = latest;
  registration_.latest["blades/SN-2"].set_blade("blades/SN-2");
  registration_.latest["blades/SN-2"].add_angles();
  auto batch =
      BatchOfLatest(&session_, {"SN-1", "blades/SN-2"}, registration::v1::METHOD_UNSPECIFIED, /*axis_tables=*/false);
  ASSERT_TRUE(batch.ok()) << batch.status();
  ASSERT_EQ(batch->requests_size(), 2);
  EXPECT_THAT(batch->requests(0).scans(), ElementsAre("scans/a"));
  EXPECT_EQ(batch->requests(0).method(), registration::v1::METHOD_LOCAL);
  EXPECT_FALSE(batch->requests(0).apply_axis_tables());
  EXPECT_TRUE(batch->requests(1).apply_axis_tables());
  batch = BatchOfLatest(&session_, {"SN-1"}, registration::v1::METHOD_SIX_POINT, /*axis_tables=*/true);
  ASSERT_TRUE(batch.ok());
  EXPECT_EQ(batch->requests(0).method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_TRUE(batch->requests(0).apply_axis_tables());
  const auto none = BatchOfLatest(&session_, {"SN-9"}, registration::v1::METHOD_LOCAL, false);
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("--blades: SN-9, want blades that were registered"));
}

}  // namespace
}  // namespace sixpoint::cli
