#include "tests/end_to_end/demo_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::testing {
namespace {

using nlohmann::json;

storage::Rows Query(ThrowawayDatabase& database, const std::string& sql, const storage::Params& params = {}) {
  auto transaction = database.database()->Begin(Soon());
  if (!transaction.ok()) {
    ADD_FAILURE() << transaction.status();
    return {};
  }
  auto rows = transaction->Execute(sql, params);
  if (!rows.ok()) {
    ADD_FAILURE() << sql << ": " << rows.status();
    return {};
  }
  return *rows;
}

std::vector<std::string> Column(const storage::Rows& rows) {
  std::vector<std::string> values;
  for (int i = 0; i < rows.count(); ++i) values.push_back(rows.Text(i, 0));
  return values;
}

// The journal's entry of a result, and the names of its inputs.
std::vector<std::string> ExpectEntry(ThrowawayDatabase& database, const std::string& name, bool has_method) {
  const storage::Rows entry = Query(
      database,
      "SELECT e.method, e.software_version FROM record_entries e JOIN record_names USING (record_id) WHERE name = $1",
      storage::Params().Text(name));
  EXPECT_EQ(entry.count(), 1) << name;
  if (entry.count() != 1) return {};
  if (has_method) {
    EXPECT_NE(entry.Text(0, 0), "") << name;
  }
  EXPECT_NE(entry.Text(0, 1), "") << name;
  return Column(Query(database,
                      "SELECT m.name FROM record_inputs i JOIN record_names n USING (record_id) "
                      "JOIN record_names m ON m.record_id = i.input_id WHERE n.name = $1 ORDER BY i.position_index",
                      storage::Params().Text(name)));
}

std::string IdOf(const std::string& name) { return name.substr(name.find('/') + 1); }

}  // namespace

void ExpectRecorded(ThrowawayDatabase& database, const json& machine) {
  using ::testing::Contains;
  using ::testing::IsEmpty;
  using ::testing::Not;
  using ::testing::UnorderedElementsAreArray;
  const std::string serial = IdOf(machine["blade"]), machine_id = IdOf(machine["machine"]);

  // Scans: those acknowledged, no other, whole.
  std::vector<std::string> acknowledged;
  for (const auto& scan : machine["scans"]) acknowledged.push_back(IdOf(scan));
  ASSERT_THAT(acknowledged, Not(IsEmpty()));
  EXPECT_THAT(
      Column(Query(database, "SELECT scan_id FROM scans WHERE machine_id = $1", storage::Params().Text(machine_id))),
      UnorderedElementsAreArray(acknowledged));
  EXPECT_THAT(
      Column(Query(database,
                   "SELECT s.scan_id FROM scans s WHERE s.point_count <> "
                   "(SELECT coalesce(sum(b.point_count), 0) FROM scan_blocks b WHERE b.scan_key = s.scan_key) OR "
                   "s.block_count <> (SELECT count(*) FROM scan_blocks b WHERE b.scan_key = s.scan_key)")),
      IsEmpty());
  for (const std::string& scan : acknowledged) ExpectEntry(database, "scans/" + scan, false);

  // Results: each once, standing on what the machine was told.
  const auto count = [&](const std::string& sql, const std::string& value) {
    return Query(database, sql, storage::Params().Text(value)).Int(0, 0);
  };
  EXPECT_EQ(count("SELECT count(*) FROM calibrations WHERE machine_id = $1", machine_id), 2);
  // Best fit and six-point of the machine's own, and at most the inspection's (each once, not once an attempt).
  EXPECT_EQ(count("SELECT count(*) FROM corrections WHERE blade_serial = $1", serial), 1);
  EXPECT_EQ(count("SELECT count(*) FROM inspections WHERE blade_serial = $1", serial), 1);
  EXPECT_EQ(count("SELECT count(*) FROM registrations r WHERE r.blade_serial = $1 AND (SELECT count(*) FROM "
                  "registration_scans s JOIN scans USING (scan_key) WHERE s.registration_id = r.registration_id AND "
                  "scans.kind = 'airfoil') > 0",
                  serial),
            2);

  const auto inputs_of = [&](const char* key) { return ExpectEntry(database, machine[key], true); };
  const std::string sensor = machine["sensor_calibration"], rotation = machine["rotation_calibration"];
  EXPECT_THAT(inputs_of("sensor_calibration"), Contains(machine["scans"][0].get<std::string>()));
  ExpectEntry(database, rotation, true);
  for (const char* key : {"best_fit_registration", "six_point_registration"}) {
    const std::vector<std::string> inputs = inputs_of(key);
    EXPECT_THAT(inputs, Contains(sensor));
    EXPECT_THAT(inputs, Contains(rotation));
    EXPECT_THAT(inputs, Contains(machine["scans"][2].get<std::string>()));
  }
  EXPECT_THAT(inputs_of("correction"), Contains(machine["six_point_registration"].get<std::string>()));
  EXPECT_THAT(inputs_of("inspection"), Contains(machine["scans"].back().get<std::string>()));
  const storage::Rows fit = Query(
      database,
      "SELECT method, sensor_calibration_id, rotation_calibration_id FROM registrations WHERE registration_id = $1",
      storage::Params().Text(IdOf(machine["six_point_registration"])));
  ASSERT_EQ(fit.count(), 1);
  EXPECT_EQ(fit.Text(0, 1), IdOf(sensor));
  EXPECT_EQ(fit.Text(0, 2), IdOf(rotation));

  // A journal that orders everything: no name twice, no entry before one of its inputs.
  EXPECT_EQ(Query(database,
                  "SELECT count(*) FROM record_inputs i JOIN record_names n ON n.record_id = i.record_id "
                  "JOIN record_names m ON m.record_id = i.input_id WHERE m.record_sequence >= n.record_sequence")
                .Int(0, 0),
            0);
}

}  // namespace sixpoint::testing
