// What FleetReaders do, PostgreSQL's and the fake that handlers are tested on. What summaries say is in fleet_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/support/fake_fleet.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using std::chrono::hours;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Each test runs on both, with machines m1 to m3 that did nothing.
void OnBothFleets(const std::function<void(const FleetReader& fleet)>& test) {
  {
    SCOPED_TRACE("the fake");
    sixpoint::testing::FakeFleet fake;
    fake.rows.machine_ids = {"m1", "m2", "m3"};
    test(fake);
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  for (const char* id : {"m2", "m1", "m3"}) sixpoint::testing::RegisterMachine(*transaction, id);
  ASSERT_TRUE(transaction->Commit().ok());
  test(*FleetIn(database.database()));
}

// Before the machines were registered, which is something too.
SummarySpan Before() {
  const Instant hour(std::chrono::floor<hours>(std::chrono::system_clock::now().time_since_epoch()));
  return {SummaryPeriod::kHour, hour - hours(30), hour - hours(6)};
}

std::vector<std::string> Machines(const FleetReader& fleet, const std::string& machine_id, const std::string& after,
                                  int limit) {
  const absl::StatusOr<FleetRows> rows =
      fleet.Fleet({machine_id, after, limit, Before(), Reader::Everything()}, Soon());
  EXPECT_TRUE(rows.ok()) << rows.status();
  EXPECT_THAT(rows->activity, IsEmpty());
  EXPECT_LT(std::chrono::abs(rows->now - std::chrono::system_clock::now()), std::chrono::minutes(1));
  return rows->machine_ids;
}

TEST(FleetReader, MachinesAreInOrderFromAfterOneAndAsManyAsAreAskedFor) {
  OnBothFleets([](const FleetReader& fleet) {
    EXPECT_THAT(Machines(fleet, "", "", 9), ElementsAre("m1", "m2", "m3"));
    EXPECT_THAT(Machines(fleet, "", "m1", 1), ElementsAre("m2"));
    EXPECT_THAT(Machines(fleet, "", "m3", 9), IsEmpty());
    EXPECT_THAT(Machines(fleet, "m2", "", 9), ElementsAre("m2"));
    EXPECT_THAT(Machines(fleet, "nowhere", "", 9), IsEmpty());
  });
}

TEST(FleetReader, AMachineThatDidNothingIsToldFromOneThatIsNotThere) {
  OnBothFleets([](const FleetReader& fleet) {
    const auto idle = fleet.Activity("m1", Before(), Soon());
    ASSERT_TRUE(idle.ok() && idle->has_value()) << idle.status();
    EXPECT_THAT(**idle, IsEmpty());
    const auto none = fleet.Activity("nowhere", Before(), Soon());
    ASSERT_TRUE(none.ok()) << none.status();
    EXPECT_FALSE(none->has_value());
  });
}

}  // namespace
}  // namespace sixpoint::storage
