// What keeps other instruments' measurements, PostgreSQL's and the fake that handlers are tested on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "storage/measurements.h"
#include "tests/support/customers_parts.h"
#include "tests/support/fake_measurements.h"
#include "tests/support/rows_of_m1.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using MeasurementReader = ResultReader<MeasurementRow, MeasurementFilter>;
using ImportWriter = ResultWriter<MeasurementImport>;

class MeasurementStoreTest : public ::testing::Test {
 protected:
  // Both of one part, by its drawing.
  MeasurementRow New(const std::string& instrument = "4711") const {
    MeasurementRow row = sixpoint::testing::SampleMeasurement();
    row.measurement_id = NewUuid();
    row.blade_serial = sixpoint::testing::IdOf(part_.blade);
    row.file.drawing_id = sixpoint::testing::IdOf(part_.drawing);
    row.file.part_id = sixpoint::testing::IdOf(part_.part);
    row.file.instrument.serial_number = instrument;
    return row;
  }
  static absl::StatusOr<MeasurementImport> Record(ImportWriter& writer, const std::vector<MeasurementRow>& rows,
                                                  const std::string& request_id = "",
                                                  const std::string& bytes = "request") {
    MeasurementImport import;
    import.requested_by = "users/jane";
    import.measurements = rows;
    RecordEntry entry;
    entry.kind = "measurement";
    entry.software_version = "test";
    entry.requested_by = import.requested_by;
    entry.reader = Reader::Everything();
    return writer.Record({"inspection.ImportMeasurements", request_id, bytes}, import, entry,
                         sixpoint::testing::Soon());
  }
  static std::vector<std::string> Ids(const MeasurementReader& reader, const MeasurementFilter& filter,
                                      std::int64_t before = 0, int limit = 10) {
    const auto rows = reader.List(filter, before, limit, sixpoint::testing::Soon());
    EXPECT_TRUE(rows.ok()) << rows.status();
    std::vector<std::string> ids;
    if (rows.ok())
      for (const MeasurementRow& row : *rows) ids.push_back(row.measurement_id);
    return ids;
  }
  // Each test runs on both.
  void OnBoth(const std::function<void(const MeasurementReader&, ImportWriter&)>& test) {
    sixpoint::testing::ThrowawayDatabase database;
    part_ = sixpoint::testing::PutCustomersPart(database.database(), "open", false,
                                                sixpoint::testing::PutCalibratedMachine(database.database()));
    sixpoint::testing::PutDrawing(database.database(), &part_);
    {
      SCOPED_TRACE("the fake");
      sixpoint::testing::FakeMeasurements fake;
      test(fake, fake);
    }
    SCOPED_TRACE("PostgreSQL");
    test(*MeasurementsIn(database.database()), *MeasurementImportsIn(database.database()));
  }

 private:
  sixpoint::testing::CustomersPart part_;
};

TEST_F(MeasurementStoreTest, AFilesMeasurementsAreFoundEachByItself) {
  OnBoth([this](const MeasurementReader& reader, ImportWriter& writer) {
    const std::vector<MeasurementRow> rows = {New(), New("9")};
    const auto import = Record(writer, rows);
    ASSERT_TRUE(import.ok()) << import.status();
    ASSERT_THAT(import->measurements, SizeIs(2));
    EXPECT_EQ(import->recorded.sequence, import->measurements[0].recorded.sequence);
    EXPECT_LT(import->measurements[0].recorded.sequence, import->measurements[1].recorded.sequence);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto found = reader.Find(rows[i].measurement_id, sixpoint::testing::Soon());
      ASSERT_TRUE(found.ok() && found->has_value()) << found.status();
      EXPECT_EQ((*found)->recorded.sequence, import->measurements[i].recorded.sequence);
      EXPECT_EQ((*found)->file.requested_by, "users/jane");
      EXPECT_EQ((*found)->file.instrument.serial_number, rows[i].file.instrument.serial_number);
      EXPECT_EQ((*found)->measured_at, rows[i].measured_at);
      ASSERT_THAT((*found)->values, SizeIs(1));
      EXPECT_EQ((*found)->values[0].value, 30.02);
      EXPECT_THAT((*found)->left_out, ElementsAre("roughness"));
    }
    for (const std::string& id : {NewUuid(), std::string("no-uuid")})
      EXPECT_FALSE(reader.Find(id, sixpoint::testing::Soon())->has_value()) << id;
  });
}

