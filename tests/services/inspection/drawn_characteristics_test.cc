// Which characteristic of a drawing, at which feature, a name in another instrument's file means.
#include "services/inspection/drawn_characteristics.h"

#include <gmock/gmock.h>

#include "refusal/refusal.h"

namespace sixpoint::inspection {
namespace {

using ::testing::HasSubstr;

plant::v1::Part PartWith(const std::vector<std::string>& holes) {
  plant::v1::Part part;
  plant::v1::HoleGroup& group = *part.add_hole_groups();
  group.set_group("G1");
  for (const std::string& hole : holes) group.add_holes()->set_hole(hole);
  return part;
}

class DrawnCharacteristicsTest : public ::testing::Test {
 protected:
  plant::v1::Characteristic* Add(const std::string& number, plant::v1::CharacteristicQuantity quantity,
                                 const std::string& group = "") {
    plant::v1::Characteristic& one = *drawing_.add_characteristics();
    one.set_characteristic(number);
    one.set_name("name of " + number);
    one.set_quantity(quantity);
    one.set_hole_group(group);
    return &one;
  }
  // "1 h1 #0": balloon, feature, its place; "none"; or what is refused.
  std::string Found(const std::string& name, const std::string& feature = "") {
    const DrawnCharacteristics drawn(drawing_, parts_);
    const auto place = drawn.Find(name, feature);
    if (!place.ok()) return std::string(place.status().message());
    if (!place->has_value()) return "none";
    return drawn.At(**place).characteristic() + " " + (*place)->feature + " #" +
           std::to_string((*place)->feature_index);
  }

  plant::v1::Drawing drawing_;
  std::vector<plant::v1::Part> parts_ = {PartWith({"h1", "h2", "h3"})};
};

TEST_F(DrawnCharacteristicsTest, ABalloonAndAFeatureInEachWayToWriteThem) {
  Add("1", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, "G1");
  Add("2", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH, "G1");
  Add("3/4", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_DIAMETER, "G1");
  Add("5", plant::v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD);
  EXPECT_EQ(Found("1", "h2"), "1 h2 #1");
  EXPECT_EQ(Found("1/h3"), "1 h3 #2");
  EXPECT_EQ(Found("G1/h3/position"), "1 h3 #2");
  EXPECT_EQ(Found("2", "h2 to h3"), "2 h2 to h3 #1");
  EXPECT_EQ(Found("2/h1 to h2"), "2 h1 to h2 #0");
  EXPECT_EQ(Found("3/4/h1"), "3/4 h1 #0") << "a balloon may have a slash of its own";
  EXPECT_EQ(Found("5"), "5  #0");
  EXPECT_EQ(Found("G1/h3/inclination"), "none");
  EXPECT_EQ(Found("G1/h9/position"), "none");
  EXPECT_EQ(Found("name of 5"), "none") << "a name is another's alone where it is measured elsewhere";
  EXPECT_EQ(Found("6"), "none");
  EXPECT_EQ(Found("6", "h1"), "none");
  EXPECT_EQ(Found(""), "none");
  EXPECT_EQ(Found("/"), "none");
  EXPECT_EQ(Found(std::string(100000, '/')), "none");
  EXPECT_THAT(Found("2", "h1 to h3"), HasSubstr("want two neighbours, \"h1 to h2\", of G1"));
  EXPECT_THAT(Found("1"), HasSubstr("want a hole of G1"));
}

TEST_F(DrawnCharacteristicsTest, WhatIsMeasuredElsewhereHasItsName) {
  Add("1", plant::v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD);
  Add("2", plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE)->set_name("Ra");
  Add("3", plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE, "G1")->set_name("flow");
  Add("4", plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE)->set_name("1");
  EXPECT_EQ(Found("Ra"), "2  #0");
  EXPECT_EQ(Found("2"), "2  #0");
  EXPECT_EQ(Found("flow", "h2"), "3 h2 #1");
  EXPECT_EQ(Found("flow/h2"), "3 h2 #1");
  EXPECT_THAT(Found("1"), HasSubstr("want what one alone is called: 1 and 4 are"));
}

TEST_F(DrawnCharacteristicsTest, WhatMayMeanTwoIsRefused) {
  Add("1", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, "G1");
  Add("2", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, "G1")->set_hole("h2");
  EXPECT_EQ(Found("G1/h1/position"), "1 h1 #0");
  EXPECT_THAT(Found("G1/h2/position"), HasSubstr("want a balloon's number: it may be 1 or 2"));
  EXPECT_EQ(Found("2"), "2 h2 #0") << "there is one";
}

TEST_F(DrawnCharacteristicsTest, AHoleOfAnyRevisionIsAFeature) {
  parts_ = {PartWith({"h1", "h3"}), PartWith({"h1", "h2", "h3"})};
  Add("1", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_DIAMETER, "G1");
  Add("2", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH, "G1");
  EXPECT_EQ(Found("1", "h1"), "1 h1 #0");
  EXPECT_EQ(Found("1", "h2"), "1 h2 #2");
  EXPECT_EQ(Found("2", "h1 to h3"), "2 h1 to h3 #0");
  EXPECT_EQ(Found("2", "h2 to h3"), "2 h2 to h3 #2");
}

}  // namespace
}  // namespace sixpoint::inspection
