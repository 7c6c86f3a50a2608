// Whose machine a request is about. Roles and certificates are tried on the real processes (tests/end_to_end/door_test.cc).
#include "services/runtime/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "services/runtime/errors.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::MethodDescriptor;
using identity::Identity;

// What the journal of these tests knows: the machine of each name.
const std::map<std::string, std::string> kRecorded = {
    {"scans/mine", "m1"}, {"scans/theirs", "m2"}, {"registrations/theirs", "m2"}, {"blades/b1", ""}};

class AccessTest : public ::testing::Test {
 protected:
  // OK, or the reason of the refusal.
  std::string Asked(const std::string& method, const google::protobuf::Message& request) const {
    const MethodDescriptor* const found = DescriptorPool::generated_pool()->FindMethodByName("sixpoint." + method);
    if (found == nullptr) return "no such method";
    const absl::Status status = access_.CheckMachine(*found, caller_, request, {});
    return status.ok() ? "OK" : runtime::ReasonOf(status);
  }

  identity::Trust trust_{"/nowhere", "/nowhere"};
  SessionEnds session_ends_;
  Access access_{&trust_, &session_ends_,
                 [](const std::string& name, auto) -> absl::StatusOr<std::optional<std::string>> {
                   const auto found = kRecorded.find(name);
                   if (found == kRecorded.end()) return std::nullopt;
                   return found->second;
                 }};
  Identity caller_ = identity::IdentityOf("machines/m1", {}).value();
};

TEST_F(AccessTest, AMachineAsksForItsOwnAlone) {
  plant::v1::GetMachineRequest machine;
  for (const auto& [name, wanted] : std::map<std::string, std::string>{{"machines/m1", "OK"},
                                                                       {"machines/m1@3", "OK"},
                                                                       {"machines/m2", "MACHINE_DIFFERS"},
                                                                       {"machines/m11", "MACHINE_DIFFERS"},
                                                                       {"machines/m", "MACHINE_DIFFERS"},
                                                                       {"machines/M1", "MACHINE_DIFFERS"},
                                                                       {"machines/m2@1", "MACHINE_DIFFERS"},
                                                                       {"machines/m1/../m2", "MACHINE_DIFFERS"},
                                                                       {"machines/", "MACHINE_DIFFERS"},
                                                                       {"Machines/m2", "MACHINE_DIFFERS"},
                                                                       {"m1", "MACHINE_DIFFERS"},
                                                                       {"", "MACHINE_DIFFERS"}}) {
    machine.set_name(name);
    EXPECT_EQ(Asked("plant.v1.PlantService.GetMachine", machine), wanted) << name;
  }
}

// What nothing is recorded under says no more than what is another's.
TEST_F(AccessTest, WhatIsRecordedIsItsMachines) {
  ingest::v1::GetScanRequest scan;
  for (const auto& [name, wanted] : std::map<std::string, std::string>{{"scans/mine", "OK"},
                                                                       {"scans/theirs", "MACHINE_DIFFERS"},
                                                                       {"scans/unheard-of", "MACHINE_DIFFERS"},
                                                                       {"SCANS/MINE", "MACHINE_DIFFERS"}}) {
    scan.set_name(name);
    EXPECT_EQ(Asked("ingest.v1.ScanService.GetScan", scan), wanted) << name;
  }
  correction::v1::CorrectRequest correct;
  correct.set_registration("registrations/theirs");
  EXPECT_EQ(Asked("correction.v1.CorrectionService.Correct", correct), "MACHINE_DIFFERS");
}

TEST_F(AccessTest, OneOfSeveralThatIsAnothersIsEnough) {
  registration::v1::RegisterRequest request;
  request.add_scans("scans/mine");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.Register", request), "OK");
  request.add_scans("scans/theirs");
  EXPECT_EQ(Asked("registration.v1.RegistrationService.Register", request), "MACHINE_DIFFERS");
}

TEST_F(AccessTest, WhatIsAskedInAMessageWithinIsOwnToo) {
  correction::v1::CorrectScansRequest request;
  request.mutable_registration()->add_scans("scans/mine");
  EXPECT_EQ(Asked("correction.v1.CorrectionService.CorrectScans", request), "OK");
  request.mutable_registration()->add_scans("scans/theirs");
  EXPECT_EQ(Asked("correction.v1.CorrectionService.CorrectScans", request), "MACHINE_DIFFERS");
  request.mutable_registration()->set_scans(1, "");
  EXPECT_EQ(Asked("correction.v1.CorrectionService.CorrectScans", request), "MACHINE_DIFFERS");
}

// A list without its filter would be everybody's.
TEST_F(AccessTest, AListIsOfItsOwnMachineAlone) {
  ingest::v1::ListScansRequest request;
  EXPECT_EQ(Asked("ingest.v1.ScanService.ListScans", request), "MACHINE_DIFFERS");
  request.set_machine("machines/m1");
  EXPECT_EQ(Asked("ingest.v1.ScanService.ListScans", request), "OK");
}

TEST_F(AccessTest, OnlyMachinesAreAskedFor) {
  caller_ = identity::IdentityOf("users/jane", {identity::Role::kEngineer}).value();
  plant::v1::GetMachineRequest machine;
  machine.set_name("machines/m2");
  EXPECT_EQ(Asked("plant.v1.PlantService.GetMachine", machine), "OK");
}

}  // namespace
}  // namespace sixpoint::runtime
