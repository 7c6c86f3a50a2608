#include "services/registration/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "services/registration/inputs.h"
#include "services/runtime/errors.h"

namespace sixpoint::registration {
namespace {

using ::testing::HasSubstr;

v1::RegisterRequest Good() {
  v1::RegisterRequest request;
  request.set_blade("blades/SN-0001");
  request.add_scans("scans/a");
  request.add_scans("scans/b");
  request.set_method(v1::METHOD_BEST_FIT);
  return request;
}

std::string MessageOf(const v1::RegisterRequest& request) {
  const absl::Status status = CheckRequest(request);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(CheckRequest, TakesAGoodOne) { EXPECT_TRUE(CheckRequest(Good()).ok()); }

TEST(CheckRequest, NamesAllThatIsWrongAtOnce) {
  v1::RegisterRequest request = Good();
  request.set_blade("parts/p1");
  request.add_scans("scans/a");
  request.set_method(v1::METHOD_UNSPECIFIED);
  request.mutable_options()->add_scan_weights(-1);
  request.mutable_options()->add_regions_in();
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(CheckRequest(request))) fields.push_back(violation.field);
  EXPECT_THAT(fields, ::testing::ElementsAre("blade", "scans[2]", "method", "options.scan_weights",
                                             "options.scan_weights[0]", "options.regions_in[0]"));
}

TEST(CheckRequest, NamesFieldValueAndWhatWasWanted) {
  v1::RegisterRequest request = Good();
  request.set_blade("parts/p1");
  EXPECT_THAT(MessageOf(request), HasSubstr("blade: parts/p1"));
  request = Good();
  request.clear_scans();
  EXPECT_THAT(MessageOf(request), HasSubstr("scans: 0 scans, want at least 1"));
  request = Good();
  request.add_scans("scans/a");
  EXPECT_THAT(MessageOf(request), HasSubstr("scans[2]: scans/a, want each scan once"));
  request = Good();
  request.set_method(v1::METHOD_UNSPECIFIED);
  EXPECT_THAT(MessageOf(request), HasSubstr("method: 0, want METHOD_BEST_FIT"));
  request.set_method(static_cast<v1::Method>(99));
  EXPECT_THAT(MessageOf(request), HasSubstr("method: 99"));
}

TEST(CheckRequest, RefusesOptionsThatCannotBe) {
  const auto asked = [](const std::function<void(v1::FitOptions*)>& set, v1::Method method = v1::METHOD_BEST_FIT) {
    v1::RegisterRequest request = Good();
    request.set_method(method);
    set(request.mutable_options());
    return MessageOf(request);
  };
  const auto set_point = [](double x, double y, double z, geometry::v1::Point* point) {
    point->set_x_mm(x);
    point->set_y_mm(y);
    point->set_z_mm(z);
  };
  EXPECT_THAT(asked([](auto* o) { o->add_degrees_of_freedom(v1::FREEDOM_UNSPECIFIED); }),
              HasSubstr("options.degrees_of_freedom[0]: 0, want FREEDOM_TURN_X"));
  EXPECT_THAT(asked([](auto* o) {
                o->add_degrees_of_freedom(v1::FREEDOM_SHIFT_Z);
                o->add_degrees_of_freedom(v1::FREEDOM_SHIFT_Z);
              }),
              HasSubstr("options.degrees_of_freedom[1]: FREEDOM_SHIFT_Z, want each direction once"));
  EXPECT_THAT(asked([](auto* o) { o->set_held_shift_standard_uncertainty_um(5); }),
              HasSubstr("options.held_shift_standard_uncertainty_um: 5, want none, as no such direction is held"));
  const auto holding = [](auto* o) {
    for (const auto free : {v1::FREEDOM_SHIFT_X, v1::FREEDOM_SHIFT_Y, v1::FREEDOM_SHIFT_Z})
      o->add_degrees_of_freedom(free);
  };
  v1::RegisterRequest held = Good();
  holding(held.mutable_options());
  held.mutable_options()->set_held_turn_standard_uncertainty_deg(0.01);
  EXPECT_TRUE(CheckRequest(held).ok());
  EXPECT_THAT(asked([&](auto* o) {
                holding(o);
                o->set_held_shift_standard_uncertainty_um(5);
              }),
              HasSubstr("as no such direction is held"));
  EXPECT_THAT(asked([&](auto* o) {
                holding(o);
                o->set_held_turn_standard_uncertainty_deg(-0.01);
              }),
              HasSubstr("options.held_turn_standard_uncertainty_deg: -0.01, want > 0 and at most 10"));
  EXPECT_THAT(asked([](auto* o) { o->add_degrees_of_freedom(v1::FREEDOM_SHIFT_Z); }, v1::METHOD_SIX_POINT),
              HasSubstr("options.degrees_of_freedom: 1 directions, want none named"));
  EXPECT_THAT(asked([](auto* o) { o->add_scan_weights(1); }), HasSubstr("options.scan_weights: 1 weights, want none"));
  EXPECT_THAT(asked([](auto* o) {
                o->add_scan_weights(1);
                o->add_scan_weights(std::nan(""));
              }),
              HasSubstr("options.scan_weights[1]: NaN, want 1e-6"));
  EXPECT_THAT(asked([](auto* o) { o->add_regions_in(); }), HasSubstr("options.regions_in[0]: no shape, want box"));
  EXPECT_THAT(asked([](auto* o) { o->add_regions_out()->mutable_ball()->set_radius_mm(1); }),
              HasSubstr("options.regions_out[0].ball.centre_mm: not given"));
  for (const double radius : {0.0, -1.0, 2e4, std::nan("")})
    EXPECT_THAT(asked([&](auto* o) {
                  set_point(0, 0, 0, o->add_regions_in()->mutable_ball()->mutable_centre_mm());
                  o->mutable_regions_in(0)->mutable_ball()->set_radius_mm(radius);
                }),
                HasSubstr("options.regions_in[0].ball.radius_mm: "));
  EXPECT_THAT(asked([&](auto* o) {
                set_point(0, 0, 0, o->add_regions_in()->mutable_box()->mutable_minimum_mm());
                set_point(1, 1, 0, o->mutable_regions_in(0)->mutable_box()->mutable_maximum_mm());
              }),
              HasSubstr("options.regions_in[0].box.maximum_mm.z_mm: 0, want more than its minimum, 0"));
  EXPECT_THAT(asked([&](auto* o) {
                set_point(0, 0, INFINITY, o->add_regions_in()->mutable_box()->mutable_minimum_mm());
                set_point(1, 1, 0, o->mutable_regions_in(0)->mutable_box()->mutable_maximum_mm());
              }),
              HasSubstr("options.regions_in[0].box.minimum_mm"));
  EXPECT_THAT(asked([](auto* o) { o->add_regions_in()->mutable_hole_group()->set_margin_mm(1); }),
              HasSubstr("options.regions_in[0].hole_group.group: empty"));
  EXPECT_THAT(asked([](auto* o) { o->add_regions_in()->mutable_hole_group()->set_group("G1"); }),
              HasSubstr("options.regions_in[0].hole_group.margin_mm: 0, want more than 0"));
  EXPECT_THAT(asked([](auto* o) {
                o->set_coarse_start(true);
                o->add_degrees_of_freedom(v1::FREEDOM_SHIFT_X);
              }),
              HasSubstr("options.coarse_start: true, with directions held"));
  EXPECT_THAT(asked([](auto* o) { o->mutable_allowance()->set_patch_mm(1); }),
              HasSubstr("options.allowance: set, with METHOD_BEST_FIT, want METHOD_ALLOWANCE"));
  const auto allowed = [&](const std::function<void(v1::AllowanceOptions*)>& set) {
    return asked([&](auto* o) { set(o->mutable_allowance()); }, v1::METHOD_ALLOWANCE);
  };
  EXPECT_THAT(allowed([](auto* a) { a->set_least_stock_mm(11); }), HasSubstr("options.allowance.least_stock_mm: 11"));
  EXPECT_THAT(allowed([](auto* a) { a->set_least_stock_mm(5.5); }), HasSubstr("allowance.greatest_stock_mm: 5, want"));
  EXPECT_THAT(allowed([](auto* a) { a->set_patch_mm(0); }), HasSubstr("options.allowance.patch_mm: 0, want 0.05"));
  EXPECT_THAT(allowed([](auto* a) { a->set_least_points(0); }), HasSubstr("allowance.least_points: 0, want 1"));
  EXPECT_THAT(allowed([](auto* a) { a->set_least_side_part(1.1); }), HasSubstr("allowance.least_side_part: 1.1, want"));
}

TEST(FitOptionsOf, TakesHoleGroupsForBallsRoundTheirStarts) {
  plant::v1::Part part;
  part.set_name("parts/p1");
  plant::v1::HoleGroup& group = *part.add_hole_groups();
  group.set_group("G2");
  group.set_diameter_mm(3);
  for (const double x : {1.0, 5.0}) group.add_holes()->mutable_start_in_part_mm()->set_x_mm(x);
  v1::FitOptions options;
  options.add_regions_in()->mutable_hole_group()->set_group("G2");
  options.mutable_regions_in(0)->mutable_hole_group()->set_margin_mm(2);
  options.add_regions_out()->mutable_box()->mutable_minimum_mm()->set_x_mm(-1);
  options.mutable_regions_out(0)->mutable_box()->mutable_maximum_mm()->set_x_mm(3);
  options.add_degrees_of_freedom(v1::FREEDOM_SHIFT_Y);
  const auto out = FitOptionsOf(options, part);
  ASSERT_TRUE(out.ok()) << out.status();
  ASSERT_EQ(out->regions_in.size(), 2u);
  EXPECT_TRUE(out->regions_in[1].Holds({5, 3.49, 0}));
  EXPECT_FALSE(out->regions_in[1].Holds({5, 3.51, 0}));
  EXPECT_EQ(out->regions_out[0].centre_mm.x(), 1);
  EXPECT_EQ(out->regions_out[0].half_mm.x(), 2);
  EXPECT_EQ(out->free, (std::array<bool, 6>{false, false, false, false, true, false}));
  options.mutable_regions_in(0)->mutable_hole_group()->set_group("G3");
  EXPECT_THAT(std::string(FitOptionsOf(options, part).status().message()),
              HasSubstr("options.regions_in[0].hole_group.group: G3, want one of G2"));
  EXPECT_EQ(FitOptionsOf({}, part)->free, (std::array<bool, 6>{true, true, true, true, true, true}));
}

TEST(FilledIn, SaysWhatAnAllowanceTook) {
  v1::RegisterRequest request = Good();
  request.mutable_options()->set_coarse_start(true);
  EXPECT_FALSE(FilledIn(request).has_allowance());
  request.set_method(v1::METHOD_ALLOWANCE);
  request.mutable_options()->mutable_allowance()->set_least_stock_mm(0.25);
  const v1::FitOptions filled = FilledIn(request);
  EXPECT_TRUE(filled.coarse_start());
  EXPECT_EQ(filled.allowance().least_stock_mm(), 0.25);
  EXPECT_EQ(filled.allowance().greatest_stock_mm(), metrology::AllowanceOptions().greatest_stock_mm);
  EXPECT_TRUE(filled.allowance().has_patch_mm() && filled.allowance().has_least_points());
}

TEST(CheckScan, WantsThisBladeOnOneMachine) {
  ingest::v1::Scan first;
  first.set_name("scans/a");
  first.mutable_header()->set_subject("blades/SN-0001");
  first.mutable_header()->set_machine("machines/m1");
  EXPECT_TRUE(CheckScan(Good(), first, first).ok());
  ingest::v1::Scan scan = first;
  scan.mutable_header()->set_subject("artefacts/plate-1");
  EXPECT_THAT(std::string(CheckScan(Good(), scan, first).message()),
              HasSubstr("subject: artefacts/plate-1, want blades/SN-0001"));
  scan = first;
  scan.mutable_header()->set_machine("machines/m2");
  EXPECT_THAT(std::string(CheckScan(Good(), scan, first).message()), HasSubstr("machine: machines/m2"));
}

TEST(DatumsOf, RefusesAPartWithoutSixPoints) {
  plant::v1::Part part;
  part.set_name("parts/p1");
  const absl::Status status = DatumsOf(part).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(status), "SIX_POINTS_MISSING");
  EXPECT_THAT(std::string(status.message()), HasSubstr("has 0 points, want 6"));
}

}  // namespace
}  // namespace sixpoint::registration
