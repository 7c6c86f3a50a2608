// What other instruments measured: files by the sample drawing of a vane.
#include <gmock/gmock.h>

#include <filesystem>
#include <random>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "storage/blobs.h"
#include "tests/exchange/sample_part.h"
#include "tests/services/inspection/measurement_service_fixture.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST_F(MeasurementServiceTest, AFileIsAMeasurementABladeInTheDrawingsUnits) {
  const std::string file = kHead + Row("SN-2", "12", "", "30.0125", "mm") + Row("SN-1", "6", "", "1.25", "mm") +
                           Row("SN-1", "Ra", "", "0.0008", "mm") + Row("SN-1", "1", "H2", "0.06", "mm", "DIAMETER") +
                           Row("SN-1", "1", "H1", "25", "\xc2\xb5m", "RADIUS") +
                           Row("SN-1", "9", "", "-0.03", "mm", "BORDERS") + Row("SN-1", "7", "", "2.7", "ratio") +
                           Row("SN-1", "4", "H2", "0.25", "deg") + "SN-1,5,H1,,mm,,,,no probe reached it\n";
  v1::ImportMeasurementsRequest request = Request(file);
  request.mutable_uncertainty()->set_lengths_um(2.5);
  request.mutable_uncertainty()->set_basis("ISO 15530-3, report 17");
  const auto response = Import(request);
  ASSERT_TRUE(response.ok()) << response.status();
  ASSERT_EQ(response->measurements_size(), 2);
  EXPECT_EQ(response->measurements(0).blade(), "blades/SN-2");
  EXPECT_THAT(response->measurements(1).values(), IsEmpty());
  EXPECT_EQ(response->measurements(1).value_count(), 8);
  EXPECT_EQ(response->measurements(1).measured_count(), 7);
  const v1::Measurement read = Get(response->measurements(1).name());
  EXPECT_EQ(read.drawing(), "drawings/vane-70@1");
  EXPECT_EQ(read.part(), "parts/vane");
  EXPECT_EQ(read.file_sha256(), storage::Sha256Hex(file));
  EXPECT_EQ(read.measured_at().seconds(), 1795000001);
  EXPECT_EQ(read.uncertainty().basis(), "ISO 15530-3, report 17");
  EXPECT_FALSE(read.uncertainty().has_angles_deg());
  std::string all;
  for (const v1::MeasuredCharacteristic& one : read.values())
    all += one.characteristic() + "|" + one.feature() + "|" + std::to_string(one.value()) + "|" +
           plant::v1::CharacteristicUnit_Name(one.unit()).substr(20) + "|" +
           (one.zone() == 0 ? "" : plant::v1::ToleranceZone_Name(one.zone()).substr(15)) + "|" +
           (one.has_expanded_uncertainty() ? std::to_string(one.expanded_uncertainty()) : "") + "|" + one.reason() +
           "\n";
  EXPECT_EQ(all,
            "1|H1|25.000000|UM|RADIUS|2.500000|\n"
            "1|H2|30.000000|UM|RADIUS|2.500000|\n"
            "4|H2|0.250000|DEG|||\n"
            "5|H1|0.000000|MM|||no probe reached it\n"
            "6|H1 to H2|1.250000|MM||0.002500|\n"
            "7|H1 to H2|2.700000|RATIO|||\n"
            "9||-0.030000|MM|BORDERS|0.002500|\n"
            "25||0.800000|UM||2.500000|\n");
  EXPECT_FALSE(read.values(3).has_value());
  // As the journal has it.
  auto transaction = database_.database()->Begin(testing::Soon());
  const auto entry = storage::FindEntry(*transaction, read.name());
  ASSERT_TRUE(entry.ok() && entry->has_value());
  EXPECT_EQ((*entry)->entry.kind, "measurement");
  EXPECT_EQ((*entry)->entry.blade, "SN-1");
  EXPECT_THAT((*entry)->entry.inputs, ::testing::ElementsAre("blades/SN-1", "drawings/vane-70@1"));
  EXPECT_EQ((*entry)->recorded.sequence, read.record_sequence());
}

