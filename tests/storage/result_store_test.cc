// What every ResultStore does, of PostgreSQL's and of the fake that handlers are tested on.
#include "storage/result_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "tests/storage/result_store_fixture.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::JudgedPlant;
using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Aggregates =
    ::testing::Types<StoredRegistrations, StoredCorrections, StoredInspections, StoredDeviations, StoredSections,
                     StoredReconstructions, StoredMachiningPasses, StoredRepairs, StoredAssessments>;
TYPED_TEST_SUITE(ResultStoreTest, Aggregates);

TYPED_TEST(ResultStoreTest, WhatIsRecordedIsFoundWithItsSequenceAndTime) {
  this->OnBoth([this](auto& store, int) {
    const auto row = this->New();
    const auto recorded = this->Record(store, row);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    const auto found = store.Find(row.*TypeParam::kId, Soon());
    ASSERT_TRUE(found.ok() && found->has_value()) << found.status();
    EXPECT_EQ((**found).recorded.sequence, recorded->recorded.sequence);
    EXPECT_EQ((**found).recorded.recorded_at, recorded->recorded.recorded_at);
    EXPECT_GT((**found).recorded.sequence, 0);
    EXPECT_LT(std::chrono::abs((**found).recorded.recorded_at - std::chrono::system_clock::now()),
              std::chrono::minutes(5));
    EXPECT_EQ((**found).requested_by, "operator");
    for (const std::string& id : {NewUuid(), std::string("no-uuid")}) {
      const auto none = store.Find(id, Soon());
      ASSERT_TRUE(none.ok()) << none.status();
      EXPECT_FALSE(none->has_value());
    }
  });
}

TYPED_TEST(ResultStoreTest, TheSameRequestIsRecordedOnce) {
  this->OnBoth([this](auto& store, int held_count) {
    const auto first = this->Record(store, this->New(), kSomeUuid);
    ASSERT_TRUE(first.ok()) << first.status();
    const std::string id = (*first).*TypeParam::kId;
    EXPECT_EQ((**store.FindRecorded({"area.Call", kSomeUuid, "request"}, Soon())).*TypeParam::kId, id);
    EXPECT_EQ((*this->Record(store, this->New(), kSomeUuid)).*TypeParam::kId, id);
    EXPECT_EQ(this->Record(store, this->New(), kSomeUuid, "another").status().code(), absl::StatusCode::kAlreadyExists);
    EXPECT_FALSE(store.FindRecorded({"area.Other", kSomeUuid, "request"}, Soon())->has_value());
    EXPECT_EQ(static_cast<int>(this->Ids(store, {}, 0, 10).size()), held_count + 1);
  });
}

TYPED_TEST(ResultStoreTest, WithoutARequestIdNothingIsKept) {
  this->OnBoth([this](auto& store, int held_count) {
    ASSERT_TRUE(this->Record(store, this->New()).ok());
    ASSERT_TRUE(this->Record(store, this->New()).ok());
    EXPECT_FALSE(store.FindRecorded({"area.Call", "", "request"}, Soon())->has_value());
    EXPECT_EQ(static_cast<int>(this->Ids(store, {}, 0, 10).size()), held_count + 2);
  });
}

TYPED_TEST(ResultStoreTest, ListsNewestFirstFromBelowASequenceAndByBlade) {
  this->OnBoth([this](auto& store, int) {
    std::vector<std::string> ids;
    for (int i = 0; i < 3; ++i) {
      const auto row = this->New();
      ASSERT_TRUE(this->Record(store, row).ok());
      ids.push_back(row.*TypeParam::kId);
    }
    EXPECT_THAT(this->Ids(store, {}, 0, 2), ElementsAre(ids[2], ids[1]));
    const std::int64_t second = (**store.Find(ids[1], Soon())).recorded.sequence;
    EXPECT_THAT(this->Ids(store, {}, second, 1), ElementsAre(ids[0]));
    typename TypeParam::Filter filter;
    filter.blade_serial = "another";
    EXPECT_THAT(this->Ids(store, filter, 0, 10), IsEmpty());
    filter.blade_serial = "sn1";
    EXPECT_THAT(this->Ids(store, filter, 0, 1), ElementsAre(ids[2]));
  });
}

