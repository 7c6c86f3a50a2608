// The summaries of machines, after a history of random entries: what a query over the journal says, and what the definitions of the steps say
// (plant/v1/fleet.proto), each worked out here from the list of events.
#include "storage/fleet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "tests/support/customers_parts.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::hours;
using std::chrono::seconds;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct Event {
  Instant at;
  std::string kind, blade, machine;
  std::string detail;        // as machine_contacts.detail
  bool is_last = false;      // of a cut: with it all holes are cut
  std::string refused = {};  // the correction that it refuses
};

bool IsFirstScan(const Event& e) { return e.kind == "scan" && e.detail != "pins"; }
bool IsPins(const Event& e) { return e.kind == "scan" && e.detail == "pins"; }
bool IsWork(const Event& e) { return e.kind == "registration" && e.detail != "FOR_INSPECTION"; }
bool IsCorrection(const Event& e) { return e.kind == "correction"; }
bool IsFetch(const Event& e) { return e.kind == "fetch"; }
bool IsCut(const Event& e) { return e.kind == "cut" && e.is_last; }
bool IsProgram(const Event& e) { return e.kind == "release" || (e.kind == "correction" && e.detail == "AUTOMATIC"); }
bool IsVerdict(const Event& e) { return e.kind == "inspection" && e.detail != "REJUDGED"; }

using Is = bool (*)(const Event&);

// A step ends with the first event of its kind since the last scan that is not of pins, and began with the last event of the kind before
// it since then.
struct Step {
  const char* name;
  Is begins, ends;
};
constexpr Step kSteps[] = {{"SCAN_TO_REGISTRATION", IsFirstScan, IsWork},
                           {"REGISTRATION_TO_CORRECTION", IsWork, IsCorrection},
                           {"CORRECTION_TO_FETCH", IsCorrection, IsFetch},
                           {"FETCH_TO_CUT", IsFetch, IsCut},
                           {"CUT_TO_PINS_SCAN", IsCut, IsPins}};

// (machine, measure) -> times.
using Times = std::map<std::pair<std::string, std::string>, std::vector<double>>;

// way: a blade's events from a first scan on, ended by a verdict after a scan of pins, or by 30 days.
void AddSteps(const std::vector<Event>& way, Times* times) {
  const auto add = [&](const char* step, std::size_t from, std::size_t to) {
    (*times)[{way[to].machine, step}].push_back(std::chrono::duration<double>(way[to].at - way[from].at).count());
  };
  for (std::size_t i = 0; i < way.size(); ++i) {
    std::size_t scan = way.size();  // the last one up to here that begins the steps anew
    for (std::size_t j = 0; j <= i; ++j)
      if (IsFirstScan(way[j])) scan = j;
    const std::size_t since = scan == way.size() ? 0 : scan;
    const auto last_before = [&](Is is) {
      std::size_t found = way.size();
      for (std::size_t j = since; j < i; ++j)
        if (is(way[j])) found = j;
      return found;
    };
    for (const Step& step : kSteps)
      if (step.ends(way[i]) && last_before(step.ends) == way.size() && last_before(step.begins) < way.size())
        add(step.name, last_before(step.begins), i);
    if (IsProgram(way[i]) && last_before(IsProgram) == way.size()) add("FIRST_SCAN_TO_PROGRAM", 0, i);
    if (IsVerdict(way[i]) && last_before(IsPins) < way.size()) {
      add("PINS_SCAN_TO_VERDICT", last_before(IsPins), i);
      add("FIRST_SCAN_TO_VERDICT", 0, i);
    }
  }
}

bool Ends(const std::vector<Event>& way) {
  bool pins = false;
  for (const Event& e : way) {
    if (IsFirstScan(e)) pins = false;
    pins = pins || IsPins(e);
  }
  return pins && IsVerdict(way.back());
}

Times StepsOf(const std::vector<Event>& events) {
  Times times;
  std::map<std::string, std::vector<Event>> ways;  // by blade
  for (const Event& e : events) {
    std::vector<Event>& way = ways[e.blade];
    if (!way.empty() && e.at - way.front().at > hours(30 * 24)) {
      AddSteps(way, &times);
      way.clear();
    }
    if (way.empty() && e.kind != "scan") continue;
    if (way.empty()) times[{e.machine, "blade_begun"}].push_back(0);
    way.push_back(e);
    if (!Ends(way)) continue;
    AddSteps(way, &times);
    way.clear();
  }
  for (const auto& [blade, way] : ways) AddSteps(way, &times);
  return times;
}

class FleetTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto calibrations = sixpoint::testing::PutCalibratedMachine(database_.database());
    sixpoint::testing::PutCustomersPart(database_.database(), "acme", false, calibrations);
    // A row like one that is there, with what is said of it.
    Do("CREATE FUNCTION clone(held_by text, changes jsonb) RETURNS void LANGUAGE plpgsql AS $$ BEGIN EXECUTE format("
       "'INSERT INTO %1$I SELECT (jsonb_populate_record(t, $1)).* FROM %1$I t LIMIT 1', held_by) "
       "USING changes; END $$");
    Do("CREATE FUNCTION put(id uuid, at timestamptz, of_kind text, blade text, machine text) RETURNS void "
       "LANGUAGE plpgsql AS $$ DECLARE s bigint; BEGIN "
       "INSERT INTO record_names (record_id, name, recorded_at) VALUES (id, of_kind || 's/' || id, at) "
       "RETURNING record_sequence INTO s; "
       "INSERT INTO record_entries (record_id, record_sequence, recorded_at, kind, blade_serial, machine_id, method, "
       "software_version, requested_by, summary) VALUES (id, s, at, of_kind, blade, machine, '', 'test', 'test', "
       "'{}'); "
       "END $$");
  }
  Rows Select(const std::string& sql, const Params& params = {}) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    absl::StatusOr<Rows> rows = transaction->Execute(sql, params);
    EXPECT_TRUE(rows.ok()) << rows.status() << " " << sql;
    EXPECT_TRUE(transaction->Commit().ok());
    return rows.ok() ? *rows : Rows();
  }
  void Do(const std::string& sql, const Params& params = {}) { Select(sql, params); }
  // Of one event, in one transaction.
  void Add(const std::string& sql, const Params& params) { statements_.emplace_back(sql, params); }
  void Clone(const std::string& table, const std::string& changes) {
    Add("SELECT clone($1, $2::jsonb)", Params().Text(table).Json(changes));
  }
  void DoAll() {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    for (const auto& [sql, params] : statements_) {
      const absl::StatusOr<Rows> rows = transaction->Execute(sql, params);
      ASSERT_TRUE(rows.ok()) << rows.status() << " " << sql;
    }
    statements_.clear();
    const absl::Status committed = transaction->Commit();
    ASSERT_TRUE(committed.ok()) << committed;
  }

  // The event's own row, then its entry, as a service does it; of corrections with two holes, of which each cut reports one.
  void Put(Event* event) {
    const std::string id = NewUuid();
    const auto text = [](const std::string& key, const std::string& value) {
      return "\"" + key + "\": \"" + value + "\"";
    };
    if (event->kind == "scan")
      Clone("scans", "{" + text("scan_key", id) + ", " + text("kind", event->detail) + "}");
    else if (event->kind == "registration")
      Clone("registrations", "{" + text("registration_id", id) + ", \"for_inspection\": " +
                                 (event->detail == "FOR_INSPECTION" ? "true" : "false") + "}");
    else if (event->kind == "inspection")
      Clone("inspections",
            "{" + text("inspection_id", id) + ", " +
                (event->detail == "REJUDGED" ? text("rejudges", inspection_) : text("verdict", event->detail)) + "}");
    if (event->kind == "inspection" && event->detail != "REJUDGED") inspection_ = id;
    if (event->kind == "correction") PutCorrection(id, *event);
    if (!event->refused.empty())
      Add("INSERT INTO correction_events (correction_id, event, reason, requested_by, software_version, record_id) "
          "VALUES ($1, 'REFUSED', 'why', 'test', 'test', $2)",
          Params().Uuid(event->refused).Uuid(id));
    if (event->kind == "cut") {
      Correction& cut = corrections_[event->blade];
      Add("INSERT INTO correction_cuts (correction_id, group_name, hole_name, record_id) VALUES ($1, 'G', $2, $3)",
          Params().Uuid(cut.id).Text("H" + std::to_string(cut.cut_count++)).Uuid(id));
      event->is_last = cut.cut_count == 2;
    }
    Add("SELECT put($1, $2, $3, $4, $5)",
        Params().Uuid(id).Time(event->at).Text(event->kind).Text(event->blade).Text(event->machine));
    DoAll();
  }
  void PutCorrection(const std::string& id, const Event& event) {
    const bool awaits = event.detail == "AWAITING_PERSON";
    Clone("corrections", "{\"correction_id\": \"" + id + "\", \"release\": \"" + event.detail +
                             "\", \"release_reasons\": " + (awaits ? "[\"moved\"]" : "[]") +
                             ", \"nc_program_sha256\": null, \"nc_held_sha256\": null}");
    Add("INSERT INTO correction_groups (correction_id, position_index, group_name, a_deg, b_deg, a_nominal_deg, "
        "b_nominal_deg, a_ideal_deg, b_ideal_deg, a_standard_uncertainty_deg, b_standard_uncertainty_deg) "
        "VALUES ($1, 0, 'G', 0, 0, 0, 0, 0, 0, 0, 0)",
        Params().Uuid(id));
    Add("INSERT INTO correction_holes (correction_id, group_name, position_index, hole_name, start_x_mm, start_y_mm, "
        "start_z_mm, nominal_start_x_mm, nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um) "
        "SELECT $1::uuid, 'G', i, 'H' || i, 0, 0, 0, 0, 0, 0, 10 FROM generate_series(0, 1) i",
        Params().Uuid(id));
    corrections_[event.blade] = {id, 0};
  }
  bool HasHolesLeft(const std::string& blade) {
    return corrections_.count(blade) > 0 && corrections_[blade].cut_count < 2;
  }

  // Blades that go the usual way, with everything else that may happen between.
  std::vector<Event> PutHistory(unsigned seed, int count) {
    using Words = std::vector<std::pair<std::string, std::string>>;
    const Words usual = {{"scan", "airfoil"},
                         {"scan", "airfoil"},
                         {"registration", "CONVERGED"},
                         {"correction", "AUTOMATIC"},
                         {"fetch", ""},
                         {"cut", ""},
                         {"cut", ""},
                         {"scan", "pins"},
                         {"registration", "FOR_INSPECTION"},
                         {"inspection", "CONFORM"}};
    const Words others = {{"scan", "local"},
                          {"correction", "AWAITING_PERSON"},
                          {"release", ""},
                          {"refusal", ""},
                          {"inspection", "REJUDGED"},
                          {"inspection", "NOT_CONFORM"},
                          {"deletion", ""},
                          {"registration", "CONVERGED"},
                          {"fetch", ""},
                          {"inspection", "UNDECIDABLE"},
                          {"scan", "airfoil"}};
    std::mt19937_64 random(seed);
    const auto one_of = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    std::map<std::string, std::size_t> next;
    Instant at = std::chrono::system_clock::now() - hours(55 * 24);
    Event first{at, "inspection", "b0", "f1", "CONFORM"};  // which later ones judge anew
    Put(&first);
    std::vector<Event> events = {first};
    for (int i = 0; i < count; ++i) {
      at += seconds(1 + one_of(one_of(20) == 0 ? 100000 : 3600));
      Event event;
      event.at = at;
      event.blade = "b" + std::to_string(one_of(12));
      event.machine = "f" + std::to_string(1 + one_of(3));
      std::size_t& step = next[event.blade];
      std::tie(event.kind, event.detail) =
          one_of(4) == 0 ? others[one_of(others.size())] : usual[step++ % usual.size()];
      if (event.kind == "cut" && !HasHolesLeft(event.blade)) continue;
      Put(&event);
      events.push_back(event);
    }
    return events;
  }

  // What is kept, of a period, as (machine, measure) -> count and sum of seconds.
  std::map<std::pair<std::string, std::string>, std::pair<std::int64_t, double>> Kept(const std::string& period) {
    const Rows rows = Select(
        "SELECT machine_id, measure, sum(entry_count)::bigint, sum(seconds) FROM machine_activity "
        "WHERE period = $1 AND machine_id LIKE 'f%' GROUP BY machine_id, measure",
        Params().Text(period));
    std::map<std::pair<std::string, std::string>, std::pair<std::int64_t, double>> kept;
    for (int row = 0; row < rows.count(); ++row)
      kept[{rows.Text(row, 0), rows.Text(row, 1)}] = {rows.Int(row, 2), rows.Real(row, 3)};
    return kept;
  }
  std::string Dump(const std::string& table) {
    return Select("SELECT coalesce(string_agg(t::text, E'\\n' ORDER BY t::text), '') FROM " + table + " t").Text(0, 0);
  }

  struct Correction {
    std::string id;
    int cut_count = 0;
  };
  std::map<std::string, Correction> corrections_;
  std::string inspection_;
  std::vector<std::pair<std::string, Params>> statements_;
  ThrowawayDatabase database_;
};

