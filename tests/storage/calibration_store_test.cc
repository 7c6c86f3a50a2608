// What every CalibrationStore does, of PostgreSQL's and of the fake that handlers are tested on.
#include "storage/calibration_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>

#include "tests/support/fake_calibrations.h"
#include "tests/support/registered.h"
#include "tests/support/sample_calibrations.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeCalibrations;
using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using std::chrono::hours;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const CalibrationSubject kRotation{"m1", "rotation"};

Instant Now() { return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now()); }

CalibrationRow New(bool is_draft = false, Instant from = Now() - hours(1), Instant until = Now() + hours(1)) {
  CalibrationRow row = sixpoint::testing::SampleRotationCalibration();
  row.calibration_id = NewUuid();
  row.machine_id = "m1";
  row.inputs = {"machines/m1@1"};
  row.valid_from = from;
  row.valid_until = until;
  row.requested_by = "engineer";
  row.software_version = "test";
  row.is_draft = is_draft;
  return row;
}

CalibrationRow NewSensor() {
  const CalibrationRow sample = sixpoint::testing::SampleSensorCalibration();
  CalibrationRow row = New();
  row.rotation.reset();
  row.method = sample.method;
  row.sensor = sample.sensor;
  return row;
}

RecordEntry EntryOf(const CalibrationRow& row) {
  RecordEntry entry;
  entry.kind = "calibration";
  entry.name = row.name();
  entry.inputs = row.inputs;
  entry.machine = row.machine_id;
  entry.software_version = row.software_version;
  return entry;
}

absl::StatusOr<CalibrationRow> RecordCalibration(CalibrationStore& store, const CalibrationRow& row,
                                                 const std::string& request_id = "",
                                                 const std::string& bytes = "request") {
  return store.Record({"area.Call", request_id, bytes}, row, EntryOf(row), Soon());
}

CalibrationDecision DecisionOf(const std::string& id, const absl::Status& may = absl::OkStatus()) {
  return {id, {"reason", "head", "test", {}}, [may](const std::optional<CalibrationRow>& calibration) {
            return calibration ? may : absl::NotFoundError("none of that id");
          }};
}

absl::Status Release(CalibrationStore& store, const std::string& id) {
  return store.Release({"area.Release", "", ""}, DecisionOf(id), Soon()).status();
}

// What was left behind.
absl::StatusOr<WithdrawnCalibrationRow> Withdraw(CalibrationStore& store, const std::string& id,
                                                 const std::string& request_id = "") {
  return store.Withdraw({"area.Withdraw", request_id, ""}, DecisionOf(id), Soon());
}

CalibrationRow Find(const CalibrationStore& store, const std::string& id) {
  const auto found = store.Find(id, Soon());
  EXPECT_TRUE(found.ok() && found->has_value()) << found.status();
  return found.ok() && found->has_value() ? **found : CalibrationRow();
}

std::string IdInForce(const CalibrationStore& store, Instant at = Now()) {
  const auto found = store.InForce(kRotation, at, Soon());
  EXPECT_TRUE(found.ok()) << found.status();
  return found.ok() && found->has_value() ? (**found).calibration_id : "";
}

std::vector<std::string> CalibrationIds(const absl::StatusOr<std::vector<CalibrationRow>>& rows) {
  EXPECT_TRUE(rows.ok()) << rows.status();
  std::vector<std::string> ids;
  for (const CalibrationRow& row : *rows) ids.push_back(row.calibration_id);
  return ids;
}

// Each test runs on both.
void OnBothCalibrationStores(const std::function<void(CalibrationStore& store)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakeCalibrations fake;
    test(fake);
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  auto transaction = database.database()->Begin(Soon());
  sixpoint::testing::RegisterMachine(*transaction, "m1");
  ASSERT_TRUE(transaction->Commit().ok());
  test(*CalibrationsIn(database.database()));
}

