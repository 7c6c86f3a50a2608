// The drawing service's handlers on fake stores: no PostgreSQL. What a description has to hold is in drawing_refusals_test.cc.
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "services/plant/drawing_service.h"
#include "services/runtime/errors.h"
#include "tests/services/plant/sample_drawing.h"
#include "tests/support/call.h"
#include "tests/support/fake_plant_stores.h"
#include "tests/support/in_process_server.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::plant {
namespace {

using google::protobuf::util::MessageDifferencer;
using sixpoint::testing::Call;
using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DrawingHandlersTest : public ::testing::Test {
 protected:
  using Stub = v1::DrawingService::Stub;
  void SetUp() override { RegisterVane(stores_); }
  absl::StatusOr<v1::Drawing> Create(const v1::CreateDrawingRequest& request) {
    return Call(*stub_, &Stub::CreateDrawing, request);
  }
  absl::StatusOr<v1::Drawing> Show(const std::string& name) {
    v1::GetDrawingRequest request;
    request.set_name(name);
    return Call(*stub_, &Stub::GetDrawing, request);
  }

  testing::FakePlantStores stores_;
  DrawingService service_{stores_.drawings, stores_.parts};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::DrawingService::NewStub(server_.Connect());
};

TEST_F(DrawingHandlersTest, ADrawingIsRecordedWithWhatItRestsOnAndReadBack) {
  v1::CreateDrawingRequest request = SampleDrawing();
  request.set_request_id(kSomeUuid);
  const auto made = Create(request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->revision(), 1);
  EXPECT_EQ(made->characteristics_size(), request.drawing().characteristics_size());
  const storage::RecordEntry entry = stores_.record->entries().back().entry;
  EXPECT_EQ(entry.name, "drawings/vane-70@1");
  EXPECT_THAT(entry.inputs, ElementsAre("parts/vane@1", "parts/vane@2"));
  EXPECT_TRUE(MessageDifferencer::Equals(*Show("drawings/vane-70"), *made));
  EXPECT_TRUE(MessageDifferencer::Equals(*Show("drawings/vane-70@1"), *made));
  EXPECT_EQ(runtime::ReasonOf(Show("drawings/vane-70@2").status()), "DRAWING_NOT_FOUND");

  v1::CreateDrawingRequest next = SampleDrawing();
  next.mutable_drawing()->set_drawing_revision("D");
  next.set_revises(1);
  EXPECT_EQ(Create(next)->revision(), 2);
  EXPECT_TRUE(MessageDifferencer::Equals(*Create(request), *made)) << "a retry has the kept answer";
  next.mutable_drawing()->set_drawing_revision("E");
  EXPECT_THAT(std::string(Create(next).status().message()), HasSubstr("revises: 1, want 2"));
}

TEST_F(DrawingHandlersTest, IsHeldToEachRevisionOfThePart) {
  v1::CreateDrawingRequest request = SampleDrawing();
  request.mutable_drawing()->add_part_revisions(3);  // G1 is another there
  const absl::Status other = Create(request).status();
  EXPECT_TRUE(absl::IsInvalidArgument(other)) << other;
  request = SampleDrawing();
  request.mutable_drawing()->add_part_revisions(9);
  EXPECT_THAT(std::string(Create(request).status().message()), HasSubstr("drawing.part_revisions[2]: 9"));
  request = SampleDrawing();
  request.mutable_drawing()->set_part("parts/none");
  EXPECT_EQ(runtime::ReasonOf(Create(request).status()), "PART_NOT_FOUND");
  EXPECT_EQ(runtime::ReasonOf(Show("drawings/vane-70").status()), "DRAWING_NOT_FOUND") << "nothing is recorded";
}

TEST_F(DrawingHandlersTest, ListsLeaveCharacteristicsOutUnlessAsked) {
  ASSERT_TRUE(Create(SampleDrawing()).ok());
  v1::ListDrawingsRequest list;
  list.set_part("parts/vane");
  const auto slim = Call(*stub_, &Stub::ListDrawings, list);
  ASSERT_TRUE(slim.ok()) << slim.status();
  ASSERT_EQ(slim->drawings_size(), 1);
  EXPECT_EQ(slim->drawings(0).characteristics_size(), 0);
  EXPECT_EQ(slim->drawings(0).characteristic_count(), SampleDrawing().drawing().characteristics_size());
  list.set_view(list::v1::VIEW_FULL);
  EXPECT_TRUE(
      MessageDifferencer::Equals(Call(*stub_, &Stub::ListDrawings, list)->drawings(0), *Show("drawings/vane-70")));
  list.set_part("parts/disc");
  EXPECT_EQ(Call(*stub_, &Stub::ListDrawings, list)->drawings_size(), 0);
}

TEST_F(DrawingHandlersTest, SaysWhatTheStoreSays) {
  stores_.record->Fail(absl::UnavailableError("database: away"));
  EXPECT_TRUE(absl::IsUnavailable(Create(SampleDrawing()).status()));
  EXPECT_TRUE(absl::IsUnavailable(Show("drawings/vane-70").status()));
  EXPECT_TRUE(absl::IsUnavailable(Call(*stub_, &Stub::ListDrawings, v1::ListDrawingsRequest()).status()));
}

}  // namespace
}  // namespace sixpoint::plant
