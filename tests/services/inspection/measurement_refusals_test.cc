// What an import refuses, by name, and that nothing is kept of it.
#include <gmock/gmock.h>

#include "tests/services/inspection/measurement_service_fixture.h"

namespace sixpoint::inspection {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

using MeasurementRefusalsTest = MeasurementServiceTest;

TEST_F(MeasurementRefusalsTest, WhatTheFileDoesNotTellIsStatedOrRefused) {
  const std::string bare = "characteristic,feature,value,unit\n1,H1,0.06,mm\n9,,0.1,mm\n";
  const std::string all = Refusal(Request(bare));
  EXPECT_THAT(all, HasSubstr("content: row 1: serial: empty, want a serial number in the file, or `blade`"));
  v1::ImportMeasurementsRequest request = Request(bare);
  request.set_blade("blades/SN-1");
  EXPECT_THAT(Refusal(request), HasSubstr("content: row 1: zone: empty, want DIAMETER or RADIUS, in the file or as "
                                          "position_zone: half or whole is not guessed"));
  EXPECT_THAT(Refusal(request), HasSubstr("content: row 2: zone: empty, want WIDTH, HALF_WIDTH or BORDERS"));
  request.set_position_zone(plant::v1::TOLERANCE_ZONE_DIAMETER);
  request.set_profile_zone(plant::v1::TOLERANCE_ZONE_WIDTH);
  EXPECT_THAT(Refusal(request), HasSubstr("measured_at: empty, want when SN-1 was measured: the file does not tell"));
  request.mutable_measured_at()->set_seconds(1795000001);
  const v1::Measurement read = Imported(request);
  ASSERT_EQ(read.values_size(), 2);
  EXPECT_EQ(read.values(0).value(), 30);
  EXPECT_EQ(read.values(1).value(), 0.05);
  EXPECT_FALSE(read.values(0).has_expanded_uncertainty()) << "none is stated, and 0 would be one";
}

TEST_F(MeasurementRefusalsTest, WhatCannotBeIsRefusedByName) {
  EXPECT_THAT(RefusalOf(Row("SN-9", "12", "", "3", "mm") + Row("SN-8", "12", "", "3", "mm")),
              AllOf(HasSubstr("serial: blades/SN-9, want one that the plant knows"), HasSubstr("SN-8")));
  EXPECT_THAT(RefusalOf(Row("X-1", "12", "", "3", "mm")),
              HasSubstr("serial: blades/X-1 of parts/other, want a blade of parts/vane"));
  EXPECT_THAT(RefusalOf(Row("../x", "12", "", "3", "mm")), HasSubstr("row 1: serial: ../x"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "99", "", "3", "mm") + Row("SN-1", "roughness", "", "3", "mm")),
              AllOf(HasSubstr("row 1: characteristic: 99, want one of the drawing"),
                    HasSubstr("row 2: characteristic: roughness")));
  EXPECT_THAT(RefusalOf(Row("SN-1", "1", "", "3", "um", "RADIUS")), HasSubstr("feature: empty, want a hole of G1"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "1", "H9", "3", "um", "RADIUS")), HasSubstr("feature: H9, want a hole of G1"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "4", "H1", "3", "deg")), HasSubstr("feature: H1, want H2"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "H1", "3", "mm")), HasSubstr("feature: H1, want none: it is at one place"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "3", "deg")), HasSubstr("row 1: unit: deg, want mm or um"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "3", "")), HasSubstr("row 1: unit: empty, want mm or um"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "3", "inch")), HasSubstr("row 1: unit: inch, want mm or um"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "4", "H2", "3", "mm")), HasSubstr("row 1: unit: mm, want deg"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "nan", "mm")), HasSubstr("row 1: value: nan, want a finite number"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "1e10", "mm")), HasSubstr("row 1: value: 10000000000, want less than"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "1", "H1", "-3", "um", "RADIUS")), HasSubstr("value: -3, want 0 or more"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "1", "H1", "3", "um", "WIDTH")), HasSubstr("zone: WIDTH, want DIAMETER or RADIUS"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "3", "mm", "WIDTH")),
              HasSubstr("zone: WIDTH, want none: 12 has no zone"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "12", "", "3", "mm") + Row("SN-1", "12", "", "3", "mm")),
              HasSubstr("row 2: characteristic: 12, want each once of SN-1"));
  EXPECT_THAT(RefusalOf(Row("SN-1", "25", "", "3", "um") + Row("SN-1", "Ra", "", "3", "um")),
              HasSubstr("row 2: characteristic: Ra, want each once of SN-1"));
  EXPECT_THAT(RefusalOf("SN-1,12,,3,mm,,2199-01-01T00:00:00Z,,\n"), HasSubstr("measured_at of SN-1"));
  std::string many;
  for (int i = 0; i < 201; ++i) many += Row("B-" + std::to_string(i), "12", "", "3", "mm");
  EXPECT_THAT(RefusalOf(many), HasSubstr("serial: B-200, want at most 200 blades in a file"));
}

