#include "services/ingest/known_plant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/runtime/call.h"
#include "tests/services/ingest/fake_plant.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::ingest {
namespace {

using ::testing::HasSubstr;

class KnownPlantTest : public ::testing::Test {
 protected:
  static std::unique_ptr<grpc::ClientContext> Context() { return runtime::ContextFor(5.0); }

  FakePlant plant_;
  testing::InProcessServer server_{{&plant_}};
};

TEST_F(KnownPlantTest, AsksOnceWhileTheAnswerIsFresh) {
  KnownPlant known(server_.Connect(), std::chrono::hours(1));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(known.Machine("machines/m1", 0, Context).value().revision(), 3);
  EXPECT_EQ(plant_.asked_count, 1);
}

TEST_F(KnownPlantTest, AsksAgainOnceTheAnswerIsOld) {
  KnownPlant known(server_.Connect(), std::chrono::milliseconds(0));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(known.Machine("machines/m1", 0, Context).ok());
  EXPECT_EQ(plant_.asked_count, 3);
}

TEST_F(KnownPlantTest, HoldsToTheLastAnswerWhileThePlantIsAway) {
  KnownPlant known(server_.Connect(), std::chrono::milliseconds(0));
  ASSERT_TRUE(known.Machine("machines/m1", 0, Context).ok());
  plant_.away = true;
  EXPECT_EQ(known.Machine("machines/m1", 0, Context).value().revision(), 3);
  EXPECT_GT(plant_.asked_count, 1);
  // What it never heard of it cannot vouch for; that is no fault of the sender.
  EXPECT_TRUE(absl::IsUnavailable(known.Machine("machines/m2", 0, Context).status()));
}

TEST_F(KnownPlantTest, RefusesWhatThePlantDoesNotKnowByField) {
  KnownPlant known(server_.Connect());
  const absl::Status machine = known.Machine("machines/m2", 0, Context).status();
  EXPECT_TRUE(absl::IsInvalidArgument(machine)) << machine;
  EXPECT_THAT(std::string(machine.message()), HasSubstr("header.machine: machines/m2, want"));
  EXPECT_THAT(std::string(known.Subject("blades/none", Context).status().message()),
              HasSubstr("header.subject: blades/none, want"));
  EXPECT_EQ(known.Subject("artefacts/a1", Context).value().artefact_revision, 2);
  EXPECT_EQ(known.Subject("blades/sn1", Context).value().artefact_revision, 0);
}

TEST_F(KnownPlantTest, KnowsTheTightestToleranceOfABladesPart) {
  KnownPlant known(server_.Connect());
  EXPECT_EQ(known.Subject("blades/sn1", Context).value().tightest_tolerance_mm, 0.03);
  EXPECT_FALSE(known.Subject("artefacts/a1", Context).value().tightest_tolerance_mm.has_value());
}

}  // namespace
}  // namespace sixpoint::ingest
