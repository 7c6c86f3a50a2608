// Who sees what: clearances as they are granted and withdrawn, and what lists and recalls leave out for whom.
#include "storage/clearances.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <set>

#include "storage/corrections.h"
#include "storage/deviations.h"
#include "storage/inspections.h"
#include "storage/machining_passes.h"
#include "storage/measurements.h"
#include "storage/plant_store.h"
#include "storage/reconstructions.h"
#include "storage/record.h"
#include "storage/registrations.h"
#include "storage/repairs.h"
#include "storage/scans.h"
#include "storage/sections.h"
#include "storage/studies.h"
#include "tests/support/customers_parts.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Clear;
using sixpoint::testing::CustomersPart;
using sixpoint::testing::MachinesCalibrations;
using sixpoint::testing::PutCalibratedMachine;
using sixpoint::testing::PutCustomersPart;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using sixpoint::testing::Unclear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

const Reader kJane{"users/jane"};

template <typename Row>
std::vector<Row> Listed(const absl::StatusOr<std::vector<Row>>& rows) {
  EXPECT_TRUE(rows.ok()) << rows.status();
  return rows.ok() ? *rows : std::vector<Row>();
}

class ClearancesTest : public ::testing::Test {
 protected:
  Transaction Begin() { return *database_.database()->Begin(Soon()); }
  Database* plant() { return database_.database(); }

  // Everything that lists give to that reader, by word: "kappa", "sigma", ...
  std::set<std::string> WordsSeenBy(const Reader& reader) {
    Transaction t = Begin();
    std::set<std::string> seen;
    const auto add = [&seen](const std::string& list, const std::string& id) {
      seen.insert(list + " " + id.substr(0, id.find('-')));
    };
    for (const std::string& id : Listed(ListRegistered(t, Registered::kParts, {{}, reader}, "", 100))) add("part", id);
    BladeFilter blades;
    blades.reader = reader;
    const auto listed = ListBlades(t, blades, "", 100);
    EXPECT_TRUE(listed.ok()) << listed.status();
    for (const BladeRow& row : listed->blades) add("blade", row.blade_serial);
    ScanFilter scans;
    scans.reader = reader;
    for (const ScanRow& row : Listed(ListScans(t, scans, 0, 100))) add("scan", row.scan_id);
    RegistrationFilter registrations;
    registrations.reader = reader;
    for (const auto& row : Listed(ListRegistrations(t, registrations, 0, 100))) add("registration", row.part_id);
    CorrectionFilter corrections;
    corrections.reader = reader;
    for (const auto& row : Listed(ListCorrections(t, corrections, 0, 100))) add("correction", row.part_id);
    InspectionFilter inspections;
    inspections.reader = reader;
    for (const auto& row : Listed(ListInspections(t, inspections, 0, 100))) add("inspection", row.part_id);
    DeviationFilter deviations;
    deviations.reader = reader;
    for (const auto& row : Listed(DeviationsIn(plant())->List(deviations, 0, 100, Soon())))
      add("deviation", row.part_id);
    SectionFilter sections;
    sections.reader = reader;
    for (const auto& row : Listed(SectionsIn(plant())->List(sections, 0, 100, Soon()))) add("section", row.part_id);
    ReconstructionFilter reconstructions;
    reconstructions.reader = reader;
    for (const auto& row : Listed(ReconstructionsIn(plant())->List(reconstructions, 0, 100, Soon())))
      add("reconstruction", row.part_id);
    RepairFilter repairs;
    repairs.reader = reader;
    for (const auto& row : Listed(RepairsIn(plant())->List(repairs, 0, 100, Soon()))) add("repair", row.part_id);
    MachiningPassFilter passes;
    passes.reader = reader;
    for (const auto& row : Listed(MachiningPassesIn(plant())->List(passes, 0, 100, Soon())))
      add("machining pass", row.part_id);
    MeasurementFilter measurements;
    measurements.reader = reader;
    for (const auto& row : Listed(MeasurementsIn(plant())->List(measurements, 0, 100, Soon())))
      add("measurement", row.blade_serial);
    StudyFilter studies;
    studies.reader = reader;
    for (const StudyRow& row : Listed(ListStudies(t, studies, 0, 100))) add("study", row.inputs.front().substr(6));
    JournalPage page;
    page.reader = reader;
    for (const JournalEntry& entry : Listed(DerivedFrom(t, calibrations_.sensor, {}, page)))
      add("recall of " + entry.entry.kind, entry.entry.blade.value_or("?"));
    for (const JournalEntry& entry : Listed(DerivedFrom(t, "machines/m1", {"study"}, page)))
      add("recall", entry.entry.kind);
    return seen;
  }
  std::set<std::string> AllOf(const std::set<std::string>& words, int studies) {
    std::set<std::string> all;
    for (const std::string& word : words)
      for (const char* list : {"part",
                               "blade",
                               "scan",
                               "registration",
                               "correction",
                               "inspection",
                               "deviation",
                               "section",
                               "reconstruction",
                               "machining pass",
                               "repair",
                               "measurement",
                               "study",
                               "recall of registration",
                               "recall of correction",
                               "recall of inspection",
                               "recall of deviation",
                               "recall of section",
                               "recall of reconstruction",
                               "recall of machining_pass",
                               "recall of repair"})
        all.insert(std::string(list) + " " + word);
    if (studies > 0) all.insert("recall study");
    return all;
  }
  std::optional<std::string> Hidden(const Reader& reader, const std::vector<std::string>& names,
                                    Unrecorded unrecorded = Unrecorded::kIsHidden) {
    Transaction t = Begin();
    const auto hidden = FirstHidden(t, reader, names, unrecorded);
    EXPECT_TRUE(hidden.ok()) << hidden.status();
    return hidden.ok() ? *hidden : std::nullopt;
  }

