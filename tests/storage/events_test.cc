// The journal as who listens reads it, on a real PostgreSQL.
#include "storage/events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "tests/support/customers_parts.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AsRole;
using sixpoint::testing::Soon;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

class EventsTest : public ::testing::Test {
 protected:
  // By the role that the plant's service has.
  EventsTest() : events_(EventsIn(Database::Open(AsRole(database_.conninfo(), "plant"), 2))) {}

  EventPage Page(const EventQuery& query) {
    const absl::StatusOr<EventPage> page = events_->Events(query, Soon());
    EXPECT_TRUE(page.ok()) << page.status();
    return page.ok() ? *page : EventPage();
  }
  // All that the filter lets through, by pages of that size.
  std::vector<EventRow> All(const EventFilter& filter, int limit = 3, const Reader& reader = Reader::Everything()) {
    std::vector<EventRow> all;
    EventQuery query{filter, 0, limit, reader};
    for (int pages = 0; pages < 1000; ++pages) {
      EventPage page = Page(query);
      EXPECT_LE(page.rows.size(), static_cast<std::size_t>(limit));
      for (EventRow& row : page.rows) all.push_back(std::move(row));
      if (page.is_newest) return all;
      EXPECT_GT(page.looked_at_sequence, query.after_sequence);
      query.after_sequence = page.looked_at_sequence;
    }
    ADD_FAILURE() << "no end";
    return all;
  }
  static std::vector<std::string> Names(const std::vector<EventRow>& rows) {
    std::vector<std::string> names;
    for (const EventRow& row : rows) names.push_back(row.entry.entry.name);
    return names;
  }
  static std::vector<std::string> AsRecorded(const testing::CustomersPart& of) {
    std::vector<std::string> names = of.names();
    for (std::string& name : names)
      if (name == of.part) name += "@1";
    return names;
  }
  Rows Sql(const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    const absl::StatusOr<Rows> rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : Rows();
  }

  testing::ThrowawayDatabase database_;
  std::shared_ptr<const EventReader> events_;
};

TEST_F(EventsTest, EveryEntryComesOnceInTheJournalsOrderWhateverThePagesSize) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  testing::PutCustomersPart(database_.database(), "kappa", false, calibrations);
  const Rows recorded = Sql("SELECT name FROM record_names ORDER BY record_sequence");
  std::vector<std::string> names;
  for (int row = 0; row < recorded.count(); ++row) names.push_back(recorded.Text(row, 0));
  ASSERT_GT(names.size(), 8u);
  for (const int limit : {1, 3, static_cast<int>(names.size()), 1000}) EXPECT_EQ(Names(All({}, limit)), names) << limit;
  const absl::StatusOr<JournalNow> now = events_->Now(Soon());
  ASSERT_TRUE(now.ok()) << now.status();
  EXPECT_EQ(now->newest_sequence, Sql("SELECT max(record_sequence) FROM record_names").Int(0, 0));
  EXPECT_TRUE(IsUuid(now->plant_id));
  const EventPage past = Page({{}, now->newest_sequence, 10, Reader::Everything()});
  EXPECT_THAT(past.rows, IsEmpty());
  EXPECT_TRUE(past.is_newest);
  EXPECT_EQ(past.looked_at_sequence, now->newest_sequence);
}

// A kind that an entry has and the list lacks could never be asked for.
TEST_F(EventsTest, TheKindsAreThoseThatAnEntryMayHave) {
  const absl::StatusOr<JournalNow> now = events_->Now(Soon());
  ASSERT_TRUE(now.ok()) << now.status();
  for (const char* kind :
       {"machine",    "artefact",   "part",     "blade",           "scan",       "calibration", "registration",
        "correction", "inspection", "deletion", "release",         "withdrawal", "study",       "policy",
        "refusal",    "fetch",      "cut",      "machining_model", "drawing",    "measurement"})
    EXPECT_THAT(now->kinds, Contains(kind));
  EXPECT_THAT(now->kinds, Not(Contains("text")));
}

