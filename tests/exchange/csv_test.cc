#include "exchange/csv.h"

#include <gmock/gmock.h>

#include "refusal/refusal.h"
#include "sample_part.h"

namespace sixpoint::exchange {
namespace {

using ::testing::HasSubstr;

// What a row has no column for.
InspectedPart ToldByRows(InspectedPart part) {
  for (const auto text :
       {&InspectedPart::sensor_model, &InspectedPart::sensor_serial_number, &InspectedPart::requested_by,
        &InspectedPart::software_version, &InspectedPart::decision_rule, &InspectedPart::registration})
    (part.*text).clear();
  part.machine_revision = 0;
  part.calibrations.clear();
  part.scans.clear();
  for (MeasuredValue& value : part.values) value.worst_negative = value.worst_positive = std::nullopt;
  part.verdict = WorstOf(part.values);
  return part;
}

TEST(Csv, PartsComeBackToTheBit) {
  InspectedPart odd = SamplePart(4, 2);
  odd.serial = "=1+1,\"2\"\r\nnext";
  odd.machine = "'quoted";
  odd.part = "-3\xc3\xbc";
  odd.work_order = "'";
  odd.operation = "@x";
  odd.values[0].value = 1e-300;
  odd.values[0].reason = "+; \"a\"\n";
  const std::vector<InspectedPart> parts = {SamplePart(80), odd, SamplePart(1, 3)};
  std::string file = CsvHead();
  for (const InspectedPart& part : parts) file += ToCsv(part);
  const auto back = FromCsv(file);
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->size(), parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) ExpectSame(ToldByRows(parts[p]), (*back)[p]);
}

TEST(Csv, ARowIsAsItSays) {
  InspectedPart part = SamplePart(1);
  part.characteristics[0].upper = 0.1;
  part.values[0].value = 0.03;
  part.values[0].expanded_uncertainty = 0.01;
  part.serial = "=HYPERLINK(\"x\")";
  EXPECT_EQ(
      ToCsv(part),
      "\"'=HYPERLINK(\"\"x\"\")\",vane,3,mill-1,inspections/0198a3c0-0000-7000-8000-000000000001,2026-11-18T11:06:41Z,"
      "G1/H0/position,position,mm,0,,0.1,0.03,0.01,CONFORM,,4711-A,0020,SIX_POINT\r\n");
  EXPECT_EQ(ToCsv(InspectedPart()), "");
}

TEST(Csv, BrokenFilesAreRefused) {
  const std::string row = ToCsv(SamplePart(1));
  const auto refused = [](const std::string& file) {
    const auto parts = FromCsv(file);
    EXPECT_EQ(parts.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(parts.status().message());
  };
  EXPECT_TRUE(FromCsv(CsvHead())->empty());
  EXPECT_THAT(refused(""), HasSubstr("head"));
  EXPECT_THAT(refused("serial;part\r\n"), HasSubstr("head"));
  EXPECT_THAT(refused(std::string(kMostCsvBytes + 1, 'x')), HasSubstr("bytes"));
  EXPECT_THAT(refused(CsvHead() + row + "a,b\r\n"), HasSubstr("row 2: cells: 2"));
  EXPECT_THAT(refused(CsvHead() + "\"a"), HasSubstr("a quote that ends"));
  EXPECT_THAT(refused(CsvHead() + "\"a\"b"), HasSubstr("after a quote"));
  EXPECT_THAT(refused(CsvHead() + std::string(100000, ',')), HasSubstr("cells: more"));
  const std::string good = CsvHead() + row;
  for (std::size_t size = CsvHead().size() + 1; size + 2 < good.size(); ++size) {
    const auto parts = FromCsv(std::string_view(good).substr(0, size));
    EXPECT_TRUE(parts.ok() || !ViolationsOf(parts.status()).empty());
  }
}

}  // namespace
}  // namespace sixpoint::exchange