  // That part's next revision, or its first; each `content` (a hexadecimal digit) is another one.
  absl::StatusOr<PartRow> Revise(const std::string& part_id, const std::string& customer, char content,
                                 const Reader& by) {
    Transaction t = Begin();
    const auto newest = FindPart(t, part_id, 0);
    PartRow part = newest->has_value() ? **newest : **FindPart(t, "kappa-part", 0);
    part.part_id = part_id;
    part.customer_id = customer;
    part.content_sha256 = std::string(64, content);
    RecordEntry entry;
    entry.software_version = "test";
    entry.reader = by;
    auto made = InsertPart(t, part, entry);
    if (!made.ok()) return made;
    EXPECT_TRUE(t.Commit().ok());
    return made;
  }
  // A request to clear jane for kappa, or to do so no more, committed.
  std::optional<ClearanceRow> Decide(bool grant, const std::string& request_id) {
    Transaction t = Begin();
    const ClearanceOrder order{"users/jane", "customers/kappa", "users/keeper", request_id};
    absl::StatusOr<std::optional<ClearanceRow>> done;
    if (grant) {
      auto granted = GrantClearance(t, order);
      granted.ok() ? done = *std::move(granted) : done = granted.status();
    } else {
      done = WithdrawClearance(t, order);
    }
    EXPECT_TRUE(done.ok()) << done.status();
    EXPECT_TRUE(t.Commit().ok());
    return done.ok() ? *done : std::nullopt;
  }

  // With what is put apart.
  CustomersPart Put(const std::string& word, bool has_customer) {
    CustomersPart part = PutCustomersPart(plant(), word, has_customer, calibrations_);
    sixpoint::testing::PutDrawing(plant(), &part);
    sixpoint::testing::PutMeasurement(plant(), &part);
    return part;
  }

  ThrowawayDatabase database_;
  MachinesCalibrations calibrations_ = PutCalibratedMachine(database_.database());
};