TEST_F(MeasurementStoreTest, TheSameRequestIsRecordedOnce) {
  OnBoth([this](const MeasurementReader& reader, ImportWriter& writer) {
    const std::vector<MeasurementRow> rows = {New(), New("9")};
    ASSERT_TRUE(Record(writer, rows, sixpoint::testing::kSomeUuid).ok());
    const auto kept = writer.FindRecorded({"inspection.ImportMeasurements", sixpoint::testing::kSomeUuid, "request"},
                                          sixpoint::testing::Soon());
    ASSERT_TRUE(kept.ok() && kept->has_value()) << kept.status();
    const auto again = Record(writer, {New()}, sixpoint::testing::kSomeUuid);
    ASSERT_TRUE(again.ok()) << again.status();
    for (const MeasurementImport& import : {**kept, *again}) {
      EXPECT_EQ(import.requested_by, "users/jane");
      ASSERT_THAT(import.measurements, SizeIs(2));
      EXPECT_EQ(import.measurements[0].measurement_id, rows[0].measurement_id);
      EXPECT_EQ(import.measurements[1].measurement_id, rows[1].measurement_id);
      EXPECT_THAT(import.measurements[0].values, SizeIs(1));  // how many there are is told with it
    }
    EXPECT_EQ(Record(writer, {New()}, sixpoint::testing::kSomeUuid, "another").status().code(),
              absl::StatusCode::kAlreadyExists);
    EXPECT_THAT(Ids(reader, {}), SizeIs(2));
  });
}

TEST_F(MeasurementStoreTest, ListsNewestFirstAndByWhatIsAskedFor) {
  OnBoth([this](const MeasurementReader& reader, ImportWriter& writer) {
    const std::vector<MeasurementRow> rows = {New(), New("9")};
    const auto import = Record(writer, rows);
    ASSERT_TRUE(import.ok()) << import.status();
    const std::string &first = rows[0].measurement_id, &second = rows[1].measurement_id;
    EXPECT_THAT(Ids(reader, {}), ElementsAre(second, first));
    EXPECT_THAT(Ids(reader, {}, 0, 1), ElementsAre(second));
    EXPECT_THAT(Ids(reader, {}, import->measurements[1].recorded.sequence), ElementsAre(first));
    const auto by = [&](std::string MeasurementFilter::*member, const std::string& word) {
      MeasurementFilter filter;
      filter.*member = word;
      return Ids(reader, filter);
    };
    using F = MeasurementFilter;
    for (const auto& [member, is] :
         {std::pair(&F::blade_serial, rows[0].blade_serial), std::pair(&F::part_id, rows[0].file.part_id),
          std::pair(&F::drawing_id, rows[0].file.drawing_id), std::pair(&F::file_sha256, rows[0].file.sha256)}) {
      EXPECT_THAT(by(member, is), SizeIs(2)) << is;
      EXPECT_THAT(by(member, std::string(64, 'e')), IsEmpty()) << is;
    }
    EXPECT_THAT(by(&F::instrument_serial_number, "9"), ElementsAre(second));
    MeasurementFilter span;
    span.recorded.until = import->recorded.recorded_at;
    EXPECT_THAT(Ids(reader, span), IsEmpty());
    MeasurementFilter without;
    without.with_values = false;
    const auto slim = reader.List(without, 0, 1, sixpoint::testing::Soon());
    ASSERT_TRUE(slim.ok()) << slim.status();
    EXPECT_THAT(slim->front().values, IsEmpty());
    EXPECT_EQ(slim->front().value_count, 1);
    EXPECT_EQ(slim->front().measured_count, 1);
    EXPECT_EQ(slim->front().left_out_count, 1);
  });
}

}  // namespace
}  // namespace sixpoint::storage