TEST_F(FleetTest, SummariesSayWhatTheJournalSays) {
  const std::vector<Event> events = PutHistory(20261125, 700);
  const auto kept = Kept("hour");
  std::map<std::pair<std::string, std::string>, std::int64_t> counts;
  for (const Event& e : events) {
    const std::string measure = e.detail == "REJUDGED" ? "rejudgement" : e.kind == "inspection" ? e.detail : e.kind;
    ++counts[{e.machine, measure}];
  }
  const Times times = StepsOf(events);
  std::set<std::string> seen;
  for (const auto& [key, count] : counts) {
    ASSERT_EQ(kept.count(key), 1u) << key.first << " " << key.second;
    EXPECT_EQ(kept.at(key).first, count) << key.first << " " << key.second;
  }
  for (const auto& [key, of_step] : times) {
    ASSERT_EQ(kept.count(key), 1u) << key.first << " " << key.second;
    EXPECT_EQ(kept.at(key).first, static_cast<std::int64_t>(of_step.size())) << key.first << " " << key.second;
    double sum = 0;
    for (const double s : of_step) sum += s;
    EXPECT_NEAR(kept.at(key).second, sum, 1e-3 + 1e-9 * sum) << key.first << " " << key.second;
    seen.insert(key.second);
  }
  EXPECT_EQ(kept.size(), counts.size() + times.size());
  EXPECT_THAT(seen, SizeIs(9)) << "a step that never happened was not tested";
  EXPECT_EQ(Kept("day"), kept);
}