TEST_F(ClearancesTest, WithoutCustomersNothingIsHidden) {
  const CustomersPart open = Put("open", false);
  EXPECT_EQ(WordsSeenBy(kJane), AllOf({"open"}, 1));
  EXPECT_EQ(WordsSeenBy(Reader()), AllOf({"open"}, 1));
  EXPECT_FALSE(Hidden(kJane, open.names()).has_value());
  EXPECT_FALSE(Hidden(kJane, {"scans/none"}).has_value());
}

TEST_F(ClearancesTest, EachListAndRecallGivesWhatIsClearedAndNothingElse) {
  for (const char* word : {"kappa", "sigma"}) Put(word, true);
  Put("open", false);
  EXPECT_EQ(WordsSeenBy(Reader::Everything()), AllOf({"kappa", "sigma", "open"}, 3));
  EXPECT_EQ(WordsSeenBy(kJane), AllOf({"open"}, 1));
  EXPECT_EQ(WordsSeenBy(Reader()), AllOf({"open"}, 1)) << "who is not named sees what is everybody's";
  Clear(plant(), "users/jane", "customers/sigma");
  EXPECT_EQ(WordsSeenBy(kJane), AllOf({"sigma", "open"}, 2));
  EXPECT_EQ(WordsSeenBy({"users/jan"}), AllOf({"open"}, 1));
  Clear(plant(), "users/jane", "parts/kappa-part");
  EXPECT_EQ(WordsSeenBy(kJane), AllOf({"kappa", "sigma", "open"}, 3));
  Unclear(plant(), "users/jane", "customers/sigma");
  EXPECT_EQ(WordsSeenBy(kJane), AllOf({"kappa", "open"}, 2));
  Clear(plant(), "users/jane", "customers/sigma");
  Unclear(plant(), "users/jane", "parts/kappa-part");
  EXPECT_EQ(WordsSeenBy(kJane), AllOf({"sigma", "open"}, 2));
}

TEST_F(ClearancesTest, EachNameIsOfItsPart) {
  const CustomersPart kappa = Put("kappa", true);
  const CustomersPart open = Put("open", false);
  std::vector<std::string> hidden = kappa.names(), seen = open.names();
  hidden.insert(hidden.end(), {"parts/kappa-part@1", "parts/kappa-part@9"});
  seen.insert(seen.end(), {"parts/open-part@1", "machines/m1", "machines/m1@1", calibrations_.sensor});
  for (const std::string& name : hidden) EXPECT_EQ(Hidden(kJane, {name}), name);
  for (const std::string& name : seen) EXPECT_FALSE(Hidden(kJane, {name}).has_value()) << name;
  for (const char* name : {"scans/none", "parts/none", "blades/none", "machines/none", "SCANS/open-scan", "parts", "",
                           "blades/open-sn@1", "scans/open-scan/x", "users/jane"}) {
    EXPECT_EQ(Hidden(kJane, {name}), name) << "what is not recorded is as hidden";
    EXPECT_FALSE(Hidden(kJane, {name}, Unrecorded::kIsSeen).has_value()) << name;
    EXPECT_FALSE(Hidden(Reader::Everything(), {name}).has_value()) << name;
  }
  EXPECT_EQ(Hidden(kJane, {open.scan, kappa.scan, kappa.part}), kappa.scan);
  Clear(plant(), "users/jane", "customers/kappa");
  hidden.push_back("scans/none");
  EXPECT_FALSE(Hidden(kJane, hidden).has_value()) << "from whom nothing is hidden nothing is asked";
}

