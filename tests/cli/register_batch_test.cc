// Many blades in one call, against services that only remember.
#include "cli/register_batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/batch_again.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using registration::v1::RegisterBatchRequest;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct PlantOfOnePart final : plant::v1::PlantService::Service {
  std::string address;
  grpc::Status ListEndpoints(grpc::ServerContext*, const plant::v1::ListEndpointsRequest*,
                             plant::v1::ListEndpointsResponse* out) override {
    out->add_endpoints()->set_area("registration");
    out->mutable_endpoints(0)->set_address(address);
    return grpc::Status::OK;
  }
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest*, plant::v1::Part* out) override {
    out->mutable_surface()->mutable_maximum_mm()->set_z_mm(100);
    return grpc::Status::OK;
  }
};

// Breaks off after so many, as often as is said.
struct InterruptedRegistration final : registration::v1::RegistrationService::Service {
  std::vector<grpc::Status> breaks;
  int count_until_break = 2;
  std::string refused_blade, unusable_blade;
  std::vector<std::vector<int>> skips;  // of each call
  std::vector<std::string> request_ids;
  std::vector<registration::v1::Registration> all;  // newest first
  int page_count = 0;
  double moves_to_x_mm = 0;  // where each blade stands now

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
        finished->mutable_refusal()->set_message("blade: no");
      } else {
        auto* registration = finished->mutable_registration();
        registration->set_name("registrations/" + std::to_string(i));
        registration->set_blade(in->requests(i).blade());
        registration->set_method(in->requests(i).method());
        for (const double r : {1, 0, 0, 0, 1, 0, 0, 0, 1}) registration->mutable_zero_from_part()->add_rotation(r);
        registration->mutable_zero_from_part()->mutable_translation_mm()->set_x_mm(moves_to_x_mm);
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
    std::vector<registration::v1::Registration> listed;
    for (const registration::v1::Registration& one : all)
      if ((in->blade().empty() || one.blade() == in->blade()) && (in->part().empty() || one.part() == in->part()) &&
          (in->machine().empty() || one.machine() == in->machine()) &&
          one.recorded_at().seconds() >= in->recorded().from().seconds() &&
          (!in->recorded().has_until() || one.recorded_at().seconds() < in->recorded().until().seconds()) &&
          !(in->without_for_inspection() && one.for_inspection()))
        listed.push_back(one);
    // At most three a page.
    const std::size_t from = in->page_token().empty() ? 0 : std::stoul(in->page_token());
    const std::size_t end = std::min(listed.size(), from + static_cast<std::size_t>(std::min(in->page_size(), 3)));
    for (std::size_t i = from; i < end; ++i) *out->add_registrations() = listed[i];
    ++page_count;
    if (end < listed.size()) out->set_next_page_token(std::to_string(end));
    return grpc::Status::OK;
  }
};

class RegisterBatchTest : public ::testing::Test {
 protected:
  RegisterBatchTest() : server_({&plant_, &registration_}) {
    plant_.address = server_.address();
    session_.server = server_.address();
    session_.credentials = grpc::InsecureChannelCredentials();
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
    session_.OnCommand(line_.root(), [&] { return RegisterBatch(&session_, batch); });
    line_.Parse("");
    std::ostringstream out;
    std::streambuf* const before = std::cout.rdbuf(out.rdbuf());
    exit_code_ = session_.Run();
    std::cout.rdbuf(before);
    return out.str();
  }