TEST_F(FleetTest, EachEntryCountsInItsHourAndItsDay) {
  PutHistory(7, 150);
  for (const char* period : {"hour", "day"}) {
    const Rows rows = Select(
        "SELECT count(*) FROM (SELECT machine_id, begins_at, sum(entry_count) AS n FROM machine_activity "
        "WHERE period = $1 AND bucket = 0 AND measure <> 'blade_begun' GROUP BY 1, 2) kept FULL JOIN "
        "(SELECT machine_id, date_trunc($1, recorded_at, 'UTC') AS begins_at, count(*) AS n FROM record_entries "
        "WHERE machine_id IS NOT NULL GROUP BY 1, 2) told USING (machine_id, begins_at) WHERE kept.n IS DISTINCT FROM "
        "told.n",
        Params().Text(period));
    EXPECT_EQ(rows.Int(0, 0), 0) << period;
  }
}

TEST_F(FleetTest, SummariesMadeAnewAreTheSame) {
  PutHistory(11, 300);
  std::map<std::string, std::string> before;
  for (const char* table : {"machine_activity", "machine_contacts", "blade_cycles"}) before[table] = Dump(table);
  EXPECT_NE(before["blade_cycles"], "");
  // Whatever somebody did to them.
  Do("UPDATE machine_activity SET entry_count = entry_count + 1");
  Do("DELETE FROM machine_contacts");
  Do("UPDATE blade_cycles SET awaiting_since = now()");
  Do("SELECT rebuild_summaries()");
  for (const auto& [table, rows] : before) EXPECT_EQ(Dump(table), rows) << table;
  // Days before that one are counted without steps, all at once.
  const std::string entries =
      "(SELECT machine_id, begins_at, measure, entry_count FROM machine_activity WHERE period = 'day' AND bucket = 0 "
      "AND measure <> 'blade_begun')";
  const std::string contacts = "(SELECT machine_id, kind, record_id, recorded_at, detail FROM machine_contacts)";
  const std::string counted = Dump(entries), last = Dump(contacts);
  Do("SELECT rebuild_summaries(min(recorded_at) + (max(recorded_at) - min(recorded_at)) / 2) FROM record_entries "
     "WHERE machine_id LIKE 'f%'");
  EXPECT_EQ(Dump(entries), counted);
  EXPECT_EQ(Dump(contacts), last);
  EXPECT_NE(Dump("machine_activity"), before["machine_activity"]);
}