TEST_F(MeasurementRefusalsTest, WhatTheRequestStatesIsChecked) {
  const std::string good = kHead + Row("SN-1", "12", "", "3", "mm");
  const auto refusal = [&](const std::function<void(v1::ImportMeasurementsRequest*)>& spoil) {
    v1::ImportMeasurementsRequest request = Request(good);
    spoil(&request);
    return Refusal(request);
  };
  using R = v1::ImportMeasurementsRequest;
  EXPECT_THAT(refusal([](R* r) { r->set_drawing("parts/vane"); }), HasSubstr("drawing: parts/vane"));
  EXPECT_THAT(refusal([](R* r) { r->set_drawing("drawings/none"); }),
              HasSubstr("drawing: drawings/none, want one that the plant knows"));
  EXPECT_THAT(refusal([](R* r) { r->set_drawing("drawings/vane-70@7"); }), HasSubstr("drawing: drawings/vane-70@7"));
  EXPECT_THAT(refusal([](R* r) { r->clear_content(); }), HasSubstr("content: empty, want the file"));
  EXPECT_THAT(refusal([](R* r) { r->clear_format(); }), HasSubstr("format: 0, want QIF, AQDEF or CSV"));
  EXPECT_THAT(refusal([](R* r) { r->set_format(v1::MEASUREMENT_FORMAT_QIF); }), HasSubstr("content: document"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_instrument()->clear_kind(); }), HasSubstr("instrument.kind: 0, want CMM"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_instrument()->set_model(" "); }), HasSubstr("instrument.model"));
  EXPECT_THAT(refusal([](R* r) { r->clear_instrument(); }),
              AllOf(HasSubstr("instrument.manufacturer: empty"), HasSubstr("instrument.serial_number: empty")));
  EXPECT_THAT(refusal([](R* r) { r->mutable_uncertainty(); }), HasSubstr("uncertainty: nothing stated"));
  EXPECT_THAT(refusal([](R* r) { r->mutable_uncertainty()->set_lengths_um(0); }),
              AllOf(HasSubstr("uncertainty.lengths_um: 0, want more than 0"), HasSubstr("uncertainty.basis: empty")));
  EXPECT_THAT(refusal([](R* r) { r->mutable_measured_at()->set_seconds(5'000'000'000); }),
              HasSubstr("measured_at.seconds"));
  EXPECT_THAT(refusal([](R* r) { r->set_position_zone(plant::v1::TOLERANCE_ZONE_WIDTH); }),
              HasSubstr("position_zone: 3, want DIAMETER or RADIUS"));
  EXPECT_THAT(refusal([](R* r) { r->set_blade("blades/SN-2"); }),
              HasSubstr("row 1: serial: SN-1, want SN-2, the `blade` that was stated"));
}

}  // namespace
}  // namespace sixpoint::inspection