TYPED_TEST(ResultStoreTest, ListsByWhatIsAskedFor) {
  using Asked = typename TypeParam::Filter;
  this->OnBoth([this](auto& store, int) {
    const auto row = this->Record(store, this->New());
    ASSERT_TRUE(row.ok()) << row.status();
    const std::string id = (*row).*TypeParam::kId;
    // It is the newest.
    const auto lists = [&](const Asked& filter) { return this->Ids(store, filter, 0, 1) == std::vector{id}; };
    for (const auto& [member, is] :
         {std::pair(&ResultFilter::machine_id, "m1"), std::pair(&ResultFilter::part_id, "p1")}) {
      Asked filter;
      filter.*member = is;
      EXPECT_TRUE(lists(filter)) << is;
      filter.*member = "another";
      EXPECT_FALSE(lists(filter)) << is;
    }
    if constexpr (TypeParam::kRestsOnCalibrations)
      for (const auto& [calibration, is_listed] :
           {std::pair(row->sensor_calibration_id, true), std::pair(row->rotation_calibration_id, true),
            std::pair(NewUuid(), false)}) {
        Asked filter;
        filter.calibration_id = calibration;
        EXPECT_EQ(lists(filter), is_listed) << calibration;
      }
    const Instant at = row->recorded.recorded_at, later = at + std::chrono::microseconds(1);
    for (const auto& [span, is_listed] : {std::pair(TimeSpan{at, later}, true), std::pair(TimeSpan{later, {}}, false),
                                          std::pair(TimeSpan{{}, at}, false)}) {
      Asked filter;
      filter.recorded = span;
      EXPECT_EQ(lists(filter), is_listed);
    }
    const auto own = TypeParam::Filters();
    for (std::size_t i = 0; i < own.size(); ++i) EXPECT_EQ(lists(own[i].first), own[i].second) << i;
  });
}

// Of the real one alone: what else the transaction writes.
TEST(PostgresResults, AResultIsInTheJournalAndItsProgramReadBack) {
  JudgedPlant plant;
  const auto store = CorrectionsIn(plant.database.database());
  CorrectionRow row = StoredCorrections::Make();
  row.correction_id = NewUuid();
  row.proof = ProgramProofRow{"1", 12, 0.07, 1e-5};
  row.work_offsets = {{"G54", {}}, {"G55", {1, 2, 3, 4, 5}}};
  RecordEntry entry;
  entry.kind = "correction";
  entry.name = "corrections/" + row.correction_id;
  entry.inputs = {sixpoint::testing::kRegistration};
  entry.software_version = "test";
  const auto recorded = store->Record({"area.Call", "", ""}, row, entry, Soon());
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  EXPECT_EQ((**store->Find(row.correction_id, Soon())).nc_program, row.nc_program);
  EXPECT_EQ(store->List({}, 0, 1, Soon())->front().nc_program, "");
  const CorrectionRow read = **store->Find(row.correction_id, Soon());
  ASSERT_TRUE(read.proof.has_value());
  EXPECT_EQ(read.proof->reader_version, "1");
  EXPECT_EQ(read.proof->pose_count, 12);
  EXPECT_EQ(read.proof->greatest_difference_um, 0.07);
  EXPECT_EQ(read.proof->greatest_tilt_deg, 1e-5);
  ASSERT_EQ(read.work_offsets.size(), 2u);
  EXPECT_EQ(read.work_offsets[0].code, "G54");
  EXPECT_EQ(read.work_offsets[1].offset, (std::array<double, 5>{1, 2, 3, 4, 5}));
  auto transaction = plant.database.database()->Begin(Soon());
  const auto derived = DerivedFrom(*transaction, sixpoint::testing::kRegistration);
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, entry.name);
}

}  // namespace
}  // namespace sixpoint::storage