// The names of our own exports, and a slash where a format has no feature.
TEST_F(MeasurementServiceTest, QifAndAqdefSayTheSameAsCsv) {
  exchange::InspectedPart part = exchange::SamplePart(2);
  part.serial = "SN-1";
  using Kind = exchange::Characteristic::Kind;
  part.characteristics = {{"G1/H1/position", Kind::kPosition, "mm", 0, {}, 0.03},
                          {"4/H2", Kind::kInclination, "deg", 0, {}, 0.5},
                          {"9", Kind::kProfile, "mm", 0, -0.05, 0.05}};
  part.values.assign(3, {});
  const double values[] = {0.0125, 0.25, 0.04};
  for (std::size_t i = 0; i < 3; ++i) {
    part.values[i].value = values[i];
    part.values[i].expanded_uncertainty = 0.002;
    part.values[i].verdict = exchange::Verdict::kConform;
  }
  const std::pair<v1::MeasurementFormat, std::string> files[] = {
      {v1::MEASUREMENT_FORMAT_QIF, *exchange::ToQif(part)},
      {v1::MEASUREMENT_FORMAT_AQDEF, *exchange::ToAqdef({part})},
      {v1::MEASUREMENT_FORMAT_CSV, exchange::CsvHead() + exchange::ToCsv(part)}};
  for (const auto& [format, file] : files) {
    SCOPED_TRACE(v1::MeasurementFormat_Name(format));
    const v1::Measurement read = Imported(Request(file, format));
    EXPECT_EQ(read.format(), format);
    ASSERT_EQ(read.values_size(), 3);
    EXPECT_EQ(read.values(0).characteristic(), "1");
    EXPECT_EQ(read.values(0).feature(), "H1");
    EXPECT_EQ(read.values(0).zone(), plant::v1::TOLERANCE_ZONE_RADIUS);
    EXPECT_NEAR(read.values(0).value(), 12.5, 1e-12);
    EXPECT_NEAR(read.values(0).expanded_uncertainty(), 2, 1e-12);
    EXPECT_EQ(read.values(1).characteristic(), "4");
    EXPECT_EQ(read.values(1).value(), 0.25);
    EXPECT_EQ(read.values(2).zone(), plant::v1::TOLERANCE_ZONE_HALF_WIDTH);
    EXPECT_EQ(read.values(2).value(), 0.04);
  }
}

// A document of another tool, of a characteristic that is measured elsewhere alone: its own number, neither halved nor doubled.
TEST_F(MeasurementServiceTest, AQifFileOfAnotherToolIsReadByName) {
  const auto path =
      exchange::SharedStandards() / "qif" / "Results" / "Sheet_Metal" / "SheetMetal_QIF_Results_sample_1.QIF";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no QIF samples under SIXPOINT_SHARED_DIR";
  plant::v1::CreateDrawingRequest drawing = plant::SampleDrawing();
  plant::v1::Characteristic& one = *plant::Of(&drawing, plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE);
  one.set_name("W1RXXMRA19P");
  one.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
  Draw(drawing);
  v1::ImportMeasurementsRequest request = Request(exchange::FileText(path), v1::MEASUREMENT_FORMAT_QIF);
  request.mutable_measured_at()->set_seconds(1795000001);
  const auto refused = Import(request);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  request.set_only_drawn(true);
  const auto parsed = exchange::FromQif(request.content());
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  auto transaction = database_.database()->Begin(testing::Soon());
  storage::RecordEntry entry;
  entry.software_version = "test";
  if (parsed->serial.empty())
    request.set_blade("blades/SN-1");
  else
    ASSERT_TRUE(storage::InsertBlade(*transaction, {parsed->serial, "vane", {}}, entry).ok()) << parsed->serial;
  ASSERT_TRUE(transaction->Commit().ok());
  const v1::Measurement read = Imported(request);
  ASSERT_EQ(read.values_size(), 1);
  EXPECT_EQ(read.drawing(), "drawings/vane-70@2");
  EXPECT_EQ(read.values(0).value(), 1.076016018900693);
  EXPECT_EQ(read.values(0).zone(), plant::v1::TOLERANCE_ZONE_UNSPECIFIED);
  EXPECT_GT(read.left_out_count(), 10);
  EXPECT_THAT(read.left_out(), SizeIs(std::min(200, read.left_out_count())));
}

