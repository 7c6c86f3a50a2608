// What every EventReader does, PostgreSQL's and the fake that those who listen are tested on. What costs how much, and how a listener's
// look at a row is held against the statement, is PostgreSQL's alone (events_test.cc).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "storage/events.h"
#include "tests/support/customers_parts.h"
#include "tests/support/fake_events.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeEvents;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAreArray;

struct EventReaderUnderTest {
  const EventReader& events;
  std::function<void(const std::string& kind, const std::string& name)> record;  // of no part
  // WORD-part, with its blade WORD-sn and an inspection of that by machine m1, which found NOT_MEASURED; gives the inspection's name.
  std::function<std::string(const std::string& word, bool has_customer)> put_part;
  std::function<void(const std::string& holder, const std::string& scope)> clear;

  EventPage Page(const EventQuery& query) const {
    const absl::StatusOr<EventPage> page = events.Events(query, Soon());
    EXPECT_TRUE(page.ok()) << page.status();
    return page.value_or(EventPage());
  }
  std::vector<std::string> Told(const EventFilter& filter, const Reader& reader = Reader::Everything()) const {
    return EventNames(Page({filter, 0, 1000, reader}));
  }
  static std::vector<std::string> EventNames(const EventPage& page) {
    std::vector<std::string> names;
    for (const EventRow& row : page.rows) names.push_back(row.entry.entry.name);
    return names;
  }
};

EventRow FakeEventOf(const std::string& word, const std::string& kind, const std::string& name) {
  EventRow row;
  row.entry.entry.kind = kind;
  row.entry.entry.name = name;
  row.entry.entry.blade = word + "-sn";
  row.parts = std::vector<std::string>{word + "-part"};
  return row;
}

void OnTheFakeEvents(const std::function<void(const EventReaderUnderTest& journal)>& test) {
  SCOPED_TRACE("the fake");
  FakeEvents fake;
  const auto put_part = [&](const std::string& word, bool has_customer) {
    if (has_customer) fake.clearances.customers[word + "-part"] = word;
    fake.Record(FakeEventOf(word, "blade", "blades/" + word + "-sn"));
    EventRow inspection = FakeEventOf(word, "inspection", "inspections/" + NewUuid());
    inspection.entry.entry.machine = "m1";
    inspection.entry.verdict = "NOT_MEASURED";
    fake.Record(inspection);
    return inspection.entry.entry.name;
  };
  test({fake, [&](const std::string& kind, const std::string& name) { fake.Record(kind, name); }, put_part,
        [&](const std::string& holder, const std::string& scope) {
          fake.clearances.clearances.emplace(holder, scope);
        }});
}

// Each test runs on both.
void OnBothEventReaders(const std::function<void(const EventReaderUnderTest& journal)>& test) {
  OnTheFakeEvents(test);
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  std::optional<sixpoint::testing::MachinesCalibrations> calibrations;  // once
  const auto put_part = [&](const std::string& word, bool has_customer) {
    if (!calibrations) calibrations = sixpoint::testing::PutCalibratedMachine(database.database());
    return sixpoint::testing::PutCustomersPart(database.database(), word, has_customer, *calibrations).inspection;
  };
  const auto events = EventsIn(database.Open(2));
  test({*events,
        [&](const std::string& kind, const std::string& name) {
          sixpoint::testing::RecordName(database.database(), kind, name);
        },
        put_part,
        [&](const std::string& holder, const std::string& scope) {
          sixpoint::testing::Clear(database.database(), holder, scope);
        }});
}

TEST(EventReaders, TellEachEntryOnceInTheJournalsOrderByPages) {
  OnBothEventReaders([](const EventReaderUnderTest& journal) {
    const auto page = [&](std::int64_t after, int limit) {
      return journal.Page({{}, after, limit, Reader::Everything()});
    };
    const EventPage none = page(0, 2);
    EXPECT_THAT(none.rows, IsEmpty());
    EXPECT_EQ(none.looked_at_sequence, 0);
    EXPECT_TRUE(none.is_newest);
    for (const char* name : {"policies/a", "policies/b", "policies/c", "policies/d", "policies/e"})
      journal.record("policy", name);
    const EventPage first = page(0, 2), last = page(2, 3), rest = page(3, 10), past = page(5, 2), beyond = page(9, 2);
    EXPECT_THAT(journal.EventNames(first), ElementsAre("policies/a", "policies/b"));
    EXPECT_EQ(first.looked_at_sequence, 2);
    EXPECT_FALSE(first.is_newest);
    EXPECT_THAT(journal.EventNames(last), ElementsAre("policies/c", "policies/d", "policies/e"));
    EXPECT_EQ(last.looked_at_sequence, 5);
    EXPECT_TRUE(last.is_newest);
    EXPECT_THAT(journal.EventNames(rest), ElementsAre("policies/d", "policies/e"));
    EXPECT_EQ(rest.looked_at_sequence, 5);
    EXPECT_TRUE(rest.is_newest);
    EXPECT_THAT(past.rows, IsEmpty());
    EXPECT_EQ(past.looked_at_sequence, 5);
    EXPECT_TRUE(past.is_newest);
    // Of a number that was not given yet nothing is told, and it is not gone back from.
    EXPECT_THAT(beyond.rows, IsEmpty());
    EXPECT_EQ(beyond.looked_at_sequence, 9);
    const EventRow& row = last.rows.at(2);
    EXPECT_EQ(row.entry.recorded.sequence, 5);
    EXPECT_NE(row.entry.recorded.recorded_at, Instant());
    EXPECT_EQ(row.entry.entry.kind, "policy");
    EXPECT_EQ(row.parts, std::vector<std::string>());
    EXPECT_FALSE(row.is_restricted || row.valid_until.has_value());
  });
}

