#include "exchange/aqdef.h"

#include <gmock/gmock.h>

#include <functional>
#include <iostream>
#include <sstream>

#include "refusal/refusal.h"
#include "sample_part.h"

namespace sixpoint::exchange {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// What a .dfq has no field for.
InspectedPart ToldByDfq(InspectedPart part) {
  for (const auto text : {&InspectedPart::result, &InspectedPart::sensor_model, &InspectedPart::sensor_serial_number,
                          &InspectedPart::software_version, &InspectedPart::decision_rule, &InspectedPart::method,
                          &InspectedPart::registration})
    (part.*text).clear();
  part.machine_revision = 0;
  part.calibrations.clear();
  part.scans.clear();
  for (MeasuredValue& value : part.values)
    if (!value.value) value.reason.clear();
  part.verdict = WorstOf(part.values);
  return part;
}

std::vector<InspectedPart> Parts(int count, int characteristics) {
  std::vector<InspectedPart> parts;
  for (int p = 0; p < count; ++p) parts.push_back(SamplePart(characteristics, p + 1));
  return parts;
}

TEST(Aqdef, PartsComeBackToTheBit) {
  std::vector<InspectedPart> parts = Parts(20, 13);
  parts[3].values[1].reason = "positions differ; U=1 mm; reason=2";
  parts[4].work_order.clear();
  // Not measured here, and there alone.
  parts[5].values[0] = MeasuredValue();
  parts[6].values[3].value = 0.5;
  parts[6].values[3].verdict = Verdict::kNotConform;
  const auto file = ToAqdef(parts);
  ASSERT_TRUE(file.ok()) << file.status();
  const auto back = FromAqdef(*file);
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->size(), parts.size());
  for (const InspectedPart& part : parts) {
    SCOPED_TRACE(part.serial);
    const auto found = std::find_if(back->begin(), back->end(), [&](const auto& b) { return b.serial == part.serial; });
    ASSERT_NE(found, back->end());
    ExpectSame(ToldByDfq(part), *found);
  }
}

TEST(Aqdef, AFileIsAsTheFormatHasIt) {
  InspectedPart part = SamplePart(4);
  part.values[2].value = 0.08;
  part.values[2].expanded_uncertainty = 0.025;
  part.values[2].worst_negative = -0.08;
  part.values[2].worst_positive = 0.01;
  part.values[2].reason = "too few points";
  const std::string file = *ToAqdef({part});
  std::istringstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(line.back(), '\r') << line;
    EXPECT_EQ(line.front(), 'K') << line;
  }
  for (const char* line :
       {"K0100 4\r\n", "K1001/1 vane\r\n", "K1004/1 3\r\n", "K1082/1 mill-1\r\n", "K2001/3 3\r\n", "K2002/3 12.2\r\n",
        "K2101/3 0\r\n", "K2110/3 -0.10200000000000001\r\n", "K2111/3 0.10200000000000001\r\n", "K2120/3 1\r\n",
        "K2121/3 1\r\n", "K2142/2 deg\r\n", "K2142/3 mm\r\n", "K0001/3 0.08\r\n", "K0004/3 18.11.2026/11:06:41\r\n",
        "K0014/3 SN-1\r\n", "K0053/3 4711-A\r\n",
        "K0009/3 UNDECIDABLE; U=0.025 mm; least=-0.08 mm; greatest=0.01 mm; reason=too few points\r\n"})
    EXPECT_THAT(file, HasSubstr(line));
  // The position has no lower limit; the fourth was not measured.
  EXPECT_THAT(file, Not(HasSubstr("K2110/1 ")));
  EXPECT_THAT(file, Not(HasSubstr("K2120/1 ")));
  EXPECT_THAT(file, Not(HasSubstr("K0001/4 ")));
  EXPECT_THAT(file, HasSubstr("K2001/4 "));
}

TEST(Aqdef, EachMachineIsABlock) {
  std::vector<InspectedPart> parts = Parts(6, 3);
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p].machine = p % 2 ? "mill-1" : "mill-2";
  const auto file = ToAqdef(parts);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(*file, HasSubstr("K0100 6\r\n"));
  const auto back = FromAqdef(*file);
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->size(), parts.size());
  for (int i = 0; i < 6; ++i) ExpectSame(ToldByDfq(parts[i < 3 ? 2 * i : 2 * (i - 3) + 1]), (*back)[i]);
}

