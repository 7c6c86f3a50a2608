// Values of inspections as they are listed and streamed, from a real PostgreSQL.
#include "services/inspection/value_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "services/inspection/inspection_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::inspection {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class ValueServiceTest : public ::testing::Test {
 protected:
  v1::Inspection Inspect() {
    v1::InspectRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    v1::Inspection inspection;
    const grpc::Status status =
        inspections_->Inspect(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &inspection);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return inspection;
  }
  absl::StatusOr<v1::ListValuesResponse> List(const v1::ListValuesRequest& request) {
    v1::ListValuesResponse response;
    const grpc::Status status = stub_->ListValues(runtime::ContextFor(10).get(), request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }
  std::string RefusalOf(const v1::ListValuesRequest& request) { return std::string(List(request).status().message()); }

  testing::JudgedPlant plant_;
  InspectionService inspection_service_{
      storage::InspectionsIn(plant_.database.database()),
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  ValueService service_{storage::ValuesIn(plant_.database.database())};
  testing::InProcessServer server_{{&inspection_service_, &service_}};
  std::unique_ptr<v1::InspectionService::Stub> inspections_ = v1::InspectionService::NewStub(server_.Connect());
  std::unique_ptr<v1::ValueService::Stub> stub_ = v1::ValueService::NewStub(server_.Connect());
};

TEST_F(ValueServiceTest, TellsWhatTheInspectionTells) {
  const v1::Inspection inspection = Inspect();
  const auto all = List({});
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_THAT(all->values(), SizeIs(2 * inspection.holes_size()));
  EXPECT_THAT(all->next_page_token(), IsEmpty());
  for (int i = 0; i < inspection.holes_size(); ++i) {
    const v1::HoleResult& hole = inspection.holes(i);
    const v1::Value &position = all->values(2 * i), &inclination = all->values(2 * i + 1);
    EXPECT_EQ(position.characteristic(), hole.group() + "/" + hole.hole() + "/position");
    EXPECT_EQ(position.unit(), "mm");
    EXPECT_EQ(position.value(), hole.position_error_mm());
    EXPECT_EQ(position.expanded_uncertainty(), hole.position_expanded_uncertainty_um() / 1e3);
    EXPECT_EQ(position.upper_limit(), hole.position_tolerance_mm());
    EXPECT_FALSE(position.has_lower_limit());
    EXPECT_EQ(position.verdict(), hole.position_verdict());
    EXPECT_EQ(position.method(), inspection.positioning().method());
    EXPECT_EQ(position.inspection(), inspection.name());
    EXPECT_EQ(position.record_sequence(), inspection.record_sequence());
    EXPECT_EQ(position.blade(), "blades/sn1");
    EXPECT_EQ(inclination.characteristic(), hole.group() + "/" + hole.hole() + "/inclination");
    EXPECT_EQ(inclination.unit(), "deg");
    EXPECT_EQ(inclination.value(), hole.inclination_error_deg());
    EXPECT_EQ(inclination.upper_limit(), hole.inclination_tolerance_deg());
    EXPECT_EQ(inclination.verdict(), hole.inclination_verdict());
  }
  // One call: serial number and characteristic.
  v1::ListValuesRequest one;
  one.set_blade("blades/sn1");
  one.set_characteristic(all->values(0).characteristic());
  const auto value = List(one);
  ASSERT_TRUE(value.ok()) << value.status();
  ASSERT_THAT(value->values(), SizeIs(1));
  EXPECT_EQ(value->values(0).SerializeAsString(), all->values(0).SerializeAsString());
}

TEST_F(ValueServiceTest, WhatWasNotMeasuredHasNoValue) {
  plant::v1::GaugePin& pin = *plant_.plant.part.mutable_hole_groups(0)->mutable_gauge_pin();
  pin.set_greatest_play_mm(0.03);
  pin.set_diameter_mm(0.4);  // another than stands there
  Inspect();
  const auto all = List({});
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_THAT(all->values(), SizeIs(4));
  EXPECT_EQ(all->values(0).verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_FALSE(all->values(0).has_value());
  EXPECT_FALSE(all->values(0).has_expanded_uncertainty());
  EXPECT_GT(all->values(0).upper_limit(), 0);
}

TEST_F(ValueServiceTest, FindsByEveryFilterAndPagesAreWhole) {
  std::vector<v1::Inspection> inspections;
  for (int i = 0; i < 5; ++i) inspections.push_back(Inspect());
  const auto count = [&](const std::function<void(v1::ListValuesRequest*)>& set) {
    v1::ListValuesRequest request;
    set(&request);
    const auto found = List(request);
    EXPECT_TRUE(found.ok()) << found.status();
    return found.ok() ? found->values_size() : -1;
  };
  EXPECT_EQ(count([](auto*) {}), 20);
  EXPECT_EQ(count([](auto* r) { r->set_serial_prefix("sn"); }), 20);
  EXPECT_EQ(count([](auto* r) { r->set_serial_prefix("sn2"); }), 0);
  EXPECT_EQ(count([](auto* r) { r->set_serial_prefix("%"); }), 0);
  EXPECT_EQ(count([](auto* r) { r->set_only_newest(true); }), 4);
  EXPECT_EQ(count([&](auto* r) { r->set_part(plant_.plant.part.name()); }), 20);
  EXPECT_EQ(count([](auto* r) { r->set_part("parts/another"); }), 0);
  EXPECT_EQ(count([](auto* r) { r->set_machine("machines/another"); }), 0);
  EXPECT_EQ(count([](auto* r) { r->set_verdict(v1::VERDICT_CONFORM); }), 0);
  EXPECT_EQ(count([](auto* r) { r->set_verdict(v1::VERDICT_NOT_CONFORM); }), 20);
  EXPECT_EQ(count([](auto* r) { r->mutable_recorded()->mutable_from()->set_seconds(4'000'000'000); }), 0);
  const std::string hole = inspections[0].holes(0).group() + "/" + inspections[0].holes(0).hole();
  EXPECT_EQ(count([&](auto* r) { r->set_characteristic(hole); }), 10);
  EXPECT_EQ(count([&](auto* r) { r->set_characteristic(hole + "/inclination"); }), 5);
  EXPECT_EQ(count([&](auto* r) { r->set_characteristic("no/hole"); }), 0);

  v1::ListValuesRequest request;
  request.set_page_size(2);
  std::vector<std::string> seen;
  std::vector<int> sizes;
  do {
    const auto page = List(request);
    ASSERT_TRUE(page.ok()) << page.status();
    sizes.push_back(page->values_size());
    for (const v1::Value& value : page->values()) seen.push_back(value.inspection() + value.characteristic());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(sizes, ::testing::ElementsAre(8, 8, 4));
  EXPECT_EQ(std::set<std::string>(seen.begin(), seen.end()).size(), 20u);
  EXPECT_THAT(seen.front(), HasSubstr(inspections.back().name()));

  // The stream has the same, in the same order; and goes on where it is told to.
  v1::DownloadValuesRequest all;
  *all.mutable_values() = request;
  all.mutable_values()->clear_page_token();
  std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(10);
  const auto stream = stub_->DownloadValues(context.get(), all);
  std::vector<std::string> streamed;
  std::string token;
  for (v1::ListValuesResponse page; stream->Read(&page);) {
    if (token.empty()) token = page.next_page_token();
    for (const v1::Value& value : page.values()) streamed.push_back(value.inspection() + value.characteristic());
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(streamed, seen);
  all.mutable_values()->set_page_token(token);
  context = runtime::ContextFor(10);
  const auto rest = stub_->DownloadValues(context.get(), all);
  int rest_count = 0;
  for (v1::ListValuesResponse page; rest->Read(&page);) rest_count += page.values_size();
  EXPECT_TRUE(rest->Finish().ok());
  EXPECT_EQ(rest_count, 12);
}

TEST_F(ValueServiceTest, RefusesWhatDoesNotParse) {
  const auto refusal = [&](const std::function<void(v1::ListValuesRequest*)>& set) {
    v1::ListValuesRequest request;
    set(&request);
    return RefusalOf(request);
  };
  for (const char* text : {"G1", "/H1", "G1/", "G1/H1/", "G1/H1/depth", "//", "G1//position"})
    EXPECT_THAT(refusal([&](auto* r) { r->set_characteristic(text); }), HasSubstr("characteristic: ")) << text;
  EXPECT_THAT(refusal([](auto* r) { r->set_blade("sn1"); }), HasSubstr("blade: sn1"));
  EXPECT_THAT(refusal([](auto* r) { r->set_verdict(static_cast<v1::Verdict>(77)); }), HasSubstr("verdict: 77"));
  EXPECT_THAT(refusal([](auto* r) {
                r->mutable_recorded()->mutable_from()->set_seconds(2000);
                r->mutable_recorded()->mutable_until()->set_seconds(1000);
              }),
              HasSubstr("recorded"));
  EXPECT_THAT(refusal([](auto* r) { r->set_page_token("of another question"); }), HasSubstr("page_token"));
  EXPECT_THAT(refusal([](auto* r) { r->set_page_size(-1); }), HasSubstr("page_size"));
}

}  // namespace
}  // namespace sixpoint::inspection