// A study of blades of two parts shows both.
TEST_F(ClearancesTest, AStudyIsSeenByWhoSeesAllThatItRestsOn) {
  const CustomersPart kappa = PutCustomersPart(plant(), "kappa", true, calibrations_);
  const CustomersPart open = PutCustomersPart(plant(), "open", false, calibrations_);
  const std::string id = NewUuid();
  {
    Transaction t = Begin();
    StudyRow row;
    row.study_id = id;
    row.kind = "GAUGE_RR";
    row.inputs = {open.scan, kappa.scan};
    row.verdict = "REPORTED";
    row.result_json = "{}";
    row.software_version = "test";
    RecordEntry entry;
    entry.kind = "study";
    entry.name = "studies/" + id;
    entry.inputs = row.inputs;
    entry.software_version = "test";
    ASSERT_TRUE(InsertStudy(t, row, entry).ok());
    ASSERT_TRUE(t.Commit().ok());
  }
  StudyFilter filter;
  filter.reader = kJane;
  Transaction t = Begin();
  EXPECT_EQ(ListStudies(t, filter, 0, 10)->size(), 1u);
  EXPECT_EQ(Hidden(kJane, {"studies/" + id}), "studies/" + id);
  Clear(plant(), "users/jane", "customers/kappa");
  EXPECT_EQ(ListStudies(t, filter, 0, 10)->size(), 3u);
  EXPECT_FALSE(Hidden(kJane, {"studies/" + id}).has_value());
}

TEST_F(ClearancesTest, ACustomerOnceStatedStaysUntilAnotherIs) {
  PutCustomersPart(plant(), "kappa", true, calibrations_);
  Clear(plant(), "users/jane", "customers/kappa");
  EXPECT_EQ(Revise("kappa-part", "", 'a', kJane)->customer_id, "kappa");
  EXPECT_EQ(Hidden({"users/jack"}, {"parts/kappa-part"}), "parts/kappa-part");
  // Neither who does not see it, nor who would not see it then, makes it another's.
  for (const auto& [customer, by] :
       std::vector<std::pair<std::string, Reader>>{{"", {"users/jack"}}, {"jacks", {"users/jack"}}, {"sigma", kJane}}) {
    const absl::Status refused = Revise("kappa-part", customer, 'b', by).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied) << refused;
  }
  Clear(plant(), "users/jane", "customers/sigma");
  EXPECT_EQ(Revise("kappa-part", "sigma", 'c', kJane)->customer_id, "sigma");
  Unclear(plant(), "users/jane", "customers/sigma");
  EXPECT_EQ(Hidden(kJane, {"parts/kappa-part"}), "parts/kappa-part") << "kappa's no more";
  // As a process of the release before, which knows of no customers.
  Transaction t = Begin();
  ASSERT_TRUE(
      t.Execute("INSERT INTO part_revisions (part_id, revision, content_sha256, cad_format, cad_unit_mm, cad_sha256, "
                "tessellation_method, zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, "
                "record_id) SELECT part_id, 9, content_sha256, cad_format, cad_unit_mm, cad_sha256, "
                "tessellation_method, zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, "
                "gen_random_uuid() FROM part_revisions WHERE part_id = 'kappa-part' AND revision = 1")
          .ok());
  EXPECT_EQ(**FirstHidden(t, kJane, {"parts/kappa-part"}, Unrecorded::kIsHidden), "parts/kappa-part");
  EXPECT_EQ((**FindPart(t, "kappa-part", 0)).customer_id, "sigma");
}