// The statement and the look at a row that is there are two ways to say one thing.
TEST_F(EventsTest, AFilterLetsThroughInTheDatabaseWhatItLetsThroughInMemory) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  const testing::CustomersPart kappa = testing::PutCustomersPart(database_.database(), "kappa", true, calibrations);
  testing::PutCustomersPart(database_.database(), "sigma", false, calibrations);
  const std::vector<EventRow> all = All({});
  std::map<std::string, EventFilter> filters;
  filters["kinds"].kinds = {"scan", "inspection"};
  filters["machine"].machine_id = "m1";
  filters["other machine"].machine_id = "m2";
  filters["blade"].blade_serial = kappa.blade.substr(sizeof "blades/" - 1);
  filters["part"].part_id = "kappa-part";
  filters["verdicts"].verdicts = {"NOT_MEASURED", "NOT_CONVERGED"};
  filters["all"] = {{"inspection"}, "m1", filters["blade"].blade_serial, "kappa-part", {"CONFORM", "NOT_MEASURED"}};
  for (const auto& [what, filter] : filters) {
    std::vector<EventRow> expected;
    for (const EventRow& row : all)
      if (LetsThrough(filter, row)) expected.push_back(row);
    EXPECT_EQ(Names(All(filter)), Names(expected)) << what;
    EXPECT_LT(expected.size(), all.size()) << what;
    EXPECT_EQ(expected.empty(), what == "other machine") << what;
  }
  EXPECT_THAT(Names(All(filters["part"])), ::testing::UnorderedElementsAreArray(AsRecorded(kappa)));
}

TEST_F(EventsTest, WhatAReaderMayNotSeeIsLeftOutAndMarkedForThoseWhoLookInMemory) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  const testing::CustomersPart kappa = testing::PutCustomersPart(database_.database(), "kappa", true, calibrations);
  const testing::CustomersPart sigma = testing::PutCustomersPart(database_.database(), "sigma", false, calibrations);
  testing::Clear(database_.database(), "users/jane", "parts/kappa-part");
  const std::vector<EventRow> all = All({});
  for (const std::string identity : {"users/jane", "users/joe"}) {
    const auto hidden = events_->HiddenParts({identity}, Soon());
    ASSERT_TRUE(hidden.ok()) << hidden.status();
    std::vector<EventRow> seen;
    for (const EventRow& row : all)
      if (!row.is_restricted || IsSeen(row, *hidden)) seen.push_back(row);
    const std::vector<std::string> names = Names(All({}, 3, {identity}));
    EXPECT_EQ(names, Names(seen)) << identity;
    for (const std::string& name : AsRecorded(sigma)) EXPECT_THAT(names, Contains(name));
    for (const std::string& name : AsRecorded(kappa))
      EXPECT_EQ(std::count(names.begin(), names.end(), name), identity == "users/jane" ? 1 : 0) << name;
  }
  EXPECT_FALSE(
      IsSeen(EventRow(), {"kappa-part"}));  // of what cannot be told nothing is shown to whom something is hidden
}

TEST_F(EventsTest, SaysUntilWhenACalibrationHoldsByTheClock) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  testing::PutCustomersPart(database_.database(), "kappa", false, calibrations);
  int with_end_count = 0;
  for (const EventRow& row : All({})) {
    const std::string& kind = row.entry.entry.kind;
    EXPECT_EQ(row.valid_until.has_value(), kind == "calibration" || kind == "correction") << row.entry.entry.name;
    with_end_count += row.valid_until.has_value();
    if (row.entry.entry.name == calibrations.sensor) {
      const Rows kept =
          Sql("SELECT valid_until FROM calibrations WHERE calibration_id = '" + IdOfName(calibrations.sensor).id + "'");
      EXPECT_EQ(*row.valid_until, kept.Time(0, 0));
      EXPECT_EQ(row.entry.state, "IN_FORCE");
    }
  }
  EXPECT_GE(with_end_count, 3);
}

// More entries than are looked at at once, none of them wanted: it goes on, page by page, and says how far it has come.
TEST_F(EventsTest, ARareEventIsFoundBehindThousandsOfOthers) {
  Sql("INSERT INTO record_names (record_id, name) SELECT gen_random_uuid(), 'policies/p' || i FROM generate_series(1, "
      "5000) i");
  testing::RecordName(database_.database(), "policy", "policies/wanted");
  EventFilter filter;
  filter.kinds = {"policy"};
  const EventPage first = Page({filter, 0, 10, Reader::Everything()});
  EXPECT_THAT(first.rows, IsEmpty());
  EXPECT_FALSE(first.is_newest);
  EXPECT_EQ(first.looked_at_sequence, 2000);
  EXPECT_THAT(Names(All(filter)), ElementsAre("policies/wanted"));
}

}  // namespace
}  // namespace sixpoint::storage