TEST_F(FleetTest, HoursAndBladesThatAreOverGo) {
  const Instant now = std::chrono::system_clock::now();
  for (int i = 0; i < 30; ++i) {
    Event scan{now - hours(100 * 24) + hours(i), "scan", "old" + std::to_string(i), "f1", "airfoil"};
    Put(&scan);
  }
  EXPECT_EQ(Select("SELECT count(*) FROM blade_cycles WHERE blade_serial LIKE 'old%'").Int(0, 0), 30);
  for (int i = 0; i < 15; ++i) {
    Event scan{now + seconds(i), "scan", "new" + std::to_string(i), "f1", "airfoil"};
    Put(&scan);
  }
  EXPECT_EQ(Select("SELECT count(*) FROM blade_cycles WHERE blade_serial LIKE 'old%'").Int(0, 0), 0);
  EXPECT_EQ(Select("SELECT count(*) FROM machine_activity WHERE machine_id = 'f1' AND period = 'hour' AND begins_at < "
                   "now() - interval '62 days'")
                .Int(0, 0),
            0);
  EXPECT_GT(Select("SELECT count(*) FROM machine_activity WHERE machine_id = 'f1' AND period = 'day' AND begins_at < "
                   "now() - interval '62 days'")
                .Int(0, 0),
            0);
}

TEST_F(FleetTest, AServiceCountsByAppendingAndChangesNothingElse) {
  const auto role = Database::Open(sixpoint::testing::AsRole(database_.conninfo(), "ingest"), 1);
  for (const char* statement :
       {"UPDATE machine_activity SET entry_count = 1", "DELETE FROM blade_cycles",
        "SELECT count_entry(gen_random_uuid(), 1, now(), 'scan', 'b', 'm1')", "SELECT rebuild_summaries()"}) {
    absl::StatusOr<Transaction> transaction = role->Begin(Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    EXPECT_FALSE(transaction->Execute(statement).ok()) << statement;
  }
}

TEST_F(FleetTest, TheLastOfEachKindAndHowManyInARow) {
  const Instant now = std::chrono::system_clock::now();
  std::vector<Event> events = {{now - seconds(50), "inspection", "b1", "m1", "NOT_CONFORM"},
                               {now - seconds(40), "inspection", "b2", "m1", "NOT_CONFORM"},
                               {now - seconds(30), "inspection", "b3", "m1", "REJUDGED"},
                               {now - seconds(20), "inspection", "b4", "m1", "NOT_CONFORM"},
                               {now - seconds(10), "correction", "b5", "m1", "AWAITING_PERSON"}};
  Event scan{now - seconds(60), "scan", "b5", "m1", "airfoil"};
  Put(&scan);
  for (Event& event : events) Put(&event);
  // Another one of the blade, and the first is refused: the last one waits on.
  for (Event event : {Event{now - seconds(5), "correction", "b5", "m1", "AWAITING_PERSON"},
                      Event{now - seconds(4), "refusal", "b5", "m1", "", false, corrections_["b5"].id}})
    Put(&event);
  FleetFilter filter{"m1", "", 10, {SummaryPeriod::kHour, now - hours(2), now + hours(1)}, Reader::Everything()};
  const auto fleet = FleetIn(database_.database())->Fleet(filter, Soon());
  ASSERT_TRUE(fleet.ok()) << fleet.status();
  EXPECT_EQ(fleet->machine_ids, std::vector<std::string>{"m1"});
  std::map<std::string, ContactRow> contacts;
  for (const ContactRow& contact : fleet->contacts) contacts[contact.kind] = contact;
  EXPECT_EQ(contacts["inspection"].run_count, 3);
  EXPECT_EQ(contacts["inspection"].detail, "NOT_CONFORM");
  EXPECT_EQ(contacts["rejudgement"].run_count, 1);
  EXPECT_EQ(contacts["scan"].recorded_at, std::chrono::time_point_cast<std::chrono::microseconds>(scan.at));
  ASSERT_THAT(fleet->work, SizeIs(1));
  EXPECT_EQ(fleet->work[0].awaiting_count, 1);
  EXPECT_EQ(fleet->work[0].first_awaiting_id, corrections_["b5"].id);
  EXPECT_THAT(fleet->calibrations, SizeIs(2));
  EXPECT_THAT(fleet->damages, IsEmpty());
}

}  // namespace
}  // namespace sixpoint::storage