// Whose part it is says who sees all that is of it: who is cleared for a part alone does not decide that.
TEST_F(ClearancesTest, WhoGivesAPartToACustomerIsClearedForBothCustomers) {
  PutCustomersPart(plant(), "kappa", true, calibrations_);
  PutCustomersPart(plant(), "open", false, calibrations_);
  for (const char* scope : {"parts/kappa-part", "parts/open-part", "parts/new-part"})
    Clear(plant(), "users/jane", scope);
  const auto refused = [&](const std::string& part_id, const std::string& wanted) {
    const absl::Status said = Revise(part_id, "sigma", 'f', kJane).status();
    EXPECT_EQ(said.code(), absl::StatusCode::kPermissionDenied) << part_id << ": " << said;
    EXPECT_THAT(std::string(said.message()), HasSubstr("part.customer: sigma, want users/jane cleared for " + wanted));
    EXPECT_FALSE(Hidden(kJane, {part_id}, Unrecorded::kIsSeen).has_value()) << part_id;
    EXPECT_EQ(Hidden({"users/sigmas"}, {"parts/kappa-part"}), "parts/kappa-part");
  };
  Clear(plant(), "users/sigmas", "customers/sigma");
  for (const char* id : {"kappa-part", "open-part", "new-part"}) refused(id, "customers/");
  EXPECT_EQ(Revise("kappa-part", "", 'a', kJane)->customer_id, "kappa") << "a part's clearance is enough for the part";
  EXPECT_EQ(Revise("kappa-part", "kappa", 'b', kJane)->customer_id, "kappa");
  EXPECT_EQ(Revise("open-part", "", 'b', kJane)->customer_id, "");
  Clear(plant(), "users/jane", "customers/kappa");
  refused("kappa-part", "customers/sigma");
  Unclear(plant(), "users/jane", "customers/kappa");
  Clear(plant(), "users/jane", "customers/sigma");
  refused("kappa-part", "customers/kappa");
  // Of nobody's, and of one that is not there yet, there is no other customer.
  EXPECT_EQ(Revise("open-part", "sigma", 'c', kJane)->customer_id, "sigma");
  EXPECT_EQ(Revise("new-part", "sigma", 'c', kJane)->customer_id, "sigma");
  Clear(plant(), "users/jane", "customers/kappa");
  EXPECT_EQ(Revise("kappa-part", "sigma", 'd', kJane)->customer_id, "sigma");
  EXPECT_FALSE(Hidden({"users/sigmas"}, {"parts/kappa-part"}).has_value());
}

