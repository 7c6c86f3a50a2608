// The handlers of just the values on a fake store: no PostgreSQL. What is found by which filter is held to the real one by
// tests/storage/value_reads_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>

#include "services/inspection/value_service.h"
#include "tests/support/call.h"
#include "tests/support/fake_inspections.h"
#include "tests/support/in_process_server.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"

namespace sixpoint::inspection {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class ValueHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::InspectionRow;
  using Stub = v1::ValueService::Stub;
  using Ask = std::function<void(v1::ListValuesRequest*)>;

  static Row Sample(const std::string& serial = "sn1") {
    Row row = testing::SampleInspection();
    row.blade_serial = serial;
    row.machine_id = "m1";
    row.machine_revision = 3;
    row.part_id = "p1";
    row.part_revision = 2;
    return row;
  }
  // Gives its name.
  std::string Put(Row row = Sample()) {
    row.inspection_id = storage::NewUuid();
    testing::Must(inspections_->Record({}, row, {}, {}).status());
    return "inspections/" + row.inspection_id;
  }
  absl::StatusOr<v1::ListValuesResponse> List(const v1::ListValuesRequest& request) {
    return testing::Call(*stub_, &Stub::ListValues, request);
  }
  testing::Streamed<v1::ListValuesResponse> Download(const v1::ListValuesRequest& values) {
    v1::DownloadValuesRequest request;
    *request.mutable_values() = values;
    return testing::CallStream(*stub_, &Stub::DownloadValues, request);
  }
  static v1::ListValuesRequest Asked(const Ask& ask) {
    v1::ListValuesRequest request;
    ask(&request);
    return request;
  }
  // The inspection and the characteristic of each.
  static std::vector<std::string> Told(const v1::ListValuesResponse& page) {
    std::vector<std::string> told;
    for (const v1::Value& value : page.values()) told.push_back(value.inspection() + " " + value.characteristic());
    return told;
  }
  std::vector<std::string> Found(const Ask& ask) {
    const auto found = List(Asked(ask));
    EXPECT_TRUE(found.ok()) << found.status();
    return found.ok() ? Told(*found) : std::vector<std::string>();
  }
  // Of both handlers the same.
  std::vector<Violation> Refused(const Ask& ask) {
    const std::vector<Violation> violations = ViolationsOf(List(Asked(ask)).status());
    const auto streamed = Download(Asked(ask));
    EXPECT_EQ(ViolationsOf(streamed.status), violations);
    EXPECT_THAT(streamed.messages, IsEmpty());
    return violations;
  }

  std::shared_ptr<testing::FakeInspections> inspections_ = std::make_shared<testing::FakeInspections>();
  ValueService service_{std::make_shared<testing::FakeValues>(inspections_)};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::ValueService::NewStub(server_.Connect());
};