  PlantOfOnePart plant_;
  InterruptedRegistration registration_;
  testing::InProcessServer server_;
  Session session_;
  CommandLine line_;
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

registration::v1::Registration Stored(int number, const std::string& blade, const std::string& part,
                                      const std::string& machine, std::int64_t at_s) {
  registration::v1::Registration one;
  one.set_name("registrations/old-" + std::to_string(number));
  one.set_blade(blade);
  one.set_part(part);
  one.set_machine(machine);
  one.add_scans("scans/s" + std::to_string(number));
  one.set_method(registration::v1::METHOD_SIX_POINT);
  one.mutable_recorded_at()->set_seconds(at_s);
  for (const double r : {1, 0, 0, 0, 1, 0, 0, 0, 1}) one.mutable_zero_from_part()->add_rotation(r);
  one.mutable_zero_from_part()->mutable_translation_mm();
  return one;
}

// Newest first, over several pages; the latest of each blade within the time, but what an inspection made for itself.
TEST_F(RegisterBatchTest, TakesThePartsBladesOfATimeAgain) {
  registration_.all = {
      Stored(9, "blades/B", "parts/p", "machines/m", 900),     Stored(8, "blades/A", "parts/p", "machines/m", 800),
      Stored(7, "blades/X", "parts/other", "machines/m", 700), Stored(6, "blades/B", "parts/p", "machines/m", 600),
      Stored(5, "blades/C", "parts/p", "machines/n", 500),     Stored(4, "blades/D", "parts/p", "machines/m", 400),
      Stored(3, "blades/E", "parts/p", "machines/m", 300),     Stored(2, "blades/F", "parts/p", "machines/m", 200),
      Stored(1, "blades/G", "parts/p", "machines/m", 100)};
  registration_.all.insert(registration_.all.begin() + 1, Stored(85, "blades/A", "parts/p", "machines/m", 840));
  registration_.all[1].set_for_inspection(true);
  registration::v1::ListRegistrationsRequest which;
  which.set_part("parts/p");
  which.mutable_recorded()->mutable_from()->set_seconds(450);
  which.mutable_recorded()->mutable_until()->set_seconds(850);
  auto again = BatchOfPart(&session_, which, registration::v1::METHOD_UNSPECIFIED, false);
  ASSERT_TRUE(again.ok()) << again.status();
  std::vector<std::string> before;
  for (const auto& one : again->before) before.push_back(one.name());
  EXPECT_THAT(before, ElementsAre("registrations/old-8", "registrations/old-6", "registrations/old-5"));
  EXPECT_EQ(registration_.page_count, 1);  // only what is meant was sent
  EXPECT_THAT(again->request.requests(1).scans(), ElementsAre("scans/s6"));
  EXPECT_EQ(again->request.requests(1).method(), registration::v1::METHOD_SIX_POINT);

  which.set_machine("machines/n");
  again = BatchOfPart(&session_, which, registration::v1::METHOD_BEST_FIT, false);
  ASSERT_TRUE(again.ok());
  ASSERT_EQ(again->request.requests_size(), 1);
  EXPECT_EQ(again->request.requests(0).blade(), "blades/C");
  EXPECT_EQ(again->request.requests(0).method(), registration::v1::METHOD_BEST_FIT);

  which.set_part("parts/none");
  EXPECT_THAT(std::string(BatchOfPart(&session_, which, registration::v1::METHOD_LOCAL, false).status().message()),
              HasSubstr("--part: none, want a part of which a blade was registered in that time"));
}

TEST_F(RegisterBatchTest, ShowsHowFarEachBladeMoved) {
  RegisterBatchRequest batch = BatchOf(2);
  const std::vector<registration::v1::Registration> before = {Stored(1, "blades/SN-0", "parts/p", "machines/m", 1),
                                                              Stored(2, "blades/SN-1", "parts/p", "machines/m", 1)};
  registration_.moves_to_x_mm = 0.0123;
  session_.OnCommand(line_.root(), [&] { return RegisterBatch(&session_, batch, before); });
  line_.Parse("");
  std::ostringstream out;
  std::streambuf* const old = std::cout.rdbuf(out.rdbuf());
  exit_code_ = session_.Run();
  std::cout.rdbuf(old);
  EXPECT_EQ(exit_code_, kDone);
  EXPECT_THAT(out.str(), HasSubstr("moved at most um"));
  EXPECT_THAT(out.str(), HasSubstr("12.300"));
  EXPECT_THAT(out.str(), HasSubstr("old-2"));
}

TEST_F(RegisterBatchTest, RegistersOneWithProgressAndRefusesAsRegisterDoes) {
  registration::v1::RegisterRequest request = BatchOf(1).requests(0);
  request.set_request_id("00000000-0000-4000-8000-0000000000aa");
  const auto done = RegisterWatched(&session_, request);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->blade(), "blades/SN-0");
  registration_.refused_blade = "blades/SN-0";
  const absl::Status refused = RegisterWatched(&session_, request).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(refused), "CALIBRATION_EXPIRED");
  EXPECT_EQ(refused.message(), "blade: no");
}

TEST_F(RegisterBatchTest, TakesEachBladesLatestRegistrationAgain) {
  registration_.all = {Stored(3, "blades/SN-1", "parts/p", "machines/m", 3),  // made by an inspection for itself
                       Stored(2, "blades/SN-2", "parts/p", "machines/m", 2),
                       Stored(1, "blades/SN-1", "parts/p", "machines/m", 1)};
  registration_.all[0].set_for_inspection(true);
  registration_.all[2].add_angles();  // as uncertain as the axis is, without a table
  registration_.all[1].add_angles()->set_characterisation("calibrations/x");
  registration_.all[2].set_method(registration::v1::METHOD_LOCAL);
  auto batch =
      BatchOfLatest(&session_, {"SN-1", "blades/SN-2"}, registration::v1::METHOD_UNSPECIFIED, /*axis_tables=*/false);
  ASSERT_TRUE(batch.ok()) << batch.status();
  ASSERT_EQ(batch->request.requests_size(), 2);
  EXPECT_EQ(batch->before[1].blade(), "blades/SN-2");
  EXPECT_THAT(batch->request.requests(0).scans(), ElementsAre("scans/s1"));
  EXPECT_EQ(batch->request.requests(0).method(), registration::v1::METHOD_LOCAL);
  EXPECT_FALSE(batch->request.requests(0).apply_axis_tables());
  EXPECT_TRUE(batch->request.requests(1).apply_axis_tables());
  batch = BatchOfLatest(&session_, {"SN-1"}, registration::v1::METHOD_SIX_POINT, /*axis_tables=*/true);
  ASSERT_TRUE(batch.ok());
  EXPECT_EQ(batch->request.requests(0).method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_TRUE(batch->request.requests(0).apply_axis_tables());
  const auto none = BatchOfLatest(&session_, {"SN-9"}, registration::v1::METHOD_LOCAL, false);
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("--blades: SN-9, want blades that were registered"));
}

}  // namespace
}  // namespace sixpoint::cli
