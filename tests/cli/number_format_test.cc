#include "cli/number_format.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cli/table.h"

namespace sixpoint::cli {
namespace {

TEST(Fixed, HasNoNegativeZeroAndNoNan) {
  EXPECT_EQ(Fixed(1.23456, 3), "1.235");
  EXPECT_EQ(Fixed(-0.0004, 3), "0.000");
  EXPECT_EQ(FixedOrNone(0, 3), "-");
  EXPECT_EQ(FixedOrNone(0.0001, 3), "0.000");
  EXPECT_EQ(Fixed(-0.0006, 3), "-0.001");
  EXPECT_EQ(Fixed(std::nan(""), 3), "-");
}

TEST(FixedOrTiny, NeverShowsNothingOfSomething) {
  EXPECT_EQ(FixedOrTiny(0.0123456, 5), "0.01235");
  EXPECT_EQ(FixedOrTiny(4.2e-13, 6), "4.2e-13");
  EXPECT_EQ(FixedOrTiny(-4.2e-13, 6), "-4.2e-13");
  EXPECT_EQ(FixedOrTiny(0, 6), "0.000000");
  EXPECT_EQ(FixedOrTiny(std::nan(""), 6), "-");
}

TEST(Grouped, PutsSpacesBetweenThousands) {
  EXPECT_EQ(Grouped(7), "7");
  EXPECT_EQ(Grouped(999), "999");
  EXPECT_EQ(Grouped(1000), "1 000");
  EXPECT_EQ(Grouped(20316804), "20 316 804");
  EXPECT_EQ(Grouped(-123456), "-123 456");
}

TEST(Table, AlignsColumnsByTheirWidestCell) {
  Table table({"name", ">value", "unit"});
  table.AddRow({"alpha", "1.5", "deg"});
  table.AddRow({"T", "-190.25", "mm"});
  EXPECT_EQ(table.ToText(), "name     value  unit\nalpha      1.5  deg\nT      -190.25  mm\n");
}

TEST(Table, FillsMissingCells) {
  Table table({"a", "b"});
  table.AddRow({"1"});
  EXPECT_EQ(table.ToText(), "a  b\n1\n");
}

}  // namespace
}  // namespace sixpoint::cli
