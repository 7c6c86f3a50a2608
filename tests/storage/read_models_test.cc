// What programs read by SQL (migrations/V0031): names and meanings that stay, on a seeded plant; and that no login sees more than it is
// cleared for, whatever it tries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "seed/seed_plant.h"
#include "storage/blobs.h"
#include "storage/database.h"
#include "storage/deviations.h"
#include "storage/dispositions.h"
#include "storage/inspection_values.h"
#include "storage/record.h"
#include "tests/support/customers_parts.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Clear;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using sixpoint::testing::Unclear;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

std::string FileText(const std::string& path) {
  const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
  std::ifstream file(std::string(source == nullptr ? "." : source) + "/" + path);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

// Rows of one statement, their columns joined; and what refused it.
struct Asked {
  std::vector<std::string> rows;
  std::string refusal;
};
Asked Ask(Database& database, const std::string& sql, const std::vector<std::string>& before = {}) {
  Asked asked;
  absl::StatusOr<Transaction> transaction = database.Begin(Soon(60));
  if (!transaction.ok()) return {{}, transaction.status().ToString()};
  for (const std::string& first : before)
    if (const auto done = transaction->Execute(first); !done.ok()) return {{}, done.status().ToString()};
  const absl::StatusOr<Rows> rows = transaction->Execute("SELECT to_jsonb(t)::text FROM (" + sql + ") t");
  if (!rows.ok()) return {{}, rows.status().ToString()};
  for (int row = 0; row < rows->count(); ++row) asked.rows.push_back(rows->Text(row, 0));
  return asked;
}

// One plant for all: 60 seeded blades, and two customers' parts with one of everything.
class ReadModelsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    plant_ = std::make_unique<ThrowawayDatabase>();
    seed::Request request;
    request.options = {4, 60, 5, 4};
    const auto planted = seed::SeedPlant(plant_->conninfo(), request, [](int) {});
    ASSERT_TRUE(planted.ok()) << planted.status();
    const auto calibrations = sixpoint::testing::PutCalibratedMachine(plant_->database());
    acme_ = sixpoint::testing::PutCustomersPart(plant_->database(), "acme", true, calibrations);
    zeta_ = sixpoint::testing::PutCustomersPart(plant_->database(), "zeta", true, calibrations);
    for (const char* login : {"bi_open", "bi_cleared"})
      Ask(*plant_->database(), "SELECT 1", {std::string("DROP ROLE IF EXISTS ") + login});
    for (const char* login : {"bi_open", "bi_cleared"}) {
      auto transaction = plant_->database()->Begin(Soon());
      ASSERT_TRUE(transaction->Execute("SELECT make_reader($1)", Params().Text(login)).ok());
      ASSERT_TRUE(transaction->Commit().ok());
    }
    PutHoles();
    PutDispositions();
    PutDeviations(calibrations);
    PutDrawings();
    PutStations();
    Clear(plant_->database(), "readers/bi_cleared", "customers/acme");
  }
  // The customers' results have none.
  static void PutHoles() {
    auto transaction = plant_->database()->Begin(Soon());
    for (const char* sql : {"INSERT INTO inspection_holes (inspection_id, position_index, group_name, hole_name, "
                            "verdict, position_verdict, "
                            "inclination_verdict, position_tolerance_mm, inclination_tolerance_deg, point_count, "
                            "pin_residual_rms_um, reason, "
                            "positioning_difference_um) SELECT inspection_id, 0, 'G1', 'H1', 'NOT_MEASURED', "
                            "'NOT_MEASURED', 'NOT_MEASURED', 0.03, 1, 0, "
                            "0, 'no pin', 0 FROM inspections WHERE blade_serial NOT LIKE 'SEED-%'",
                            "INSERT INTO correction_groups (correction_id, position_index, group_name, a_deg, b_deg, "
                            "a_nominal_deg, b_nominal_deg, "
                            "a_ideal_deg, b_ideal_deg, a_standard_uncertainty_deg, b_standard_uncertainty_deg) SELECT "
                            "correction_id, 0, 'G1', 0, 0, 0, 0, "
                            "0, 0, 0, 0 FROM corrections WHERE blade_serial NOT LIKE 'SEED-%'",
                            "INSERT INTO correction_holes (correction_id, group_name, position_index, hole_name, "
                            "start_x_mm, start_y_mm, start_z_mm, "
                            "nominal_start_x_mm, nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um) "
                            "SELECT correction_id, 'G1', 0, 'H1', 0, "
                            "0, 0, 0, 0, 0, 1 FROM corrections WHERE blade_serial NOT LIKE 'SEED-%'"}) {
      const auto put = transaction->Execute(sql);
      ASSERT_TRUE(put.ok() && put->affected() == 2) << put.status();
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }
  // Of the customers' inspections, and of one that was seeded: a plant of this size has none that is not conform.
  static void PutDispositions() {
    auto transaction = plant_->database()->Begin(Soon());
    const auto inspected = transaction->Execute(
        "SELECT inspection_id, blade_serial FROM inspections WHERE blade_serial NOT LIKE 'SEED-%' UNION ALL "
        "(SELECT inspection_id, blade_serial FROM inspections WHERE blade_serial LIKE 'SEED-%' LIMIT 1)");
    ASSERT_TRUE(inspected.ok() && inspected->count() == 3) << inspected.status();
    for (int row = 0; row < inspected->count(); ++row) {
      DispositionRow disposition;
      disposition.disposition_id = NewUuid();
      disposition.inspection_id = inspected->Text(row, 0);
      disposition.blade_serial = inspected->Text(row, 1);
      disposition.disposition = "REWORK";
      disposition.reason = "a burr";
      disposition.requested_by = "machines/m1";
      disposition.software_version = "0.1.0";
      RecordEntry entry;
      entry.kind = "disposition";
      entry.name = "dispositions/" + disposition.disposition_id;
      entry.inputs = {"inspections/" + disposition.inspection_id};
      entry.blade = disposition.blade_serial;
      entry.method = disposition.disposition;
      entry.software_version = disposition.software_version;
      entry.requested_by = disposition.requested_by;
      const auto put = InsertDisposition(*transaction, disposition, entry);
      ASSERT_TRUE(put.ok()) << put.status();
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }
  // Of a blade that everybody sees, too.
  static void PutDeviations(const sixpoint::testing::MachinesCalibrations& calibrations) {
    auto transaction = plant_->database()->Begin(Soon());
    const auto seeded = transaction->Execute(
        "SELECT part_id, blade_serial, 'registrations/' || registration_id FROM inspections "
        "WHERE blade_serial LIKE 'SEED-%' LIMIT 1");
    ASSERT_TRUE(seeded.ok() && seeded->count() == 1) << seeded.status();
    sixpoint::testing::PutDeviation(*transaction, seeded->Text(0, 0), seeded->Text(0, 1), seeded->Text(0, 2), "17",
                                    calibrations);
    sixpoint::testing::PutSections(*transaction, seeded->Text(0, 0), seeded->Text(0, 1), seeded->Text(0, 2), "50 %",
                                   calibrations);
    const std::string reconstruction = sixpoint::testing::PutReconstruction(
        *transaction, seeded->Text(0, 0), seeded->Text(0, 1), seeded->Text(0, 2), "edge", calibrations);
    sixpoint::testing::PutMachiningPass(*transaction, seeded->Text(0, 0), seeded->Text(0, 1), seeded->Text(0, 2),
                                        reconstruction, calibrations);
    sixpoint::testing::PutRepair(*transaction, seeded->Text(0, 0), seeded->Text(0, 1), seeded->Text(0, 2),
                                 calibrations);
    ASSERT_TRUE(transaction->Commit().ok());
  }
  // Of a part that everybody sees, too, and what another instrument measured by them.
  static void PutDrawings() {
    for (auto* const part : {&acme_, &zeta_}) {
      sixpoint::testing::PutDrawing(plant_->database(), part);
      sixpoint::testing::PutAssessment(plant_->database(), part);
      sixpoint::testing::PutMeasurement(plant_->database(), part);
    }
    auto transaction = plant_->database()->Begin(Soon());
    const auto seeded =
        transaction->Execute("SELECT part_id, blade_serial FROM blades WHERE part_id LIKE 'SEED-%' LIMIT 1");
    ASSERT_TRUE(seeded.ok() && seeded->count() == 1) << seeded.status();
    const std::string drawing = sixpoint::testing::PutDrawingOf(*transaction, seeded->Text(0, 0), "SEED-drawing");
    sixpoint::testing::PutMeasurementOf(*transaction, seeded->Text(0, 0), seeded->Text(0, 1), drawing);
    const auto mapped = transaction->Execute(
        "SELECT part_id, blade_serial, 'deviations/' || deviation_id FROM deviation_maps WHERE blade_serial LIKE "
        "'SEED-%' LIMIT 1");
    ASSERT_TRUE(mapped.ok() && mapped->count() == 1) << mapped.status();
    sixpoint::testing::PutAssessmentOf(*transaction, mapped->Text(0, 0), mapped->Text(0, 1), drawing,
                                       mapped->Text(0, 2), "seed");
    ASSERT_TRUE(transaction->Commit().ok());
  }
  // Of the customers' parts, and of one that everybody sees; shape regions too.
  static void PutStations() {
    auto transaction = plant_->database()->Begin(Soon());
    const auto put = transaction->Execute(
        "INSERT INTO part_stations (part_id, revision, station_index, station, zero_from_part_nominal_rotation, "
        "zero_from_part_nominal_translation_mm, capture_mm) SELECT part_id, revision, 0, 'left', "
        "'{1,0,0,0,1,0,0,0,1}', '{20,50,-190}', 3 FROM part_revisions");
    ASSERT_TRUE(put.ok()) << put.status();
    const auto regions = transaction->Execute(
        "INSERT INTO part_shape_regions (part_id, revision, region_index, region, kind, allowance_mm, lower_mm, "
        "upper_mm) SELECT part_id, revision, 0, 'all', 'MACHINED', 0.05, -0.5, 0.5 FROM part_revisions");
    ASSERT_TRUE(regions.ok()) << regions.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  static void TearDownTestSuite() { plant_.reset(); }

  static std::unique_ptr<Database> As(const std::string& login) {
    const std::string owner = "user=sixpoint";
    std::string conninfo = plant_->conninfo();
    conninfo.replace(conninfo.find(owner), owner.size(), "user=" + login);
    return Database::Open(conninfo, 1);
  }
  static std::vector<std::string> Views() {
    std::vector<std::string> names;
    const auto rows = plant_->database()->Begin(Soon())->Execute(
        "SELECT table_name FROM information_schema.views WHERE table_schema = 'read_v1' ORDER BY 1");
    for (int row = 0; rows.ok() && row < rows->count(); ++row) names.push_back(rows->Text(row, 0));
    return names;
  }

  static std::unique_ptr<ThrowawayDatabase> plant_;
  static sixpoint::testing::CustomersPart acme_, zeta_;
};
std::unique_ptr<ThrowawayDatabase> ReadModelsTest::plant_;
sixpoint::testing::CustomersPart ReadModelsTest::acme_, ReadModelsTest::zeta_;

// A view may grow at its end, and there may be more views; nothing that stands in the file goes.
TEST_F(ReadModelsTest, NamesAndTypesAreThoseThatWerePromised) {
  std::map<std::string, std::vector<std::string>> promised;
  std::istringstream lines(FileText("tests/storage/read_v1.txt"));
  for (std::string line; std::getline(lines, line);)
    if (!line.empty() && line[0] != '#') promised[line.substr(0, line.find('.'))].push_back(line);
  ASSERT_GE(promised.size(), 12u);
  for (const auto& [view, columns] : promised) {
    const auto rows = plant_->database()->Begin(Soon())->Execute(
        "SELECT table_name || '.' || column_name || ' ' || data_type FROM information_schema.columns "
        "WHERE table_schema = 'read_v1' AND table_name = $1 ORDER BY ordinal_position",
        Params().Text(view));
    ASSERT_TRUE(rows.ok()) << rows.status();
    std::vector<std::string> found;
    for (int row = 0; row < rows->count(); ++row) found.push_back(rows->Text(row, 0));
    ASSERT_GE(found.size(), columns.size()) << view;
    EXPECT_THAT(std::vector<std::string>(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(columns.size())),
                ElementsAreArray(columns));
  }
  for (const std::string& view : Views()) EXPECT_EQ(promised.count(view), 1u) << view << ": promise it";
}

TEST_F(ReadModelsTest, EveryViewAndColumnSaysWhatItIsAndTheDocumentSaysTheSame) {
  const std::string document = FileText("docs/sql.md");
  const auto rows = plant_->database()->Begin(Soon())->Execute(
      "SELECT c.relname, a.attname, coalesce(obj_description(c.oid), ''), coalesce(col_description(c.oid, a.attnum), "
      "''), "
      "format_type(a.atttypid, NULL) FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 "
      "WHERE c.relnamespace = 'read_v1'::regnamespace ORDER BY c.relname, a.attnum");
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_GT(rows->count(), 100);
  for (int row = 0; row < rows->count(); ++row) {
    const std::string view = rows->Text(row, 0), column = rows->Text(row, 1), said = rows->Text(row, 3);
    EXPECT_NE(rows->Text(row, 2), "") << view;
    EXPECT_NE(said, "") << view << "." << column;
    EXPECT_THAT(document, HasSubstr("## `read_v1." + view + "`\n" + rows->Text(row, 2) + "\n"));
    EXPECT_THAT(document, HasSubstr("| `" + column + "` | " + rows->Text(row, 4) + " | " + said + " |\n")) << view;
  }
}

// What rests on a registration tells its station; none where that has none.
TEST_F(ReadModelsTest, TellsWhereBladesStood) {
  const auto reader = As("bi_cleared");
  for (const char* view : {"corrections", "inspections", "deviations", "sections", "reconstructions"}) {
    const Asked asked =
        Ask(*reader, std::string("SELECT count(*) FILTER (WHERE r.station = 'left') > 0 AS at_left, "
                                 "count(*) FILTER (WHERE r.station IS NULL) > 0 AS nowhere, "
                                 "bool_or(r.station IS DISTINCT FROM g.station) AS wrong FROM read_v1.") +
                         view + " r JOIN read_v1.registrations g USING (registration_id)");
    EXPECT_THAT(asked.rows, UnorderedElementsAre(R"({"wrong": false, "at_left": true, "nowhere": true})"))
        << view << asked.refusal;
  }
}

// Each view has an example, and each gives rows on this plant.
TEST_F(ReadModelsTest, TheDocumentsExamplesRun) {
  const std::string document = FileText("docs/sql.md");
  const auto reader = As("bi_open");
  std::set<std::string> shown;
  const std::regex block("```sql\n([^`]*)```");
  for (auto found = std::sregex_iterator(document.begin(), document.end(), block); found != std::sregex_iterator();
       ++found) {
    std::string sql = (*found)[1];
    sql.erase(sql.find_last_of(';'));
    const Asked asked = Ask(*reader, sql);
    EXPECT_EQ(asked.refusal, "") << sql;
    EXPECT_THAT(asked.rows, Not(IsEmpty())) << sql;
    const std::regex named("read_v1\\.([a-z_]+)");
    for (auto name = std::sregex_iterator(sql.begin(), sql.end(), named); name != std::sregex_iterator(); ++name)
      shown.insert((*name)[1]);
  }
  for (const std::string& view : Views()) EXPECT_EQ(shown.count(view), 1u) << view << ": no example";
  for (const char* function : {"recall", "events_after"}) EXPECT_EQ(shown.count(function), 1u) << function;
}

TEST_F(ReadModelsTest, AReaderReadsTheViewsAndNothingElse) {
  const auto reader = As("bi_open");
  for (const std::string& view : Views()) {
    EXPECT_EQ(Ask(*reader, "SELECT * FROM read_v1." + view).refusal, "");
    EXPECT_THAT(Ask(*reader, "SELECT * FROM " + view, {"RESET search_path"}).rows, Not(IsEmpty()))
        << view << ", by its name alone";
  }
  for (const char* sql :
       {"SELECT * FROM public.blades", "SELECT * FROM public.persons", "SELECT public.hidden_parts('readers/bi_open')",
        "SELECT public.name_of('persons/0123456789abcdef')", "SELECT public.sight_of('users/jane', 10)",
        "SELECT public.forget_person('jane')", "SELECT public.make_reader('mine')",
        "SELECT * FROM detached.scans_2020_01"})
    EXPECT_THAT(Ask(*reader, sql).refusal, HasSubstr("[42501]")) << sql;
  // A login may switch its own settings; the rights stay.
  for (const char* sql :
       {"INSERT INTO read_v1.blades (blade_serial) VALUES ('mine')", "DELETE FROM read_v1.blades",
        "UPDATE read_v1.events SET name = 'mine'", "CREATE TABLE read_v1.mine ()", "SET ROLE sixpoint_plant",
        "SET ROLE bi_cleared", "SET SESSION AUTHORIZATION bi_cleared", "CREATE ROLE mine"})
    EXPECT_THAT(Ask(*reader, "SELECT 1", {"SET TRANSACTION READ WRITE", sql}).refusal,
                ::testing::AnyOf(HasSubstr("[42501]"), HasSubstr("[55000]")))
        << sql;
  EXPECT_THAT(Ask(*reader, "SELECT 1", {"CREATE TABLE pg_temp.mine ()"}).refusal, HasSubstr("[25006]")) << "read only";
}

TEST_F(ReadModelsTest, ALoginSeesWhatItIsClearedForAndNoMore) {
  const std::map<std::string, std::set<std::string>> seen_by = {{"bi_open", {}}, {"bi_cleared", {"acme"}}};
  for (const auto& [login, words] : seen_by) {
    const auto reader = As(login);
    for (const std::string& view : Views())
      for (const auto* part : {&acme_, &zeta_}) {
        // A row that is of the part holds its word, in a serial, a name or an id; machines and calibrations are nobody's.
        const Asked asked =
            Ask(*reader, "SELECT * FROM read_v1." + view + " v WHERE to_jsonb(v)::text LIKE '%" + part->word + "%'");
        EXPECT_EQ(asked.refusal, "");
        const bool is_of_part = view != "machines" && view != "calibrations";
        EXPECT_EQ(!asked.rows.empty(), is_of_part && words.count(part->word) > 0)
            << login << ", " << view << ", " << part->word << ": " << asked.rows.size();
      }
    for (const auto* part : {&acme_, &zeta_})
      for (const std::string& name : {std::string("machines/m1"), part->blade, part->scan}) {
        const Asked asked = Ask(*reader, "SELECT * FROM read_v1.recall('" + name +
                                             "') WHERE coalesce(blade_serial, '') || name LIKE '%" + part->word + "%'");
        EXPECT_EQ(asked.refusal, "");
        EXPECT_EQ(!asked.rows.empty(), words.count(part->word) > 0) << login << ", " << name;
      }
  }
}

// Of a view without a barrier a function of the reader's own would be asked about the rows that are then left out.
TEST_F(ReadModelsTest, AFunctionOfTheReadersSeesNoHiddenRow) {
  const auto reader = As("bi_open");
  const std::vector<std::string> leak = {
      "SET TRANSACTION READ WRITE",
      "CREATE FUNCTION pg_temp.leak(text) RETURNS boolean LANGUAGE plpgsql COST 0.0000001 AS $$ BEGIN "
      "IF $1 LIKE '%acme%' OR $1 LIKE '%zeta%' THEN RAISE EXCEPTION 'seen: %', $1; END IF; RETURN true; END $$"};
  for (const char* of :
       {"blades WHERE pg_temp.leak(blade_serial)", "parts WHERE pg_temp.leak(part_id)",
        "scans WHERE pg_temp.leak(scan_id)", "registrations WHERE pg_temp.leak(blade_serial)",
        "corrections WHERE pg_temp.leak(blade_serial)", "correction_holes WHERE pg_temp.leak(blade_serial)",
        "inspections WHERE pg_temp.leak(blade_serial)", "characteristics WHERE pg_temp.leak(blade_serial)",
        "drawings WHERE pg_temp.leak(drawing_id)", "drawing_characteristics WHERE pg_temp.leak(drawing_id)",
        "measurements WHERE pg_temp.leak(blade_serial)", "events WHERE pg_temp.leak(name)",
        "edges WHERE pg_temp.leak(input_name)", "edges WHERE pg_temp.leak(name)",
        "recall('machines/m1') WHERE pg_temp.leak(name)", "events_after(0, 100000) WHERE pg_temp.leak(name)"})
    EXPECT_EQ(Ask(*reader, std::string("SELECT 1 FROM read_v1.") + of, leak).refusal, "") << of;
  // That the function tells what it sees.
  const auto cleared = As("bi_cleared");
  EXPECT_THAT(Ask(*cleared, "SELECT 1 FROM read_v1.blades WHERE pg_temp.leak(blade_serial)", leak).refusal,
              HasSubstr("seen: acme"));
}

TEST_F(ReadModelsTest, AClearanceIsWithdrawnAtOnce) {
  const auto reader = As("bi_open");
  constexpr char kAsk[] = "SELECT blade_serial FROM read_v1.blades WHERE blade_serial LIKE 'zeta%'";
  EXPECT_THAT(Ask(*reader, kAsk).rows, IsEmpty());
  Clear(plant_->database(), "readers/bi_open", "customers/zeta");
  EXPECT_EQ(Ask(*reader, kAsk).rows.size(), 1u);
  Unclear(plant_->database(), "readers/bi_open", "customers/zeta");
  EXPECT_THAT(Ask(*reader, kAsk).rows, IsEmpty());
}

// An administrator may have made one login a member of another.
TEST_F(ReadModelsTest, ARoleThatIsTakenOnShowsNoMore) {
  auto transaction = plant_->database()->Begin(Soon());
  ASSERT_TRUE(transaction->Execute("GRANT bi_cleared TO bi_open").ok());
  ASSERT_TRUE(transaction->Commit().ok());
  const auto reader = As("bi_open");
  const std::vector<std::string> taken_on = {"SET ROLE bi_cleared"};
  EXPECT_THAT(Ask(*reader, "SELECT 1 FROM read_v1.parts WHERE part_id LIKE 'SEED-%'", taken_on).rows, Not(IsEmpty()));
  EXPECT_THAT(Ask(*reader, "SELECT 1 FROM read_v1.parts WHERE part_id LIKE 'acme%'", taken_on).rows, IsEmpty());
  EXPECT_THAT(Ask(*reader, "SELECT 1 FROM read_v1.recall('machines/m1') WHERE name LIKE '%acme%'", taken_on).rows,
              IsEmpty());
  auto revoked = plant_->database()->Begin(Soon());
  ASSERT_TRUE(revoked->Execute("REVOKE bi_cleared FROM bi_open").ok());
  ASSERT_TRUE(revoked->Commit().ok());
}

TEST_F(ReadModelsTest, APersonIsAPseudonym) {
  const auto reader = As("bi_open");
  // The seeder is users/seed, as the services tell it.
  EXPECT_THAT(Ask(*plant_->database(), "SELECT user_name FROM persons").rows,
              ::testing::Contains(HasSubstr("\"seed\"")));
  EXPECT_THAT(Ask(*reader, "SELECT name FROM read_v1.events WHERE requested_by LIKE 'persons/%'").rows, Not(IsEmpty()));
  EXPECT_THAT(Ask(*reader, "SELECT name FROM read_v1.events WHERE requested_by LIKE 'users/%'").rows, IsEmpty());
  EXPECT_THAT(
      Ask(*plant_->database(),
          "SELECT asker_for_reader('users/jane via services/inspection') AS a, asker_for_reader('machines/m1') AS b")
          .rows,
      UnorderedElementsAre(R"({"a": "users/* via services/inspection", "b": "machines/m1"})"));
}

// A value is what ValueService tells, and a recall what RecordService tells.
TEST_F(ReadModelsTest, TellsWhatTheServicesTell) {
  const auto reader = As("bi_open");
  ValueFilter filter;
  filter.blade_serial = "SEED-4-00000003";
  const auto values = ValuesIn(plant_->database())->Values(filter, 0, 10, Soon());
  ASSERT_TRUE(values.ok()) << values.status();
  ASSERT_FALSE(values->empty());
  for (const HoleValuesRow& value : *values) {
    const Asked asked = Ask(
        *reader,
        "SELECT value, upper_limit, expanded_uncertainty * 1000 AS u_um, verdict FROM read_v1.characteristics "
        "WHERE inspection_id = '" +
            value.inspection_id + "' AND characteristic = '" + value.group_name + "/" + value.hole_name + "/position'");
    ASSERT_EQ(asked.rows.size(), 1u) << asked.refusal;
    const auto row = nlohmann::json::parse(asked.rows[0]);
    EXPECT_EQ(row["value"].get<double>(), value.position_error_mm.value());
    EXPECT_EQ(row["upper_limit"].get<double>(), value.position_tolerance_mm);
    EXPECT_DOUBLE_EQ(row["u_um"].get<double>(), value.position_expanded_uncertainty_um.value());
    EXPECT_EQ(row["verdict"], value.position_verdict);
    // Asked for by its name alone, it is the same.
    ValueFilter of_hole = filter;
    of_hole.group_name = value.group_name;
    of_hole.hole_name = value.hole_name;
    const auto alone = ValuesIn(plant_->database())->Values(of_hole, 0, 10, Soon());
    ASSERT_TRUE(alone.ok()) << alone.status();
    ASSERT_EQ(alone->size(), 1u) << value.group_name << "/" << value.hole_name;
    EXPECT_EQ(alone->front().position_error_mm, value.position_error_mm);
    EXPECT_EQ(alone->front().inclination_verdict, value.inclination_verdict);
    EXPECT_EQ(alone->front().sequence, value.sequence);
  }
  auto transaction = plant_->database()->Begin(Soon());
  for (const char* name :
       {"machines/SEED-4-M002", "parts/SEED-4-P1@1", "scans/SEED-4-00000003-airfoil", "software/0.1.0+seed"}) {
    const auto entries = DerivedFrom(*transaction, name);
    ASSERT_TRUE(entries.ok()) << entries.status();
    std::vector<std::string> names, found;
    for (const JournalEntry& entry : *entries) names.push_back(entry.entry.name + " " + entry.verdict + entry.state);
    const auto rows = transaction->Execute(
        "SELECT name || ' ' || coalesce(verdict, '') || coalesce(state, '') FROM read_v1.recall($1, 0, 100000)",
        Params().Text(name));
    ASSERT_TRUE(rows.ok()) << rows.status();
    for (int row = 0; row < rows->count(); ++row) found.push_back(rows->Text(row, 0));
    EXPECT_FALSE(names.empty()) << name;
    EXPECT_THAT(found, ElementsAreArray(names)) << name;
  }
}

TEST_F(ReadModelsTest, EventsComeInPagesAsTheViewHasThem) {
  for (const char* login : {"bi_open", "bi_cleared"}) {
    const auto reader = As(login);
    std::vector<std::string> paged;
    for (std::string after = "0";;) {
      const Asked page = Ask(*reader, "SELECT * FROM read_v1.events_after(" + after + ", 100)");
      ASSERT_EQ(page.refusal, "");
      if (page.rows.empty()) break;
      ASSERT_LE(page.rows.size(), 100u);
      paged.insert(paged.end(), page.rows.begin(), page.rows.end());
      after = nlohmann::json::parse(page.rows.back())["record_sequence"].dump();
    }
    EXPECT_GT(paged.size(), 300u);
    EXPECT_THAT(paged, ElementsAreArray(Ask(*reader, "SELECT * FROM read_v1.events ORDER BY record_sequence").rows));
  }
}

TEST_F(ReadModelsTest, ALoginThatIsNoneIsRefused) {
  for (const char* login : {"", "Bi", "sixpoint_bi", "pg_bi", "bi-1", "bi; DROP TABLE blades"}) {
    auto transaction = plant_->database()->Begin(Soon());
    const auto made = transaction->Execute("SELECT make_reader($1)", Params().Text(login));
    EXPECT_EQ(made.status().code(), absl::StatusCode::kInvalidArgument) << login;
    EXPECT_THAT(std::string(made.status().message()), HasSubstr("want a lower-case letter")) << login;
  }
}

}  // namespace
}  // namespace sixpoint::storage