TEST(EventReaders, SayWhereTheJournalEndsAndWhoseItIs) {
  std::vector<std::vector<std::string>> kinds;
  OnBothEventReaders([&](const EventReaderUnderTest& journal) {
    const auto before = journal.events.Now(Soon());
    ASSERT_TRUE(before.ok()) << before.status();
    EXPECT_EQ(before->newest_sequence, 0);
    EXPECT_TRUE(IsUuid(before->plant_id));
    journal.record("policy", "policies/a");
    journal.record("scan", "scans/s1");
    const auto now = journal.events.Now(Soon());
    ASSERT_TRUE(now.ok()) << now.status();
    EXPECT_EQ(now->newest_sequence, 2);
    EXPECT_EQ(now->plant_id, before->plant_id);
    kinds.push_back(now->kinds);
  });
  ASSERT_EQ(kinds.size(), 2u);
  EXPECT_THAT(kinds[0], UnorderedElementsAreArray(kinds[1]));
}

TEST(EventReaders, WhatIsNotAskedForIsLookedAtAndNotTold) {
  OnBothEventReaders([](const EventReaderUnderTest& journal) {
    journal.record("policy", "policies/a");
    journal.record("scan", "scans/s1");
    journal.record("policy", "policies/b");
    EventFilter scans;
    scans.kinds = {"scan"};
    const EventPage all = journal.Page({scans, 0, 10, Reader::Everything()});
    EXPECT_THAT(journal.EventNames(all), ElementsAre("scans/s1"));
    EXPECT_EQ(all.looked_at_sequence, 3);
    EXPECT_TRUE(all.is_newest);
    // A full page ends at its last event, whatever comes after that.
    const EventPage full = journal.Page({scans, 0, 1, Reader::Everything()});
    EXPECT_THAT(journal.EventNames(full), ElementsAre("scans/s1"));
    EXPECT_EQ(full.looked_at_sequence, 2);
    EXPECT_FALSE(full.is_newest);
    const EventPage none = journal.Page({scans, 2, 1, Reader::Everything()});
    EXPECT_THAT(none.rows, IsEmpty());
    EXPECT_EQ(none.looked_at_sequence, 3);
    EXPECT_TRUE(none.is_newest);
  });
}

TEST(EventReaders, EachFieldOfAFilterHasToLetAnEntryThrough) {
  OnBothEventReaders([](const EventReaderUnderTest& journal) {
    const std::string kappas = journal.put_part("kappa", false), sigmas = journal.put_part("sigma", false);
    EventFilter filter;
    filter.kinds = {"blade", "inspection"};
    EXPECT_THAT(journal.Told(filter), ElementsAre("blades/kappa-sn", kappas, "blades/sigma-sn", sigmas));
    EventFilter narrower = filter;
    narrower.blade_serial = "kappa-sn";
    EXPECT_THAT(journal.Told(narrower), ElementsAre("blades/kappa-sn", kappas));
    narrower.machine_id = "m1";
    EXPECT_THAT(journal.Told(narrower), ElementsAre(kappas));
    narrower.part_id = "sigma-part";
    EXPECT_THAT(journal.Told(narrower), IsEmpty());
    narrower = filter;
    narrower.part_id = "sigma-part";
    EXPECT_THAT(journal.Told(narrower), ElementsAre("blades/sigma-sn", sigmas));
    narrower = filter;
    narrower.verdicts = {"CONFORM", "NOT_MEASURED"};
    EXPECT_THAT(journal.Told(narrower), ElementsAre(kappas, sigmas));
    narrower.verdicts = {"CONFORM"};
    EXPECT_THAT(journal.Told(narrower), IsEmpty());
  });
}

TEST(EventReaders, LeaveOutWhatTheReaderMayNotSee) {
  OnBothEventReaders([](const EventReaderUnderTest& journal) {
    journal.put_part("kappa", true);
    journal.put_part("sigma", false);
    journal.clear("users/jane", "parts/kappa-part");
    EventFilter filter;
    filter.kinds = {"blade", "policy"};
    journal.record("policy", "policies/a");
    EXPECT_THAT(journal.Told(filter, {"users/joe"}), ElementsAre("blades/sigma-sn", "policies/a"));
    for (const Reader& reader : {Reader{"users/jane"}, Reader::Everything()})
      EXPECT_THAT(journal.Told(filter, reader), ElementsAre("blades/kappa-sn", "blades/sigma-sn", "policies/a"));
    const EventPage all = journal.Page({filter, 0, 10, Reader::Everything()});
    ASSERT_EQ(all.rows.size(), 3u);
    EXPECT_EQ(all.rows[0].parts, std::vector<std::string>{"kappa-part"});
    EXPECT_TRUE(all.rows[0].is_restricted);
    EXPECT_FALSE(all.rows[1].is_restricted || all.rows[2].is_restricted);
    EXPECT_THAT(*journal.events.HiddenParts({"users/joe"}, Soon()), ElementsAre("kappa-part"));
    for (const Reader& reader : {Reader{"users/jane"}, Reader::Everything()})
      EXPECT_THAT(*journal.events.HiddenParts(reader, Soon()), IsEmpty());
  });
}

}  // namespace
}  // namespace sixpoint::storage
