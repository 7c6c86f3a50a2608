// Drawings over real gRPC on a real PostgreSQL: recorded, revised, found, listed.
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <thread>

#include "services/plant/quantity_rules.h"
#include "sixpoint/registration/v1/method.pb.h"
#include "tests/services/plant/drawing_service_fixture.h"
#include "tests/support/registered.h"

namespace sixpoint::plant {
namespace {

using google::protobuf::util::MessageDifferencer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using DrawingStub = v1::DrawingService::Stub;

TEST_F(DrawingServiceTest, ADrawingComesBackBitForBit) {
  const v1::CreateDrawingRequest request = SampleDrawing();
  ASSERT_EQ(request.drawing().characteristics_size(), v1::CharacteristicQuantity_descriptor()->value_count() - 1);
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_EQ(created->name(), "drawings/vane-70");
  EXPECT_EQ(created->revision(), 1);
  EXPECT_EQ(created->characteristic_count(), request.drawing().characteristics_size());
  EXPECT_FALSE(created->requested_by().empty());
  const auto read = Show("drawings/vane-70");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(MessageDifferencer::Equals(*created, *read)) << read->DebugString();
  v1::Drawing described = *read;
  described.clear_name();
  described.clear_revision();
  described.clear_created_at();
  described.clear_requested_by();
  described.clear_characteristic_count();
  EXPECT_TRUE(MessageDifferencer::Equals(described, request.drawing())) << described.DebugString();
}

TEST_F(DrawingServiceTest, AnotherDescriptionIsAnotherRevisionAndTheSameIsNot) {
  v1::CreateDrawingRequest request = SampleDrawing();
  const auto first = Create(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(Create(request)->revision(), 1);
  request.mutable_drawing()->set_revision(7);  // the server's to say
  EXPECT_EQ(Create(request)->revision(), 1);
  request.mutable_drawing()->set_drawing_revision("D");
  Of(&request, kPosition)->set_upper_limit(50);
  const auto second = Create(request);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->revision(), 2);
  EXPECT_TRUE(MessageDifferencer::Equals(*Show("drawings/vane-70@1"), *first)) << "the first one stays";
  EXPECT_EQ(Show("drawings/vane-70")->drawing_revision(), "D");
  EXPECT_EQ(Show("drawings/vane-70@3").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Show("parts/vane").status().code(), absl::StatusCode::kInvalidArgument);
}

// Two who revise the same one do not overwrite each other.
TEST_F(DrawingServiceTest, WhoSaysWhatHeRevisesIsHeldToIt) {
  v1::CreateDrawingRequest request = SampleDrawing();
  request.set_revises(1);
  EXPECT_THAT(std::string(Create(request).status().message()), HasSubstr("revises: 1, want 0: drawings/vane-70"));
  request.set_revises(0);
  ASSERT_TRUE(Create(request).ok());
  request.mutable_drawing()->set_drawing_revision("D");
  EXPECT_THAT(std::string(Create(request).status().message()), HasSubstr("revises: 0, want 1"));
  request.set_revises(1);
  EXPECT_EQ(Create(request)->revision(), 2);
  request.mutable_drawing()->set_drawing_revision("E");
  EXPECT_THAT(std::string(Create(request).status().message()), HasSubstr("revises: 1, want 2"));
  request.set_revises(-3);
  EXPECT_THAT(std::string(Create(request).status().message()), HasSubstr("revises: -3"));
}

TEST_F(DrawingServiceTest, TheSameRequestAgainGivesTheSameAnswer) {
  v1::CreateDrawingRequest request = SampleDrawing();
  request.set_request_id("018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e");
  const auto first = Create(request);
  ASSERT_TRUE(first.ok()) << first.status();
  v1::CreateDrawingRequest other = SampleDrawing();
  other.mutable_drawing()->set_drawing_revision("D");
  ASSERT_TRUE(Create(other).ok());
  EXPECT_TRUE(MessageDifferencer::Equals(*Create(request), *first));
  request.mutable_drawing()->set_drawing_revision("E");
  EXPECT_EQ(Create(request).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(DrawingServiceTest, ManyAtOnceMakeARevisionEach) {
  std::vector<std::thread> clients;
  for (int i = 0; i < 6; ++i)
    clients.emplace_back([this, i] {
      v1::CreateDrawingRequest request = SampleDrawing();
      request.mutable_drawing()->set_drawing_revision("D" + std::to_string(i));
      const auto created = Create(request);
      EXPECT_TRUE(created.ok()) << created.status();
    });
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(Show("drawings/vane-70")->revision(), 6);
}

TEST_F(DrawingServiceTest, ADrawingIsOfOnePartForEver) {
  ASSERT_TRUE(Create(SampleDrawing()).ok());
  auto transaction = database_.database()->Begin(testing::Soon());
  testing::RegisterPart(*transaction, "disc");
  ASSERT_TRUE(transaction->Commit().ok());
  v1::CreateDrawingRequest request;
  request.set_drawing_id("vane-70");
  *request.mutable_drawing() = SampleDrawing().drawing();
  v1::Drawing& drawing = *request.mutable_drawing();
  drawing.set_part("parts/disc");
  drawing.clear_part_revisions();
  drawing.add_part_revisions(1);
  drawing.clear_datum_systems();
  drawing.clear_sections();
  drawing.clear_regions();
  drawing.clear_characteristics();
  *drawing.add_characteristics() = *Of(std::make_unique<v1::CreateDrawingRequest>(SampleDrawing()).get(), kElsewhere);
  const auto created = Create(request);
  EXPECT_EQ(created.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(created.status().message()), HasSubstr("want parts/vane"));
  request.set_drawing_id("disc-1");
  EXPECT_TRUE(Create(request).ok()) << Create(request).status();
}

TEST_F(DrawingServiceTest, ListsAreByIdAndByPart) {
  v1::CreateDrawingRequest request = SampleDrawing();
  for (const char* id : {"b", "a", "c"}) {
    request.set_drawing_id(id);
    ASSERT_TRUE(Create(request).ok());
  }
  v1::ListDrawingsRequest list;
  list.set_page_size(2);
  list.set_part("parts/vane");
  auto page = Call(&DrawingStub::ListDrawings, list);
  ASSERT_TRUE(page.ok()) << page.status();
  ASSERT_EQ(page->drawings_size(), 2);
  EXPECT_EQ(page->drawings(0).name(), "drawings/a");
  EXPECT_EQ(page->drawings(0).characteristics_size(), 0);
  EXPECT_EQ(page->drawings(0).characteristic_count(), request.drawing().characteristics_size());
  EXPECT_THAT(page->drawings(0).part_revisions(), ElementsAre(1, 2));
  list.set_page_token(page->next_page_token());
  page = Call(&DrawingStub::ListDrawings, list);
  ASSERT_EQ(page->drawings_size(), 1);
  EXPECT_EQ(page->next_page_token(), "");
  list.clear_page_token();
  list.set_view(list::v1::VIEW_FULL);
  page = Call(&DrawingStub::ListDrawings, list);
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_EQ(page->drawings(0).SerializeAsString(), Show("drawings/a")->SerializeAsString());
  list.clear_view();
  list.set_part("parts/disc");
  EXPECT_EQ(Call(&DrawingStub::ListDrawings, list)->drawings_size(), 0);
  list.set_part("vane");
  EXPECT_EQ(Call(&DrawingStub::ListDrawings, list).status().code(), absl::StatusCode::kInvalidArgument);
}

// Characteristics of another revision: each that does not fit is told, with what is there instead.
// What the checks let through and the table does not would be an INTERNAL.
TEST_F(DrawingServiceTest, EveryQuantityHasARule) {
  const auto* const all = v1::CharacteristicQuantity_descriptor();
  for (int i = 1; i < all->value_count(); ++i) {
    const std::string word = all->value(i)->name().substr(std::string("CHARACTERISTIC_QUANTITY_").size());
    EXPECT_EQ(RuleOf(word).quantity, word);
  }
}

// As the contract says of them.
TEST_F(DrawingServiceTest, PositioningsAreTheMethodsOfRegistrations) {
  const auto* const all = v1::DatumPositioning_descriptor();
  for (int i = 0; i < all->value_count(); ++i) {
    const std::string word = all->value(i)->name().substr(std::string("DATUM_POSITIONING_").size());
    registration::v1::Method method = registration::v1::METHOD_UNSPECIFIED;
    ASSERT_TRUE(registration::v1::Method_Parse("METHOD_" + word, &method)) << word;
    EXPECT_EQ(static_cast<int>(method), all->value(i)->number()) << word;
  }
}

TEST_F(DrawingServiceTest, ManyCharacteristicsAreOneDrawing) {
  v1::CreateDrawingRequest request = SampleDrawing();
  const v1::Characteristic one = *Of(&request, kPosition);
  for (int i = request.drawing().characteristics_size(); i < 2000; ++i) {
    v1::Characteristic& more = *request.mutable_drawing()->add_characteristics();
    more = one;
    more.set_characteristic("M" + std::to_string(i));
  }
  const auto created = Create(request);
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_EQ(Show("drawings/vane-70")->characteristics_size(), 2000);
}

}  // namespace
}  // namespace sixpoint::plant