TEST(CalibrationStore, WhatIsRecordedIsFoundWithItsResidualsAndState) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    const CalibrationRow row = New();
    const auto recorded = RecordCalibration(store, row);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    const CalibrationRow found = Find(store, row.calibration_id);
    EXPECT_EQ(found.recorded.sequence, recorded->recorded.sequence);
    EXPECT_EQ(recorded->state, CalibrationState::kInForce);
    EXPECT_EQ(found.state, CalibrationState::kInForce);
    EXPECT_EQ(found.request_sha256.size(), 64u);
    ASSERT_EQ(found.rotation->poses.size(), 1u);
    EXPECT_EQ(found.rotation->poses[0].before_um, 2.5);
    EXPECT_FALSE(store.Find(NewUuid(), Soon())->has_value());
  });
}

TEST(CalibrationStore, TheSameRequestIsRecordedOnce) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    const auto first = RecordCalibration(store, New(), kSomeUuid);
    ASSERT_TRUE(first.ok()) << first.status();
    const std::string id = first->calibration_id;
    EXPECT_EQ((**store.FindRecorded({"area.Call", kSomeUuid, "request"}, Soon())).calibration_id, id);
    EXPECT_EQ(RecordCalibration(store, New(), kSomeUuid)->calibration_id, id);
    EXPECT_EQ(RecordCalibration(store, New(), kSomeUuid, "another").status().code(), absl::StatusCode::kAlreadyExists);
    EXPECT_EQ(CalibrationIds(store.List({}, 0, 10, Soon())).size(), 1u);
  });
}

TEST(CalibrationStore, TheOneReleasedLastIsInForce) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    const CalibrationRow draft = New(true), made = New(), old = New(false, Now() - hours(3), Now() - hours(2));
    for (const CalibrationRow* row : {&draft, &made, &old}) ASSERT_TRUE(RecordCalibration(store, *row).ok());
    EXPECT_EQ(IdInForce(store), made.calibration_id);
    EXPECT_EQ(Find(store, draft.calibration_id).state, CalibrationState::kDraft);
    ASSERT_TRUE(Release(store, draft.calibration_id).ok());
    EXPECT_EQ(IdInForce(store), draft.calibration_id);
    EXPECT_EQ(Find(store, draft.calibration_id).release->requested_by, "head");
    const CalibrationRow superseded = Find(store, made.calibration_id);
    EXPECT_EQ(superseded.state, CalibrationState::kSuperseded);
    EXPECT_EQ(superseded.superseded_by, draft.calibration_id);
    EXPECT_EQ(Find(store, old.calibration_id).state, CalibrationState::kExpired);
    EXPECT_EQ(IdInForce(store, Now() - hours(2) - std::chrono::minutes(30)), old.calibration_id);
    EXPECT_EQ(IdInForce(store, Now() + hours(2)), "");
    EXPECT_EQ(**store.LastValidity(kRotation, Now(), Soon()),
              draft.valid_until > made.valid_until ? draft.valid_until : made.valid_until);
    EXPECT_FALSE(store.LastValidity({"m1", "sensor"}, Now(), Soon())->has_value());
  });
}

TEST(CalibrationStore, AWithdrawnOneLeavesTheOneBeforeInForceAndNamesWhatRestsOnIt) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    const CalibrationRow before = New(), knocked = New();
    CalibrationRow resting = NewSensor();
    resting.inputs = {knocked.name()};
    for (const CalibrationRow& row : {before, knocked, resting}) ASSERT_TRUE(RecordCalibration(store, row).ok());
    const auto left = Withdraw(store, knocked.calibration_id, kSomeUuid);
    ASSERT_TRUE(left.ok()) << left.status();
    // A retry finds the same; another decision does not.
    EXPECT_EQ(Withdraw(store, knocked.calibration_id, kSomeUuid)->resting.size(), left->resting.size());
    EXPECT_EQ(Withdraw(store, knocked.calibration_id).status().code(), absl::StatusCode::kAborted);
    EXPECT_EQ(left->calibration.state, CalibrationState::kWithdrawn);
    EXPECT_EQ(left->in_force->calibration_id, before.calibration_id);
    std::vector<std::string> kinds;
    for (const JournalEntry& entry : left->resting) kinds.push_back(entry.entry.kind);
    EXPECT_THAT(kinds, ElementsAre("calibration", "withdrawal"));
    EXPECT_EQ(left->resting.front().entry.name, resting.name());
    EXPECT_EQ((**store.Withdrawn(kRotation, Now(), Soon())).withdrawal->reason, "reason");
    EXPECT_FALSE(store.Withdrawn(kRotation, Now() + hours(2), Soon())->has_value());
  });
}