TEST_F(ClearancesTest, ABladeOfAHiddenPartIsNotTold) {
  PutCustomersPart(plant(), "kappa", true, calibrations_);
  PutCustomersPart(plant(), "open", false, calibrations_);
  Transaction t = Begin();
  RecordEntry entry;
  entry.software_version = "test";
  entry.reader = kJane;
  const absl::Status refused = InsertBlade(t, {"kappa-sn", "open-part", {}}, entry).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kPermissionDenied) << refused;
  EXPECT_THAT(std::string(refused.message()), ::testing::Not(HasSubstr("kappa-part")));
  entry.reader = Reader::Everything();
  EXPECT_EQ(InsertBlade(t, {"kappa-sn", "open-part", {}}, entry).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(ClearancesTest, WhoCouldSeeWhatWhenStays) {
  EXPECT_FALSE(Decide(false, NewUuid()).has_value()) << "nothing was there";
  const std::string request_id = NewUuid();
  const auto granted = Decide(true, request_id);
  ASSERT_TRUE(granted.has_value());
  EXPECT_FALSE(granted->withdrawn_at.has_value());
  EXPECT_EQ(Decide(true, NewUuid())->granted_sequence, granted->granted_sequence) << "it holds already";
  const auto withdrawn = Decide(false, NewUuid());
  EXPECT_EQ(withdrawn->granted_sequence, granted->granted_sequence);
  ASSERT_TRUE(withdrawn->withdrawn_at.has_value());
  EXPECT_GE(*withdrawn->withdrawn_at, granted->granted_at);
  EXPECT_EQ(withdrawn->withdrawn_by, "users/keeper");
  EXPECT_TRUE(Decide(true, request_id)->withdrawn_at.has_value()) << "a retry that comes late grants nothing";
  const auto again = Decide(true, NewUuid());
  EXPECT_GT(again->granted_sequence, granted->granted_sequence);
  Transaction t = Begin();
  const auto holding = ListClearances(t, {"users/jane", "", false}, 0, 10);
  ASSERT_EQ(holding->size(), 1u);
  EXPECT_EQ(holding->front().granted_sequence, again->granted_sequence);
  const auto ever = ListClearances(t, {"", "customers/kappa", true}, 0, 10);
  ASSERT_EQ(ever->size(), 2u);
  EXPECT_EQ(ever->back().granted_sequence, granted->granted_sequence);
  EXPECT_EQ(ListClearances(t, {"", "", true}, again->granted_sequence, 10)->size(), 1u);
  EXPECT_THAT(*ListClearances(t, {"users/jan", "", true}, 0, 10), IsEmpty());
  const ClearanceOrder other{"users/jack", "customers/kappa", "users/keeper", request_id};
  EXPECT_EQ(GrantClearance(t, other).status().code(), absl::StatusCode::kAlreadyExists);
}

// A request that found it so changes nothing when it comes again after the opposite.
TEST_F(ClearancesTest, ARequestThatDidNothingDoesNothingLater) {
  const std::string first = NewUuid(), second = NewUuid(), third = NewUuid(), fourth = NewUuid();
  const auto granted = Decide(true, first);
  ASSERT_TRUE(granted.has_value());
  EXPECT_EQ(Decide(true, second)->granted_sequence, granted->granted_sequence);
  EXPECT_TRUE(Decide(false, third)->withdrawn_at.has_value());
  for (const std::string& late : {first, second}) EXPECT_TRUE(Decide(true, late)->withdrawn_at.has_value());
  const auto withdrawn = Decide(false, fourth);
  EXPECT_EQ(withdrawn->withdrawn_at, Decide(false, third)->withdrawn_at) << "as it was withdrawn first";
  const auto again = Decide(true, NewUuid());
  for (const std::string& late : {third, fourth}) {
    EXPECT_FALSE(Decide(false, late)->withdrawn_at.has_value());
    EXPECT_EQ(Decide(false, late)->granted_sequence, again->granted_sequence);
  }
  Transaction t = Begin();
  EXPECT_EQ(ListClearances(t, {"users/jane", "", true}, 0, 10)->size(), 2u) << "what did nothing is no clearance";
  EXPECT_EQ(ListClearances(t, {"users/jane", "", false}, 0, 10)->size(), 1u);
  for (const std::string& used : {second, fourth}) {
    const ClearanceOrder other{"users/jack", "customers/kappa", "users/keeper", used};
    EXPECT_EQ(GrantClearance(t, other).status().code(), absl::StatusCode::kAlreadyExists);
  }
}

// A study of a month that is gone cannot be told to be anybody's.
TEST_F(ClearancesTest, WhatCannotBeToldIsHidden) {
  PutCustomersPart(plant(), "kappa", true, calibrations_);
  Transaction t = Begin();
  const auto parts = t.Execute(
      "SELECT parts_of_record('00000000-0000-7000-8000-000000000000') IS NULL, "
      "(SELECT parts_of_record(record_id) = ARRAY['kappa-part'] FROM record_names WHERE name = "
      "'scans/kappa-scan'), (SELECT parts_of_record(record_id) = '{}' FROM record_names WHERE name "
      "= 'machines/m1@1')");
  ASSERT_TRUE(parts.ok()) << parts.status();
  for (int column = 0; column < 3; ++column) EXPECT_TRUE(parts->Bool(0, column)) << column;
  ASSERT_TRUE(t.Execute("SET LOCAL session_replication_role = replica").ok());
  ASSERT_TRUE(
      t.Execute("DELETE FROM record_entries USING record_names n WHERE n.record_id = record_entries.record_id AND "
                "n.name = 'scans/kappa-scan'")
          .ok());
  ASSERT_TRUE(t.Execute("SET LOCAL session_replication_role = DEFAULT").ok());
  const auto study = t.Execute("SELECT bool_and(parts_of_record(study_id) IS NULL) FROM studies");
  ASSERT_TRUE(study.ok()) << study.status();
  EXPECT_TRUE(study->Bool(0, 0));
}

// One part of a hundred, at a plant whose other parts are made every day: its rows are found by its blades, however old they are, not
// by leaving out all others.
class ManyMonthsTest : public ClearancesTest {
 protected:
  static constexpr int kParts = 100, kEach = 100;

  // Results of p0 again and again over a year as those of a hundred parts, p0's first; few scans are of an artefact.
  void SetUp() override {
    PutCustomersPart(plant(), "p0", false, calibrations_);
    Transaction t = *plant()->Begin(Soon(120));
    sixpoint::testing::RegisterArtefact(t, "a1");
    for (int i = 1; i < kParts; ++i) {
      const std::string word = "p" + std::to_string(i);
      sixpoint::testing::RegisterPart(t, word + "-part");
      sixpoint::testing::RegisterBlade(t, word + "-sn", word + "-part");
    }
    for (const char* sql :
         {"SELECT make_partition(held_by, name, by_uuid, (date_trunc('month', now()) - make_interval(months => "
          "m))::date) FROM partitioned_tables CROSS JOIN generate_series(1, 13) m ORDER BY m, depth, name",
          "SET LOCAL session_replication_role = replica", "UPDATE part_revisions SET customer_id = 'of-' || part_id",
          "CREATE TEMPORARY TABLE made ON COMMIT DROP AS SELECT of_kind, 'p' || (i / 100) || '-part' AS part, "
          "CASE WHEN of_kind <> 'scan' OR i % 500 <> 499 THEN 'p' || (i / 100) || '-sn' END AS blade, "
          "1000000 * k + i AS at_sequence, now() - make_interval(mins => (10000 - i) * 50) AS at, "
          "(left(least_uuid_of(now() - make_interval(mins => (10000 - i) * 50))::text, 14) || "
          "right(gen_random_uuid()::text, 22))::uuid AS id FROM unnest(ARRAY['registration', "
          "'inspection', 'scan']) WITH ORDINALITY made_of (of_kind, k) CROSS JOIN generate_series(0, 9999) i",
          "INSERT INTO record_names SELECT id, of_kind || 's/' || at_sequence, at_sequence, at FROM made",
          "INSERT INTO record_entries SELECT p.* FROM record_entries e JOIN made ON of_kind = e.kind CROSS JOIN "
          "LATERAL jsonb_populate_record(e, jsonb_build_object('record_id', id, 'record_sequence', at_sequence, "
          "'blade_serial', blade, 'recorded_at', at)) p",
          "INSERT INTO registrations SELECT p.* FROM registrations r CROSS JOIN made CROSS JOIN LATERAL "
          "jsonb_populate_record(r, jsonb_build_object('registration_id', id, 'part_id', part, 'blade_serial', blade)) "
          "p WHERE of_kind = 'registration'",
          "INSERT INTO inspections SELECT p.* FROM inspections r CROSS JOIN made CROSS JOIN LATERAL "
          "jsonb_populate_record(r, jsonb_build_object('inspection_id', id, 'part_id', part, 'blade_serial', blade)) "
          "p WHERE of_kind = 'inspection'",
          "INSERT INTO scans SELECT p.* FROM scans r CROSS JOIN made CROSS JOIN LATERAL "
          "jsonb_populate_record(r, jsonb_build_object('scan_key', id, 'scan_id', 's' || at_sequence, 'blade_serial', "
          "blade) || CASE WHEN blade IS NULL THEN '{\"artefact_id\": \"a1\", \"artefact_revision\": 1, \"kind\": "
          "\"artefact\"}' ELSE '{}' END::jsonb) p WHERE of_kind = 'scan'",
          "SET LOCAL session_replication_role = DEFAULT",
          "ANALYZE record_names, record_entries, registrations, inspections, scans, blades, part_revisions"}) {
      const absl::Status done = t.Execute(sql).status();
      ASSERT_TRUE(done.ok()) << sql << ": " << done;
    }
    ASSERT_TRUE(t.Commit().ok());
    Clear(plant(), "users/jane", "customers/of-p0-part");
  }

  // What is to be listed from below that, as the journal has it.
  std::vector<std::int64_t> Expected(const std::string& kind, const Reader& reader, std::int64_t before) {
    Transaction t = Begin();
    const auto rows = t.Execute(
        "SELECT record_sequence FROM record_entries WHERE kind = $1 AND ($2::boolean OR blade_serial IS NULL OR "
        "blade_serial = 'p0-sn') AND ($3::bigint = 0 OR record_sequence < $3::bigint) ORDER BY 1 DESC LIMIT 50",
        Params().Text(kind).Bool(reader.sees_all).Int(before));
    EXPECT_TRUE(rows.ok()) << rows.status();
    std::vector<std::int64_t> sequences;
    for (int row = 0; rows.ok() && row < rows->count(); ++row) sequences.push_back(rows->Int(row, 0));
    return sequences;
  }

  // Two pages; of each as PostgreSQL counts what it read: rows of the journal and of results, fetched or scanned.
  template <typename Filter, typename List>
  void ExpectFewRowsRead(const std::string& kind, const Reader& reader, const List& list) {
    const char counted[] =
        "SELECT sum(seq_tup_read + idx_tup_fetch)::bigint FROM pg_stat_xact_user_tables WHERE relname ~ "
        "'^(record_entries|registrations|inspections|scans)'";
    std::int64_t before_sequence = 0;
    for (const char* page : {"first", "second"}) {
      const std::vector<std::int64_t> expected = Expected(kind, reader, before_sequence);
      ASSERT_THAT(expected, ::testing::SizeIs(50)) << kind;
      Transaction t = Begin();
      Filter filter;
      filter.reader = reader;
      const auto before = t.Execute(counted);
      const auto begin = std::chrono::steady_clock::now();
      const auto listed = list(t, filter, before_sequence, 50);
      const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
      ASSERT_TRUE(listed.ok()) << listed.status();
      const auto after = t.Execute(counted);
      std::vector<std::int64_t> sequences;
      for (const auto& row : *listed) sequences.push_back(row.recorded.sequence);
      EXPECT_EQ(sequences, expected) << kind << " by " << reader.identity;
      const std::int64_t read = after->Int(0, 0) - before->Int(0, 0);
      std::printf("%s page of 50 of %d %ss in 13 months by %s: %ld rows read, %.1f ms\n", page, kParts * kEach,
                  kind.c_str(), reader.sees_all ? "who sees all" : "a reader of 1 of 100 parts",
                  static_cast<long>(read), ms);
      EXPECT_LT(read, kParts * kEach / 2) << kind << " by " << reader.identity;
      before_sequence = expected[29];
    }
  }
};

TEST_F(ManyMonthsTest, AReaderOfOnePartOfAHundredReadsNoMonths) {
  const auto sight = [&] {
    Transaction t = Begin();
    return SightOf(t, kJane);
  }();
  ASSERT_TRUE(sight.ok()) << sight.status();
  EXPECT_EQ(sight->hidden_parts.size(), 99u);
  ASSERT_TRUE(sight->seen_blades.has_value());
  EXPECT_THAT(*sight->seen_blades, ElementsAre("p0-sn"));
  for (const Reader& reader : {Reader::Everything(), kJane}) {
    ExpectFewRowsRead<RegistrationFilter>("registration", reader, ListRegistrations);
    ExpectFewRowsRead<InspectionFilter>("inspection", reader, ListInspections);
    ExpectFewRowsRead<ScanFilter>("scan", reader, ListScans);
  }
  constexpr int kQuestions = 200;
  for (const Reader& reader : {Reader{"users/nobody"}, kJane}) {
    Transaction t = *plant()->Begin(Soon(120));
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kQuestions; ++i)
      EXPECT_EQ(FirstHidden(t, reader, {"blades/p0-sn", "machines/m1"}, Unrecorded::kIsHidden)->has_value(),
                reader.identity != kJane.identity);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    std::printf("the door's question by %s: %.2f ms\n", reader.identity.c_str(), ms / kQuestions);
  }
}

}  // namespace
}  // namespace sixpoint::storage