TEST_F(ValueHandlersTest, TellsBothCharacteristicsOfEachHole) {
  Put();
  const std::string name = Put();
  const auto all = List({});
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_THAT(all->values(), SizeIs(8));
  EXPECT_THAT(all->next_page_token(), IsEmpty());
  const v1::Value &position = all->values(0), &inclination = all->values(1), &missing = all->values(2);
  EXPECT_EQ(position.blade(), "blades/sn1");
  EXPECT_EQ(position.characteristic(), "G1/H1/position");
  EXPECT_EQ(position.unit(), "mm");
  EXPECT_EQ(position.value(), 0.02);
  EXPECT_EQ(position.nominal(), 0);
  EXPECT_FALSE(position.has_lower_limit());
  EXPECT_EQ(position.upper_limit(), 0.1);
  EXPECT_EQ(position.expanded_uncertainty(), 6 / 1e3);
  EXPECT_EQ(position.verdict(), v1::VERDICT_CONFORM);
  EXPECT_EQ(position.method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_EQ(position.inspection(), name);
  EXPECT_EQ(position.machine(), "machines/m1@3");
  EXPECT_EQ(position.part(), "parts/p1@2");
  EXPECT_EQ(position.record_sequence(), 2);
  EXPECT_GT(position.recorded_at().seconds(), 1'700'000'000);
  EXPECT_EQ(inclination.characteristic(), "G1/H1/inclination");
  EXPECT_EQ(inclination.unit(), "deg");
  EXPECT_EQ(inclination.value(), 0.25);
  EXPECT_EQ(inclination.upper_limit(), 1);
  EXPECT_EQ(inclination.expanded_uncertainty(), 0.05);
  EXPECT_EQ(missing.characteristic(), "G1/H2/position");
  EXPECT_EQ(missing.verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_FALSE(missing.has_value());
  EXPECT_FALSE(missing.has_expanded_uncertainty());
  EXPECT_EQ(missing.upper_limit(), 0.1);
}

TEST_F(ValueHandlersTest, FindsByWhatIsAskedFor) {
  Row other = Sample("other-1");
  other.machine_id = "m2";
  other.part_id = "p2";
  other.verdict = "CONFORM";
  other.holes.resize(1);
  const std::string older = Put(), found = Put(other), newest = Put();
  const auto of_other = ElementsAre(found + " G1/H1/position", found + " G1/H1/inclination");
  EXPECT_THAT(Found([](auto* r) { r->set_blade("blades/other-1"); }), of_other);
  EXPECT_THAT(Found([](auto* r) { r->set_serial_prefix("oth"); }), of_other);
  EXPECT_THAT(Found([](auto* r) { r->set_machine("machines/m2"); }), of_other);
  EXPECT_THAT(Found([](auto* r) { r->set_part("parts/p2"); }), of_other);
  EXPECT_THAT(Found([](auto* r) { r->set_verdict(v1::VERDICT_CONFORM); }), of_other);
  EXPECT_THAT(Found([](auto* r) { r->set_verdict(v1::VERDICT_UNDECIDABLE); }), IsEmpty());
  EXPECT_THAT(Found([](auto* r) { r->mutable_recorded()->mutable_from()->set_seconds(4'000'000'000); }), IsEmpty());
  EXPECT_THAT(Found([](auto* r) { r->mutable_recorded()->mutable_until()->set_seconds(1'000'000'000); }), IsEmpty());
  EXPECT_THAT(Found([](auto* r) { r->set_characteristic("G1/H2"); }),
              ElementsAre(newest + " G1/H2/position", newest + " G1/H2/inclination", older + " G1/H2/position",
                          older + " G1/H2/inclination"));
  EXPECT_THAT(Found([](auto* r) {
                r->set_characteristic("G1/H2");
                r->set_only_newest(true);
              }),
              ElementsAre(newest + " G1/H2/position", newest + " G1/H2/inclination"));
  EXPECT_THAT(Found([](auto* r) { r->set_characteristic("G1/H2/position"); }),
              ElementsAre(newest + " G1/H2/position", older + " G1/H2/position"));
  EXPECT_THAT(Found([](auto* r) { r->set_characteristic("G1/H2/inclination"); }),
              ElementsAre(newest + " G1/H2/inclination", older + " G1/H2/inclination"));
  EXPECT_THAT(Found([](auto* r) { r->set_characteristic("G2/H2"); }), IsEmpty());
}

TEST_F(ValueHandlersTest, PagesAreOfWholeInspectionsAndATokenHoldsForItsFilters) {
  std::vector<std::string> names;
  for (int i = 0; i < 5; ++i) names.push_back(Put());
  v1::ListValuesRequest request;
  request.set_page_size(2);
  std::vector<std::string> seen;
  std::vector<int> sizes;
  do {
    const auto page = List(request);
    ASSERT_TRUE(page.ok()) << page.status();
    sizes.push_back(page->values_size());
    for (const v1::Value& value : page->values())
      if (seen.empty() || seen.back() != value.inspection()) seen.push_back(value.inspection());
    ASSERT_LE(seen.size(), names.size());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(sizes, ElementsAre(8, 8, 4));
  EXPECT_EQ(seen, std::vector<std::string>(names.rbegin(), names.rend()));

  request.set_page_token(List(request)->next_page_token());
  request.set_page_size(1);  // a page may have another size
  EXPECT_EQ(List(request)->values(0).inspection(), names[2]);
  request.set_serial_prefix("sn");  // and is of the same filters
  EXPECT_THAT(ViolationsOf(List(request).status()),
              ElementsAre(Violation{"page_token", request.page_token(),
                                    "the next_page_token of a page with the same filters"}));
}

// A part has hundreds of holes: without a characteristic a page is of 50 inspections at most.
TEST_F(ValueHandlersTest, WhatAPageIsOfIsBounded) {
  Row row = Sample();
  row.holes.resize(1);
  for (int i = 0; i < 51; ++i) Put(row);
  v1::ListValuesRequest request;
  request.set_page_size(1000);
  const auto all = List(request);
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_THAT(all->values(), SizeIs(2 * 50));
  EXPECT_FALSE(all->next_page_token().empty());
  request.set_characteristic("G1/H1/position");
  const auto one = List(request);
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_THAT(one->values(), SizeIs(51));
  EXPECT_THAT(one->next_page_token(), IsEmpty());
}

// Of 6,000 values each: the page ends with the inspection that makes it 10,000.
TEST_F(ValueHandlersTest, APageOfManyHolesEndsSooner) {
  Row row = Sample();
  for (int i = 2; i < 3000; ++i) {
    row.holes.push_back(row.holes.front());
    row.holes.back().hole_name = "H" + std::to_string(i + 1);
  }
  for (int i = 0; i < 3; ++i) Put(row);
  v1::ListValuesRequest request;
  const auto first = List(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_THAT(first->values(), SizeIs(12'000));
  request.set_page_token(first->next_page_token());
  const auto second = List(request);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_THAT(second->values(), SizeIs(6'000));
  EXPECT_THAT(second->next_page_token(), IsEmpty());
}

TEST_F(ValueHandlersTest, RefusesEachFieldByItsValueAndWhatIsWanted) {
  Put();
  const std::string id = "{id}, the id 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'";
  EXPECT_THAT(Refused([](auto* r) { r->set_blade("sn1"); }), ElementsAre(Violation{"blade", "sn1", "blades/" + id}));
  EXPECT_THAT(Refused([](auto* r) { r->set_machine("parts/p1"); }),
              ElementsAre(Violation{"machine", "parts/p1", "machines/" + id}));
  EXPECT_THAT(Refused([](auto* r) { r->set_part("parts/"); }), ElementsAre(Violation{"part", "parts/", "parts/" + id}));
  for (const char* text : {"G1", "/H1", "G1/", "G1/H1/", "G1/H1/depth", "//", "G1//position"})
    EXPECT_THAT(
        Refused([&](auto* r) { r->set_characteristic(text); }),
        ElementsAre(Violation{"characteristic", text, "group/hole/position, group/hole/inclination or group/hole"}));
  EXPECT_THAT(Refused([](auto* r) { r->mutable_recorded()->mutable_from()->set_seconds(2000); }),
              ElementsAre(Violation{"recorded.from.seconds", "2000", "a time in the years 2000 to 2199"}));
  EXPECT_THAT(Refused([](auto* r) {
                r->mutable_recorded()->mutable_from()->set_seconds(1'800'000'000);
                r->mutable_recorded()->mutable_until()->set_seconds(1'700'000'000);
              }),
              ElementsAre(Violation{"recorded.until", "1700000000 s", "not before recorded.from"}));
  EXPECT_THAT(Refused([](auto* r) { r->set_verdict(static_cast<v1::Verdict>(77)); }),
              ElementsAre(Violation{"verdict", "77", "a verdict, or none"}));
  EXPECT_THAT(Refused([](auto* r) { r->set_page_size(-1); }), ElementsAre(Violation{"page_size", "-1", "0 to 1000"}));
  EXPECT_THAT(
      Refused([](auto* r) { r->set_page_token("of another list"); }),
      ElementsAre(Violation{"page_token", "of another list", "the next_page_token of a page with the same filters"}));
  EXPECT_THAT(Refused([](auto* r) {
                r->set_blade("sn1");
                r->set_characteristic("G1");
                r->set_page_size(-1);
              }),
              SizeIs(3))
      << "all that is wrong is told at once";
}

TEST_F(ValueHandlersTest, TheStreamHasTheSamePagesAndGoesOnWhereItIsToldTo) {
  for (int i = 0; i < 5; ++i) Put();
  v1::ListValuesRequest request;
  request.set_page_size(2);
  const auto streamed = Download(request);
  ASSERT_TRUE(streamed.status.ok()) << streamed.status;
  ASSERT_THAT(streamed.messages, SizeIs(3));
  for (std::size_t i = 0; i < 3; ++i) {
    const auto page = List(request);
    ASSERT_TRUE(page.ok()) << page.status();
    EXPECT_EQ(streamed.messages[i].SerializeAsString(), page->SerializeAsString()) << i;
    request.set_page_token(page->next_page_token());
  }
  request.set_page_token(streamed.messages[0].next_page_token());
  const auto rest = Download(request);
  ASSERT_TRUE(rest.status.ok()) << rest.status;
  ASSERT_THAT(rest.messages, SizeIs(2));
  EXPECT_EQ(rest.messages[0].SerializeAsString(), streamed.messages[1].SerializeAsString());
  const auto none = Download(Asked([](auto* r) { r->set_blade("blades/sn2"); }));
  EXPECT_TRUE(none.status.ok()) << none.status;
  ASSERT_THAT(none.messages, SizeIs(1));
  EXPECT_THAT(none.messages[0].values(), IsEmpty());
}

TEST_F(ValueHandlersTest, SaysWhatTheStoreSaysAlsoInTheMiddleOfAStream) {
  for (int i = 0; i < 3; ++i) Put();
  v1::ListValuesRequest request;
  request.set_page_size(1);
  int read_count = 0;
  inspections_->BeforeList([&] {
    if (++read_count == 3) inspections_->Fail(absl::UnavailableError("database: away"));
  });
  const auto streamed = Download(request);
  EXPECT_EQ(streamed.status.code(), absl::StatusCode::kUnavailable) << streamed.status;
  EXPECT_THAT(std::string(streamed.status.message()), HasSubstr("database: away"));
  EXPECT_THAT(streamed.messages, SizeIs(2));  // what was read before is there
  for (const absl::Status& status : {List(request).status(), Download(request).status}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("database: away"));
  }
}

// A row of a newer release, after a step back to this one, or of a hand.
TEST_F(ValueHandlersTest, AWordThatThisReleaseDoesNotKnowIsDataLoss) {
  const std::vector<std::function<void(Row*)>> damages = {[](Row* row) { row->method = "GUESSED"; },
                                                          [](Row* row) { row->holes[1].position_verdict = "TORN"; },
                                                          [](Row* row) { row->holes[1].inclination_verdict = "TORN"; }};
  v1::ListValuesRequest request;
  request.set_page_size(1);
  for (std::size_t i = 0; i < damages.size(); ++i) {
    const std::string serial = "sn" + std::to_string(i);
    Row row = Sample(serial);
    damages[i](&row);
    const std::string name = Put(row);
    Put(Sample(serial));
    request.set_blade("blades/" + serial);
    const auto newest = List(request);
    ASSERT_TRUE(newest.ok()) << newest.status();
    const auto streamed = Download(request);
    request.set_page_token(newest->next_page_token());
    for (const absl::Status& status : {List(request).status(), streamed.status}) {
      EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
      EXPECT_THAT(std::string(status.message()), HasSubstr("inspection " + name.substr(12)));
    }
    EXPECT_THAT(streamed.messages, SizeIs(1));
    request.clear_page_token();
  }
}

// One hole an inspection, for ever.
class EndlessValues final : public storage::ValueReader {
 public:
  mutable std::atomic<bool> was_read_too_long{false};
  absl::StatusOr<std::vector<storage::HoleValuesRow>> Values(const storage::ValueFilter&, std::int64_t before_sequence,
                                                             int inspection_limit,
                                                             storage::Deadline deadline) const override {
    if (std::chrono::steady_clock::now() >= deadline) {
      was_read_too_long = true;
      return absl::DeadlineExceededError("of the test");
    }
    storage::HoleValuesRow row;
    row.sequence = before_sequence == 0 ? 1'000'000'000'000 : before_sequence;
    row.method = "SIX_POINT";
    row.position_verdict = row.inclination_verdict = "CONFORM";
    std::vector<storage::HoleValuesRow> rows;
    for (int i = 0; i < inspection_limit; ++i) {
      --row.sequence;
      rows.push_back(row);
    }
    return rows;
  }
};

TEST_F(ValueHandlersTest, NothingIsReadForAClientThatIsGone) {
  const auto endless = std::make_shared<EndlessValues>();
  ValueService service(endless);
  auto server = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{&service});
  const auto stub = v1::ValueService::NewStub(server->Connect());
  const auto context = runtime::ContextFor(20);  // the handler's deadline, too
  const auto reader = stub->DownloadValues(context.get(), {});
  v1::ListValuesResponse page;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(reader->Read(&page)) << i;
  context->TryCancel();
  while (reader->Read(&page)) continue;
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  server.reset();  // once the handler has ended
  EXPECT_FALSE(endless->was_read_too_long);
}

}  // namespace
}  // namespace sixpoint::inspection