TEST(CalibrationStore, WhatMayNotBeDecidedIsNot) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    EXPECT_EQ(Release(store, NewUuid()).code(), absl::StatusCode::kNotFound);
    const CalibrationRow draft = New(true);
    ASSERT_TRUE(RecordCalibration(store, draft).ok());
    const CalibrationDecision refused = DecisionOf(draft.calibration_id, absl::FailedPreconditionError("no"));
    EXPECT_EQ(store.Release({"area.Release", "", ""}, refused, Soon()).status().code(),
              absl::StatusCode::kFailedPrecondition);
    ASSERT_TRUE(Release(store, draft.calibration_id).ok());
    EXPECT_EQ(Release(store, draft.calibration_id).code(), absl::StatusCode::kAborted);
  });
}

TEST(CalibrationStore, ListsNewestFirstBySubjectAndState) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    const CalibrationRow first = New(), second = New(), draft = New(true), sensor = NewSensor();
    for (const CalibrationRow* row : {&first, &second, &draft, &sensor})
      ASSERT_TRUE(RecordCalibration(store, *row).ok());
    EXPECT_THAT(CalibrationIds(store.List({}, 0, 2, Soon())), ElementsAre(sensor.calibration_id, draft.calibration_id));
    const std::int64_t below = Find(store, second.calibration_id).recorded.sequence;
    EXPECT_THAT(CalibrationIds(store.List({}, below, 10, Soon())), ElementsAre(first.calibration_id));
    CalibrationFilter filter;
    filter.subject.kind = "rotation";
    filter.state = CalibrationState::kInForce;
    EXPECT_THAT(CalibrationIds(store.List(filter, 0, 10, Soon())), ElementsAre(second.calibration_id));
    EXPECT_TRUE(store.List(filter, 0, 10, Soon())->front().rotation->poses.empty());
    filter.with_residuals = true;
    EXPECT_EQ(store.List(filter, 0, 10, Soon())->front().rotation->poses.size(), 1u);
    filter.recorded.until = Now() - hours(1);
    EXPECT_THAT(CalibrationIds(store.List(filter, 0, 10, Soon())), IsEmpty());
    filter = {};
    filter.subject.machine_id = "m2";
    EXPECT_THAT(CalibrationIds(store.List(filter, 0, 10, Soon())), IsEmpty());
  });
}

TEST(CalibrationStore, TheHistoryGoesByValidityAndLeavesOutDraftsAndWithdrawnOnes) {
  OnBothCalibrationStores([](CalibrationStore& store) {
    const CalibrationRow late = New(), early = New(false, Now() - hours(5)), draft = New(true), knocked = New();
    const CalibrationRow earliest = New(false, Now() - hours(9));
    for (const CalibrationRow* row : {&late, &early, &draft, &knocked, &earliest})
      ASSERT_TRUE(RecordCalibration(store, *row).ok());
    ASSERT_TRUE(Withdraw(store, knocked.calibration_id).ok());
    EXPECT_THAT(CalibrationIds(store.History(kRotation, 2, Soon())),
                ElementsAre(early.calibration_id, late.calibration_id));
    EXPECT_EQ(CalibrationIds(store.History(kRotation, 10, Soon())).size(), 3u);
  });
}

}  // namespace
}  // namespace sixpoint::storage
