// Pairs of our values and another instrument's: the newest of each, in the drawing's units.
#include "services/inspection/paired_values.h"

#include <gmock/gmock.h>

#include "services/inspection/unit_conversion.h"

namespace sixpoint::inspection {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

plant::v1::Drawing DrawingInUnits() {
  plant::v1::Drawing drawing;
  for (const auto& [number, unit] :
       {std::pair("9", plant::v1::CHARACTERISTIC_UNIT_MM), std::pair("1", plant::v1::CHARACTERISTIC_UNIT_UM),
        std::pair("4", plant::v1::CHARACTERISTIC_UNIT_DEG)}) {
    plant::v1::Characteristic& one = *drawing.add_characteristics();
    one.set_characteristic(number);
    one.set_unit(unit);
  }
  return drawing;
}

storage::MeasurementRow Theirs(const std::string& serial, const std::vector<storage::MeasuredValueRow>& values) {
  storage::MeasurementRow row;
  row.blade_serial = serial;
  row.values = values;
  return row;
}

TEST(PairedValues, TheNewestOfEachInTheDrawingsUnitsAndOrder) {
  const std::vector<OurValue> ours = {{"SN-1", "1", "h1", "MM", 0.012, 0.002},
                                      {"SN-1", "1", "h1", "UM", 99, 1},  // older
                                      {"SN-2", "9", "", "MM", -0.03, {}},
                                      {"SN-1", "9", "", "MM", -0.02, 0.004}};
  const std::vector<storage::MeasurementRow> theirs = {
      Theirs("SN-1", {{"1", "h1", "UM", "RADIUS", 10, 1.5, ""}, {"1", "h2", "UM", "RADIUS", 10, 1.5, ""}}),
      Theirs("SN-1", {{"1", "h1", "UM", "RADIUS", 77, 1.5, ""}, {"9", "", "MM", "HALF_WIDTH", 0.025, {}, ""}}),
      Theirs("SN-2", {{"9", "", "MM", "BORDERS", -0.031, {}, ""}})};
  const auto pairs = PairedValues(DrawingInUnits(), ours, theirs);
  ASSERT_THAT(pairs, SizeIs(3));
  EXPECT_EQ(pairs[0].characteristic + pairs[0].blade, "9SN-1");
  EXPECT_EQ(pairs[0].ours, 0.02) << "a half width has no sign";
  EXPECT_EQ(pairs[0].theirs, 0.025);
  EXPECT_EQ(pairs[0].ours_expanded, 0.004);
  EXPECT_FALSE(pairs[0].theirs_expanded.has_value());
  EXPECT_EQ(pairs[1].blade, "SN-2");
  EXPECT_EQ(pairs[1].ours, -0.03);
  EXPECT_EQ(pairs[2].characteristic + pairs[2].feature, "1h1");
  EXPECT_EQ(pairs[2].ours, 12);
  EXPECT_EQ(pairs[2].theirs, 10);
  EXPECT_EQ(pairs[2].ours_expanded, 2);
}

TEST(PairedValues, WhatCannotStandBesideOursHasNoPair) {
  const std::vector<OurValue> ours = {{"SN-1", "4", "h1", "DEG", 1, {}}, {"SN-1", "99", "", "MM", 1, {}}};
  EXPECT_THAT(PairedValues(DrawingInUnits(), ours,
                           {Theirs("SN-1", {{"4", "h1", "MM", "", 1, {}, ""}, {"99", "", "MM", "", 1, {}, ""}}),
                            Theirs("SN-2", {{"4", "h1", "DEG", "", 1, {}, ""}}),
                            Theirs("SN-1", {{"4", "h2", "DEG", "", 1, {}, ""}})}),
              IsEmpty());
  // What was not measured does not hide an older value that was.
  EXPECT_THAT(PairedValues(DrawingInUnits(), ours,
                           {Theirs("SN-1", {{"4", "h1", "DEG", "", {}, {}, "broken"}}),
                            Theirs("SN-1", {{"4", "h1", "DEG", "", 2, {}, ""}})}),
              SizeIs(1));
}

TEST(UnitConversion, LeavesTheDecimalNumberThatWasWritten) {
  EXPECT_EQ(ConversionTo(plant::v1::CHARACTERISTIC_UNIT_UM, "mm")->Of(0.0125), 12.5);
  EXPECT_EQ(ConversionTo(plant::v1::CHARACTERISTIC_UNIT_MM, "um")->Of(12.3), 0.0123);
  EXPECT_EQ(ConversionTo(plant::v1::CHARACTERISTIC_UNIT_MM, "\xc2\xb5m")->Of(1), 0.001);
  EXPECT_EQ(ConversionTo(plant::v1::CHARACTERISTIC_UNIT_DEG, "\xc2\xb0")->Of(0.1), 0.1);
  for (const char* none : {"", "inch", "m", "rad", "MM ", "deg"})
    EXPECT_FALSE(ConversionTo(plant::v1::CHARACTERISTIC_UNIT_MM, none).has_value()) << none;
}

}  // namespace
}  // namespace sixpoint::inspection
