// What keeps dispositions, PostgreSQL's and the fake that handlers are tested on.
#include <gtest/gtest.h>

#include <memory>

#include "storage/dispositions.h"
#include "tests/support/customers_parts.h"
#include "tests/support/fake_dispositions.h"
#include "tests/support/rows_of_m1.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

class DispositionStoreTest : public ::testing::Test {
 protected:
  using Store = ResultWriter<DispositionRow>;

  DispositionRow New() const {
    DispositionRow row;
    row.disposition_id = NewUuid();
    row.inspection_id = sixpoint::testing::IdOf(part_.inspection);
    row.blade_serial = sixpoint::testing::IdOf(part_.blade);
    row.machine_id = "m1";
    row.disposition = "CONCESSION";
    row.reason = "within the customer's own limits";
    row.reference = "C-118";
    row.requested_by = "users/jane";
    row.software_version = "test";
    return row;
  }
  absl::StatusOr<DispositionRow> Record(Store& store, const DispositionRow& row, const std::string& request_id = "",
                                        const std::string& bytes = "request") const {
    RecordEntry entry =
        sixpoint::testing::EntryOfM1("dispositions/" + row.disposition_id, {part_.inspection}, row.blade_serial);
    entry.requested_by = row.requested_by;
    return store.Record({"inspection.Dispose", request_id, bytes}, row, entry, sixpoint::testing::Soon());
  }
  static auto FindRecorded(const Store& store, const std::string& request_id) {
    return store.FindRecorded({"inspection.Dispose", request_id, "request"}, sixpoint::testing::Soon());
  }
  // Each test runs on both.
  template <typename Test>
  void OnBoth(const Test& test) {
    part_ = sixpoint::testing::PutCustomersPart(database_.database(), "open", false,
                                                sixpoint::testing::PutCalibratedMachine(database_.database()));
    {
      SCOPED_TRACE("the fake");
      sixpoint::testing::FakeDispositions fake;
      test(fake);
    }
    SCOPED_TRACE("PostgreSQL");
    test(*DispositionsIn(database_.database()));
  }

 private:
  sixpoint::testing::ThrowawayDatabase database_;
  sixpoint::testing::CustomersPart part_;
};

TEST_F(DispositionStoreTest, WhatARequestRecordedIsGivenAgain) {
  OnBoth([this](Store& store) {
    const DispositionRow row = New();
    const auto recorded = Record(store, row, sixpoint::testing::kSomeUuid);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    EXPECT_GT(recorded->recorded.sequence, 0);
    EXPECT_EQ(recorded->machine_id, "m1");
    const auto again = FindRecorded(store, sixpoint::testing::kSomeUuid);
    ASSERT_TRUE(again.ok() && again->has_value()) << again.status();
    EXPECT_EQ((*again)->disposition_id, row.disposition_id);
    EXPECT_EQ((*again)->inspection_id, row.inspection_id);
    EXPECT_EQ((*again)->blade_serial, row.blade_serial);
    EXPECT_EQ((*again)->machine_id, "");
    EXPECT_EQ((*again)->disposition, "CONCESSION");
    EXPECT_EQ((*again)->reason, row.reason);
    EXPECT_EQ((*again)->reference, "C-118");
    EXPECT_EQ((*again)->requested_by, "users/jane");
    EXPECT_EQ((*again)->recorded.sequence, recorded->recorded.sequence);
    EXPECT_EQ((*again)->recorded.recorded_at, recorded->recorded.recorded_at);
  });
}

TEST_F(DispositionStoreTest, TheSameRequestIsRecordedOnce) {
  OnBoth([this](Store& store) {
    const DispositionRow row = New();
    ASSERT_TRUE(Record(store, row, sixpoint::testing::kSomeUuid).ok());
    const auto again = Record(store, New(), sixpoint::testing::kSomeUuid);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->disposition_id, row.disposition_id);
    EXPECT_EQ(Record(store, New(), sixpoint::testing::kSomeUuid, "another").status().code(),
              absl::StatusCode::kAlreadyExists);
    const DispositionRow another = New();
    EXPECT_EQ(Record(store, another)->disposition_id, another.disposition_id);
    EXPECT_FALSE(FindRecorded(store, "")->has_value());
  });
}

}  // namespace
}  // namespace sixpoint::storage