TEST(Aqdef, NothingIsCutAndNothingIsMixed) {
  const auto refused = [](const std::function<void(std::vector<InspectedPart>*)>& change) {
    std::vector<InspectedPart> parts = Parts(3, 3);
    change(&parts);
    const auto file = ToAqdef(parts);
    EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(file.status().message());
  };
  using Parts = std::vector<InspectedPart>*;
  EXPECT_THAT(refused([](Parts p) { p->clear(); }), HasSubstr("parts: empty"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].part_revision = 4; }), HasSubstr("parts[1].part: vane revision 4"));
  EXPECT_THAT(refused([](Parts p) { (*p)[2].characteristics[1].upper = 7; }), HasSubstr("parts[2].characteristics"));
  EXPECT_THAT(refused([](Parts p) { (*p)[2] = (*p)[1]; }), HasSubstr("once a second"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].serial = std::string(41, 'x'); }), HasSubstr("K0014: xxx"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].serial = std::string(41, 'x'); }), HasSubstr("at most 40"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].work_order = std::string(21, 'x'); }), HasSubstr("K0053: xxx"));
  EXPECT_THAT(refused([](Parts p) { (*p)[0].machine = std::string(41, 'x'); }), HasSubstr("K1082: xxx"));
  EXPECT_THAT(refused([](Parts p) { (*p)[0].values[0].reason = std::string(255, 'x'); }), HasSubstr("K0009"));
  EXPECT_THAT(refused([](Parts p) {
                for (auto& part : *p) part.characteristics[0].name = std::string(81, 'x');
              }),
              HasSubstr("K2002"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].serial = "SN-\xc3\xbc"; }), HasSubstr("ASCII"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].serial = "SN\nK0001/1 7"; }), HasSubstr("on one line"));
  EXPECT_THAT(refused([](Parts p) { (*p)[1].values.pop_back(); }), HasSubstr("parts[1].values"));
}

TEST(Aqdef, BrokenAndHostileFilesAreRefused) {
  const auto refused = [](const std::string& file) {
    const auto parts = FromAqdef(file);
    EXPECT_EQ(parts.status().code(), absl::StatusCode::kInvalidArgument) << file.substr(0, 100);
    return std::string(parts.status().message());
  };
  EXPECT_THAT(refused(""), HasSubstr("K0100"));
  EXPECT_THAT(refused(std::string(kMostAqdefBytes + 1, '\n')), HasSubstr("bytes"));
  EXPECT_THAT(refused("K0100 4000000000\r\n"), HasSubstr("K0100: 4000000000"));
  EXPECT_THAT(refused("K0100 2000000000\r\nK1001/1 p\r\nK2001/1 c\r\n"), HasSubstr("K0100: 2000000000, want 1"));
  EXPECT_THAT(refused("K0100 1\r\nK2001/1 c\r\n"), HasSubstr("line 2: K2001"));
  EXPECT_THAT(refused("K0100 1\r\nK1001/1 p\r\nK0001/1 7\r\n"), HasSubstr("line 3: K0001"));
  EXPECT_THAT(refused("K0100 1\r\nK1001/0 p\r\n"), HasSubstr("an index"));
  EXPECT_THAT(refused("K0100 1\r\nK1001/1 p\r\nK1001/1 q\r\n"), HasSubstr("once for each part"));
  EXPECT_THAT(refused("K0100 1\r\nK1001/1 p\r\nK2001/1 c\r\nK0001/1 seven\r\n"), HasSubstr("K0001: seven"));
  EXPECT_THAT(refused("K0100 1\r\nK1001/1 p\r\nK2001/1 c\r\nK0001/1 7\r\nK0004/1 2026\r\n"), HasSubstr("K0004: 2026"));
  EXPECT_THAT(refused("K0100 1\r\nK1001/1 \x01\r\n"), HasSubstr("control"));
  EXPECT_THAT(refused("Kaboom\r\n"), HasSubstr("line 1"));
  EXPECT_THAT(refused("PK\x03\x04"), HasSubstr("line 1"));
  // Few bytes that would be many parts of many characteristics.
  std::string wide = "K0100 5000\r\nK1001/1 p\r\n";
  for (int i = 1; i <= 5000; ++i) wide += "K2001/" + std::to_string(i) + " c\r\n";
  for (int i = 0; i < 5000; ++i) wide += "K0001/1 1\r\nK0014/1 " + std::to_string(i) + "\r\n";
  EXPECT_THAT(refused(wide), HasSubstr("values: more"));
}

