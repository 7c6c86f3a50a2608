// Files of other instruments, value by value: as they say it, or refused by name.
#include "exchange/measured_file.h"

#include <gmock/gmock.h>

#include <random>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "refusal/refusal.h"
#include "sample_part.h"

namespace sixpoint::exchange {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kHead[] = "serial,characteristic,feature,value,unit,expanded_uncertainty,measured_at,zone,reason\r\n";

std::vector<MeasuredRow> Read(MeasuredFormat format, const std::string& file) {
  auto rows = ReadMeasuredFile(format, file);
  EXPECT_TRUE(rows.ok()) << rows.status();
  return rows.ok() ? *std::move(rows) : std::vector<MeasuredRow>();
}
std::string Refused(const std::string& file, MeasuredFormat format = MeasuredFormat::kCsv) {
  const auto rows = ReadMeasuredFile(format, file);
  EXPECT_EQ(rows.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(ViolationsOf(rows.status()).empty());
  return std::string(rows.status().message());
}

TEST(MeasuredCsv, ARowIsAsItSays) {
  const auto rows = Read(MeasuredFormat::kCsv, "\xef\xbb\xbf" + std::string(kHead) +
                                                   "SN-1,1,H1,0.0312,mm,0.004,2026-11-18T11:06:41+01:00,DIAMETER,\r\n"
                                                   "SN-1,25,,,um,,,,\"a burr, wide\"\r\n"
                                                   "SN-2,'=x,\"H1 to H2\",-1.5e-3,mm,,,,\r\n"
                                                   "\r\n"
                                                   "SN-2,5,,,mm,0.1,,,");
  ASSERT_THAT(rows, SizeIs(4));
  EXPECT_EQ(rows[0].at, "row 1");
  EXPECT_EQ(rows[0].serial, "SN-1");
  EXPECT_EQ(rows[0].characteristic, "1");
  EXPECT_EQ(rows[0].feature, "H1");
  EXPECT_EQ(rows[0].value, 0.0312);
  EXPECT_EQ(rows[0].expanded_uncertainty, 0.004);
  EXPECT_EQ(rows[0].unit, "mm");
  EXPECT_EQ(rows[0].zone, "DIAMETER");
  EXPECT_EQ(std::chrono::system_clock::to_time_t(*rows[0].measured_at), 1794996401);
  EXPECT_FALSE(rows[1].value.has_value());
  EXPECT_EQ(rows[1].reason, "a burr, wide");
  EXPECT_FALSE(rows[1].measured_at.has_value());
  EXPECT_EQ(rows[2].characteristic, "=x");
  EXPECT_EQ(rows[2].feature, "H1 to H2");
  EXPECT_EQ(rows[2].value, -1.5e-3);
  EXPECT_FALSE(rows[3].expanded_uncertainty.has_value()) << "of what was not measured nothing is uncertain";
  EXPECT_EQ(rows[3].reason, "the file has no value");
}

TEST(MeasuredCsv, ThreeColumnsInAnyOrderAreEnough) {
  const auto rows = Read(MeasuredFormat::kCsv, "value,unit,characteristic\n3,mm,17\n");
  ASSERT_THAT(rows, SizeIs(1));
  EXPECT_EQ(rows[0].characteristic, "17");
  EXPECT_EQ(rows[0].value, 3);
  EXPECT_EQ(rows[0].serial, "");
}

TEST(MeasuredCsv, WhatIsOddIsRefusedByName) {
  const std::string head = kHead;
  EXPECT_THAT(Refused(""), HasSubstr("file: 0 bytes"));
  EXPECT_THAT(Refused(std::string(kMostMeasuredBytes + 1, 'x')), HasSubstr("want 1 to 4194304"));
  EXPECT_THAT(Refused(head), HasSubstr("file: no value, want at least one"));
  EXPECT_THAT(Refused("serial;characteristic;value\n1;2;3\n"), HasSubstr("want columns parted by commas"));
  EXPECT_THAT(Refused("serial,characteristic,value,unit,operator\n"), HasSubstr("head: operator, want columns named"));
  EXPECT_THAT(Refused("value,value,unit\n"), HasSubstr("head: value, want each column once"));
  EXPECT_THAT(Refused("characteristic,value\n1,2\n"), HasSubstr("want the column unit"));
  EXPECT_THAT(Refused(head + "SN-1,1,H1,0,0312,mm,,,,\n"),
              HasSubstr("row 1: cells: 10, want 9 of them, as the head has"));
  EXPECT_THAT(Refused(head + "SN-1,1,H1,0,0312,mm,,,,\n"), HasSubstr("decimal points, and no commas"));
  EXPECT_THAT(Refused(head + "SN-1,1,H1,\"0,0312\",mm,,,,\n"), HasSubstr("row 1: value: 0,0312, want a finite number"));
  EXPECT_THAT(Refused(head + "SN-1,1,,nan,mm,,,,\n"), HasSubstr("row 1: value: nan, want a finite number"));
  EXPECT_THAT(Refused(head + "SN-1,1,,inf,mm,,,,\n"), HasSubstr("row 1: value: inf"));
  EXPECT_THAT(Refused(head + "SN-1,1,,1e999,mm,,,,\n"), HasSubstr("row 1: value: 1e999"));
  EXPECT_THAT(Refused(head + "SN-1,1,,1,mm,-1,,,\n"), HasSubstr("row 1: expanded_uncertainty: -1, want >= 0"));
  EXPECT_THAT(Refused(head + "SN-1,1,,1,mm,,18.11.2026,,\n"), HasSubstr("row 1: measured_at: 18.11.2026"));
  EXPECT_THAT(Refused(head + "SN-1,1,,1,mm,,,,broken\n"), HasSubstr("row 1: reason: broken, want none beside a value"));
  EXPECT_THAT(Refused(head + "SN-1,,,1,mm,,,,\n"), HasSubstr("row 1: characteristic: empty"));
  EXPECT_THAT(Refused(head + "SN-1,\xff,,1,mm,,,,\n"), HasSubstr("row 1: characteristic"));
  std::string many = "characteristic,value,unit\n";
  for (std::size_t i = 0; i <= kMostMeasuredRows; ++i) many += "1,1,mm\n";
  EXPECT_THAT(Refused(many), HasSubstr("file: more values, want at most 20000"));
}

// Our own exports, each in its format. Positions are distances, and QIF has the whole of a zone.
TEST(MeasuredFile, OurOwnExportsComeBack) {
  InspectedPart part = SamplePart(12);
  part.characteristics[8].lower = -1;  // a profile between limits that are not about the CAD
  const std::string qif = *ToQif(part), aqdef = *ToAqdef({part}), csv = CsvHead() + ToCsv(part);
  const auto from_qif = Read(MeasuredFormat::kQif, qif), from_csv = Read(MeasuredFormat::kCsv, csv);
  const auto from_aqdef = Read(MeasuredFormat::kAqdef, aqdef);
  ASSERT_THAT(from_qif, SizeIs(12));
  ASSERT_THAT(from_csv, SizeIs(12));
  EXPECT_THAT(from_aqdef, SizeIs(9)) << "what was not measured has no value there";
  for (std::size_t i = 0; i < 12; ++i) {
    const Characteristic& c = part.characteristics[i];
    SCOPED_TRACE(c.name);
    EXPECT_EQ(from_csv[i].characteristic, c.name);
    EXPECT_EQ(from_csv[i].serial, "SN-1");
    EXPECT_EQ(from_csv[i].value, part.values[i].value);
    EXPECT_EQ(from_csv[i].unit, c.unit);
    EXPECT_EQ(from_csv[i].measured_at, part.recorded_at);
    EXPECT_EQ(from_csv[i].reason, part.values[i].value ? "" : part.values[i].reason);
    const bool position = c.kind == Characteristic::Kind::kPosition, profile = c.kind == Characteristic::Kind::kProfile;
    const bool whole = (position || profile) && i != 8;
    EXPECT_EQ(from_qif[i].zone, position ? "DIAMETER" : !profile ? "" : i == 8 ? "BORDERS" : "WIDTH");
    EXPECT_EQ(from_csv[i].zone, position ? "RADIUS" : !profile ? "" : i == 8 ? "BORDERS" : "HALF_WIDTH");
    ASSERT_EQ(from_qif[i].value.has_value(), part.values[i].value.has_value());
    if (!from_qif[i].value) continue;
    EXPECT_DOUBLE_EQ(*from_qif[i].value, (whole ? 2 : 1) * *part.values[i].value);
    EXPECT_DOUBLE_EQ(*from_qif[i].expanded_uncertainty, (whole ? 2 : 1) * *part.values[i].expanded_uncertainty);
  }
}

TEST(MeasuredFile, AValueThatItsFileDoesNotCountIsNone) {
  const auto rows = Read(MeasuredFormat::kAqdef,
                         "K0100 1\r\nK1001 vane\r\nK2001/1 17\r\nK2002/1 17\r\nK2142/1 mm\r\n"
                         "K0001/1 3.5\r\nK0002/1 255\r\nK0014/1 SN-1\r\nK0001/1 4\r\nK0014/1 SN-2\r\n");
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_FALSE(rows[0].value.has_value());
  EXPECT_EQ(rows[0].reason, "K0002 255: the value 3.5 does not count");
  EXPECT_EQ(rows[1].value, 4);
  EXPECT_EQ(rows[1].serial, "SN-2");
  EXPECT_FALSE(rows[1].measured_at.has_value());
}

// A characteristic has its own moment in AQDEF: those of one blade are not others' gaps.
TEST(MeasuredFile, MomentsOfABladeAreNoGaps) {
  const auto rows = Read(MeasuredFormat::kAqdef,
                         "K0100 2\r\nK1001 vane\r\nK2001/1 17\r\nK2142/1 mm\r\nK2001/2 18\r\nK2142/2 mm\r\n"
                         "K0001/1 3.5\r\nK0004/1 18.11.2026/11:06:41\r\nK0014/1 SN-1\r\n"
                         "K0001/2 4\r\nK0004/2 18.11.2026/11:06:42\r\nK0014/2 SN-1\r\n");
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[0].characteristic, "17");
  EXPECT_EQ(rows[1].characteristic, "18");
}

TEST(MeasuredFile, AQifFileOfAnotherToolHasItsOwnNumbers) {
  const auto path = SharedStandards() / "qif" / "Results" / "Sheet_Metal" / "SheetMetal_QIF_Results_sample_1.QIF";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no QIF samples under SIXPOINT_SHARED_DIR";
  const std::string file = FileText(path);
  if (file.size() > kMostMeasuredBytes) GTEST_SKIP() << "the sample is larger than an import";
  for (const MeasuredRow& row : Read(MeasuredFormat::kQif, file))
    if (row.characteristic == "W1RXXMRA19P") {
      EXPECT_EQ(row.zone, "DIAMETER");
      EXPECT_EQ(row.value, 1.076016018900693);
      return;
    }
  ADD_FAILURE() << "no W1RXXMRA19P";
}

// Bytes changed, cut and doubled: taken or refused by name, and nothing else.
TEST(MeasuredFile, AThousandMutantsAreTakenOrRefused) {
  const InspectedPart part = SamplePart(6);
  const std::pair<MeasuredFormat, std::string> files[] = {
      {MeasuredFormat::kCsv, std::string(kHead) + "SN-1,1,H1,0.0312,mm,0.004,2026-11-18T11:06:41Z,DIAMETER,\r\n"
                                                  "SN-1,25,,,um,,,,\"a burr, wide\"\r\n"},
      {MeasuredFormat::kCsv, CsvHead() + ToCsv(part)},
      {MeasuredFormat::kAqdef, *ToAqdef({part, SamplePart(6, 2)})},
      {MeasuredFormat::kQif, *ToQif(part)}};
  std::mt19937_64 random(41);
  int taken = 0, refused = 0;
  for (int i = 0; i < 4000; ++i) {
    auto [format, file] = files[i % 4];
    for (int change = 0; change < 1 + i % 3; ++change) {
      const std::size_t at = random() % file.size();
      if (random() % 4 == 0)
        file.erase(at, random() % 40);
      else if (random() % 4 == 0)
        file.insert(at, file.substr(random() % file.size(), random() % 40));
      else
        file[at] = static_cast<char>(random() % 256);
      if (file.empty()) file = "x";
    }
    const auto rows = ReadMeasuredFile(format, file);
    rows.ok() ? ++taken : ++refused;
    if (!rows.ok()) {
      EXPECT_FALSE(ViolationsOf(rows.status()).empty()) << rows.status();
      continue;
    }
    for (const MeasuredRow& row : *rows) {
      EXPECT_EQ(row.value.has_value(), row.reason.empty());
      EXPECT_TRUE(!row.value || std::isfinite(*row.value));
    }
  }
  EXPECT_GT(taken, 100);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace sixpoint::exchange