TEST_F(MeasurementServiceTest, ARetryRecordsNothingAnewAndAFileIsAllOrNothing) {
  v1::ImportMeasurementsRequest request =
      Request(kHead + Row("SN-1", "12", "", "3", "mm") + Row("SN-2", "12", "", "3", "mm"));
  request.set_request_id(kSomeUuid);
  const auto first = Import(request), again = Import(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), first->SerializeAsString());
  EXPECT_EQ(first->measurements_size(), 2);
  EXPECT_EQ(Count("measurements"), 2);
  request.set_content(kHead + Row("SN-1", "12", "", "4", "mm"));
  EXPECT_EQ(Import(request).status().code(), absl::StatusCode::kAlreadyExists);
  request.set_request_id("");
  request.set_content(kHead + Row("SN-1", "12", "", "3", "mm") + Row("SN-9", "12", "", "3", "mm"));
  EXPECT_FALSE(Import(request).ok());
  EXPECT_EQ(Count("measurements"), 2);
  EXPECT_EQ(Count("record_entries WHERE kind = 'measurement'"), 2);
}

TEST_F(MeasurementServiceTest, ListsByWhatIsAskedFor) {
  v1::ImportMeasurementsRequest request = Request(kHead + Row("SN-1", "12", "", "3", "mm"));
  ASSERT_TRUE(Import(request).ok());
  request.mutable_instrument()->set_serial_number("9");
  request.set_content(kHead + Row("SN-2", "12", "", "3", "mm"));
  ASSERT_TRUE(Import(request).ok());
  using L = v1::ListMeasurementsRequest;
  const auto listed = [this](const std::function<void(L*)>& ask) {
    L filter;
    ask(&filter);
    return List(filter);
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(listed([](L*) {}), ElementsAre("blades/SN-2", "blades/SN-1"));
  EXPECT_THAT(listed([](L* l) { l->set_view(list::v1::VIEW_FULL); }), SizeIs(2));
  EXPECT_THAT(listed([](L* l) { l->set_page_size(1); }), ElementsAre("blades/SN-2"));
  EXPECT_THAT(listed([](L* l) { l->set_blade("blades/SN-1"); }), ElementsAre("blades/SN-1"));
  EXPECT_THAT(listed([](L* l) { l->set_part("parts/vane"); }), SizeIs(2));
  EXPECT_THAT(listed([](L* l) { l->set_part("parts/other"); }), IsEmpty());
  EXPECT_THAT(listed([](L* l) { l->set_drawing("drawings/vane-70"); }), SizeIs(2));
  EXPECT_THAT(listed([](L* l) { l->set_instrument_serial_number("9"); }), ElementsAre("blades/SN-2"));
  EXPECT_THAT(listed([&](L* l) { l->set_file_sha256(storage::Sha256Hex(request.content())); }),
              ElementsAre("blades/SN-2"));
  EXPECT_THAT(listed([](L* l) { l->mutable_recorded()->mutable_until()->set_seconds(1'000'000'000); }), IsEmpty());
  v1::ListMeasurementsRequest odd;
  odd.set_file_sha256("abc");
  v1::ListMeasurementsResponse response;
  EXPECT_EQ(stub_->ListMeasurements(runtime::ContextFor(10).get(), odd, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  v1::GetMeasurementRequest get;
  get.set_name(std::string("measurements/") + kSomeUuid);
  v1::Measurement none;
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(stub_->GetMeasurement(runtime::ContextFor(10).get(), get, &none))),
            "MEASUREMENT_NOT_FOUND");
}

TEST_F(MeasurementServiceTest, OursStandBesideTheirs) {
  v1::ImportMeasurementsRequest request =
      Request(kHead + Row("SN-1", "12", "", "30.01", "mm") + Row("SN-2", "12", "", "30.02", "mm") +
              Row("SN-2", "25", "", "1", "um"));
  request.mutable_uncertainty()->set_lengths_um(2);
  request.mutable_uncertainty()->set_basis("report 17");
  ASSERT_TRUE(Import(request).ok());
  ours_->values = {{"SN-1", "12", "", "MM", 30.04, 0.003},
                   {"SN-2", "12", "", "MM", 30.05, 0.003},
                   {"SN-9", "12", "", "MM", 31, 0.003}};
  v1::CompareMeasurementsRequest asked;
  asked.set_drawing("drawings/vane-70");
  const auto compare = [&] {
    v1::CompareMeasurementsResponse response;
    const grpc::Status status = stub_->CompareMeasurements(runtime::ContextFor(10).get(), asked, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  const v1::CompareMeasurementsResponse compared = compare();
  EXPECT_EQ(compared.drawing(), "drawings/vane-70@1");
  EXPECT_EQ(compared.measurement_count(), 2);
  EXPECT_FALSE(compared.truncated());
  ASSERT_EQ(compared.biases_size(), 1);
  const v1::InstrumentBias& bias = compared.biases(0);
  EXPECT_EQ(bias.characteristic(), "12");
  EXPECT_EQ(bias.name(), "the SECTION_CHORD");
  EXPECT_NEAR(bias.bias(), 0.03, 1e-12);
  // The differences are the same but for rounding: what both state is all.
  EXPECT_NEAR(bias.expanded_uncertainty(), std::sqrt(4e-6 + 9e-6), 1e-9);
  EXPECT_EQ(bias.verdict(), v1::BIAS_VERDICT_SIGNIFICANT);
  ASSERT_EQ(bias.pairs_size(), 2);
  EXPECT_EQ(bias.pairs(0).blade(), "blades/SN-2") << "the newest first";
  EXPECT_EQ(bias.pairs(0).theirs_expanded_uncertainty(), 0.002);
  asked.set_instrument_serial_number("another");
  EXPECT_EQ(compare().biases_size(), 0);
}

// Whatever bytes come: recorded whole, or refused as what they are.
TEST_F(MeasurementServiceTest, AThousandMutantsAreRecordedOrRefused) {
  const std::string file = kHead + Row("SN-1", "12", "", "3", "mm") + Row("SN-1", "1", "H1", "0.06", "mm", "DIAMETER") +
                           Row("SN-2", "6", "H1 to H2", "1.2", "mm");
  exchange::InspectedPart part = exchange::SamplePart(1);
  part.serial = "SN-1";
  part.characteristics[0].name = "G1/H1/position";
  part.values[0].value = 0.01;
  part.values[0].verdict = exchange::Verdict::kConform;
  part.values[0].reason = "";
  const std::string qif = *exchange::ToQif(part);
  std::mt19937_64 random(7);
  int recorded = 0, refused = 0;
  for (int i = 0; i < 1000; ++i) {
    const bool is_qif = i % 4 == 3;
    std::string mutant = is_qif ? qif : file;
    for (int change = 0; change < 1 + i % 3; ++change)
      mutant[(is_qif ? 0 : sizeof kHead - 1) + random() % (mutant.size() - (is_qif ? 0 : sizeof kHead - 1))] =
          static_cast<char>(random() % 256);
    const auto response = Import(Request(mutant, is_qif ? v1::MEASUREMENT_FORMAT_QIF : v1::MEASUREMENT_FORMAT_CSV));
    response.ok() ? ++recorded : ++refused;
    EXPECT_TRUE(response.ok() || absl::IsInvalidArgument(response.status())) << response.status();
  }
  EXPECT_GT(recorded, 20);
  EXPECT_GT(refused, 100);
  EXPECT_EQ(Count("measurements"), Count("record_entries WHERE kind = 'measurement'"));
}

}  // namespace
}  // namespace sixpoint::inspection