TEST(Aqdef, AnyBytesAreReadOrRefused) {
  const std::string good = *ToAqdef(Parts(2, 3));
  std::mt19937 random(1);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string changed = good;
    changed[at] = static_cast<char>(random());
    const auto part = FromAqdef(changed), cut = FromAqdef(std::string_view(good).substr(0, at));
    EXPECT_TRUE(part.ok() || !ViolationsOf(part.status()).empty());
    EXPECT_TRUE(cut.ok() || !ViolationsOf(cut.status()).empty());
  }
}

TEST(Aqdef, TheCompactFormIsRead) {
  const auto parts = FromAqdef(
      "K0100 2\r\nK1001/1 p\r\nK2001/1 a\r\nK2001/2 b\r\n"
      "1.5\x14"
      "0\x14"
      "01.01.2013/15:18:31\x14\x14\x14\x14"
      "7\x14"
      "9\x0f"
      "2.5\x14"
      "255\x14"
      "01.01.2013/15:18:31\r\n");
  ASSERT_TRUE(parts.ok()) << parts.status();
  ASSERT_EQ(parts->size(), 1u);
  EXPECT_EQ((*parts)[0].values[0].value, 1.5);
  EXPECT_EQ((*parts)[0].values[1].value, 2.5);
  EXPECT_EQ((*parts)[0].values[1].reason, "K0002 255");
  EXPECT_EQ((*parts)[0].machine, "9");
  EXPECT_EQ((*parts)[0].requested_by, "7");
}

TEST(Aqdef, TheSamplesOfOthersAreRead) {
  const std::filesystem::path folder = SharedStandards() / "aqdef";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no AQDEF samples under SIXPOINT_SHARED_DIR";
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".dfq") continue;
    const auto parts = FromAqdef(FileText(entry.path()));
    EXPECT_TRUE(parts.ok()) << entry.path() << ": " << parts.status();
    ++count;
  }
  EXPECT_GT(count, 0);

  const auto three = FromAqdef(FileText(folder / "basicDfq_singlePart_threeCharacteristics.dfq"));
  ASSERT_TRUE(three.ok()) << three.status();
  ASSERT_EQ(three->size(), 3u);
  const InspectedPart& second = (*three)[1];
  EXPECT_EQ(second.part, "<part_number_1>");
  EXPECT_EQ(second.machine, "<machine_title1>");
  ASSERT_EQ(second.characteristics.size(), 3u);
  EXPECT_EQ(second.characteristics[2].name, "<characteristic_code_3>");
  EXPECT_EQ(second.characteristics[2].nominal, 4.5);
  EXPECT_EQ(second.characteristics[2].lower, 3.0);
  EXPECT_EQ(second.characteristics[2].upper, 6.0);
  EXPECT_EQ(second.values[0].value, 1.7);
  EXPECT_EQ(second.values[2].value, 4.7);
  EXPECT_EQ(second.values[2].verdict, Verdict::kUndecidable);

  const auto mixed = FromAqdef(FileText(folder / "basicDfq_threeParts_differentNumberOfCharacteristics.dfq"));
  ASSERT_TRUE(mixed.ok()) << mixed.status();
  // Eight times of the first, one of the second, three of the third.
  ASSERT_EQ(mixed->size(), 12u);
  EXPECT_EQ((*mixed)[7].values[0].value, 2.3);
  EXPECT_EQ((*mixed)[8].characteristics.size(), 3u);
  EXPECT_EQ((*mixed)[11].values[4].value, 7.8);

  const auto attributive =
      FromAqdef(FileText(folder / "attributiveDfq_attributiveCharacteristic_and_errorLogSheet.dfq"));
  ASSERT_TRUE(attributive.ok()) << attributive.status();
  EXPECT_EQ((*attributive)[0].values[0].reason, "K0020 1000; K0021 1");
}

TEST(Aqdef, AThousandPartsAreWritten) {
  const std::vector<InspectedPart> parts = Parts(1000, 80);
  auto begin = std::chrono::steady_clock::now();
  const auto file = ToAqdef(parts);
  ASSERT_TRUE(file.ok()) << file.status();
  const std::chrono::duration<double> wrote_s = std::chrono::steady_clock::now() - begin;
  begin = std::chrono::steady_clock::now();
  const auto back = FromAqdef(*file);
  const std::chrono::duration<double> read_s = std::chrono::steady_clock::now() - begin;
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->size(), parts.size());
  std::printf("1000 parts of 80 values: %.1f MB written in %.2f s, read in %.2f s\n", file->size() / 1e6,
              wrote_s.count(), read_s.count());
}

}  // namespace
}  // namespace sixpoint::exchange
