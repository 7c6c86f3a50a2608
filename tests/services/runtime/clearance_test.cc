// By which fields a request names something of a part. Whose it is, and every method, is tried on the real processes
// (tests/end_to_end/clearance_test.cc).
#include "services/runtime/clearance.h"

#include <gtest/gtest.h>

#include <map>

#include "services/runtime/errors.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"
#include "tests/support/fake_clearances.h"

namespace sixpoint::runtime {
namespace {

class ClearanceTest : public ::testing::Test {
 protected:
  ClearanceTest() {
    fake_->customers = {{"p1", "acme"}};
    fake_->part_of = {{"parts/p1", "p1"}, {"scans/hidden", "p1"}, {"scans/open", "p2"}, {"blades/open", "p2"}};
  }
  // OK, or the reason and the field.
  std::string Asked(const std::string& method, const google::protobuf::Message& request,
                    const storage::Reader& reader = {"users/jane"}) const {
    const auto* found = google::protobuf::DescriptorPool::generated_pool()->FindMethodByName("sixpoint." + method);
    if (found == nullptr) return "no such method";
    const absl::Status status = Clearance(fake_).Check(*found, reader, request, {});
    if (status.ok()) return "OK";
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << status;
    const std::string message(status.message());
    return ReasonOf(status) + " " + message.substr(0, message.find(':'));
  }
  std::shared_ptr<sixpoint::testing::FakeClearances> fake_ = std::make_shared<sixpoint::testing::FakeClearances>();
};

TEST_F(ClearanceTest, EveryNamedThingIsAsked) {
  registration::v1::RegisterRequest request;
  EXPECT_EQ(Asked("registration.v1.RegistrationService.Register", request), "OK") << "nothing is named";
  request.set_blade("blades/open");
  request.add_scans("scans/open");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.Register", request), "OK");
  request.add_scans("scans/hidden");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.Register", request), "CLEARANCE_MISSING scans");
  registration::v1::RegisterBatchRequest batch;
  batch.add_requests()->add_scans("scans/open");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.RegisterBatch", batch), "OK");
  batch.add_requests()->add_scans("scans/hidden");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.RegisterBatch", batch), "CLEARANCE_MISSING requests.scans");
  batch.mutable_requests(1)->clear_scans();
  batch.mutable_requests(1)->set_blade("blades/unheard-of");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.RegisterBatch", batch), "CLEARANCE_MISSING requests.blade");
}

TEST_F(ClearanceTest, WhatIsNotRecordedIsRefusedToWhomSomethingIsHidden) {
  ingest::v1::GetScanRequest scan;
  scan.set_name("scans/unheard-of");
  EXPECT_EQ(Asked("ingest.v1.ScanService.GetScan", scan), "CLEARANCE_MISSING name");
  EXPECT_EQ(Asked("ingest.v1.ScanService.GetScan", scan, storage::Reader::Everything()), "OK");
  fake_->clearances = {{"users/jane", "customers/acme"}};
  EXPECT_EQ(Asked("ingest.v1.ScanService.GetScan", scan), "OK") << "its handler says that there is none";
}

// What is of no part is asked of nobody, and a list leaves out what is hidden by itself.
TEST_F(ClearanceTest, RulesThatNameNothingAskNothing) {
  plant::v1::GetMachineRequest machine;
  machine.set_name("machines/unheard-of");
  EXPECT_EQ(Asked("plant.v1.PlantService.GetMachine", machine), "OK");
  ingest::v1::ListScansRequest list;
  list.set_part("parts/p1");
  EXPECT_EQ(Asked("ingest.v1.ScanService.ListScans", list), "OK");
  plant::v1::CreateBladeRequest blade;
  blade.set_part("parts/p1");
  EXPECT_EQ(Asked("plant.v1.PlantService.CreateBlade", blade), "CLEARANCE_MISSING part");
}

// As where a contract without such a rule had been built after all.
TEST_F(ClearanceTest, AMethodThatSaysNothingOfPartsIsForWhoSeesAll) {
  google::protobuf::FileDescriptorProto file;
  file.set_name("without_rules.proto");
  file.add_dependency("sixpoint/ingest/v1/ingest.proto");
  auto& service = *file.add_service();
  service.set_name("WithoutRules");
  service.add_method()->set_name("GetScan");
  service.mutable_method(0)->set_input_type(".sixpoint.ingest.v1.GetScanRequest");
  service.mutable_method(0)->set_output_type(".sixpoint.ingest.v1.GetScanRequest");
  ASSERT_NE(ingest::v1::GetScanRequest::descriptor(), nullptr);  // its file is in the pool from here on
  google::protobuf::DescriptorPool pool(google::protobuf::DescriptorPool::generated_pool());
  const auto* built = pool.BuildFile(file);
  ASSERT_NE(built, nullptr);
  const auto* method = built->service(0)->method(0);
  ingest::v1::GetScanRequest scan;
  scan.set_name("scans/open");
  EXPECT_FALSE(Clearance(fake_).Check(*method, {"users/jane"}, scan, {}).ok());
  EXPECT_TRUE(Clearance(fake_).Check(*method, storage::Reader::Everything(), scan, {}).ok());
}

}  // namespace
}  // namespace sixpoint::runtime
