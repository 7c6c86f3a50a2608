// What DrawingStores do, PostgreSQL's and the fake that handlers are tested on.
#include "storage/drawing_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/support/fake_plant_stores.h"
#include "tests/support/registered.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Each test runs on both, with parts p1 and p2.
void OnBothDrawingStores(const std::function<void(DrawingStore* drawings)>& test) {
  {
    SCOPED_TRACE("the fake");
    test(sixpoint::testing::FakePlantStores().drawings.get());
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  for (const char* id : {"p1", "p2"}) sixpoint::testing::RegisterPart(*transaction, id);
  ASSERT_TRUE(transaction->Commit().ok());
  test(DrawingsIn(database.database()).get());
}

DrawingRow Drawing(const std::string& id, const std::string& part, char content) {
  DrawingRow row;
  row.drawing_id = id;
  row.content_sha256 = std::string(64, content);
  row.part_id = part;
  row.part_revisions = {1};
  row.drawing_number = "4711";
  row.drawing_revision = "C";
  row.part_number = "69-1";
  row.part_name = "vane";
  row.requested_by = "users/maker";
  row.decision_rule = {"SIMPLE_ACCEPTANCE", "", std::nullopt};
  row.datum_systems = {{"A", "BEST_FIT", "", {{"A", {}}}}};
  CharacteristicRow& elsewhere = row.characteristics.emplace_back();
  elsewhere.characteristic = "1";
  elsewhere.name = "bore";
  elsewhere.requirement = "8 +-0.1";
  elsewhere.reference_location = "sheet 1";
  elsewhere.characteristic_class = "MAJOR";
  elsewhere.quantity = "MEASURED_ELSEWHERE";
  elsewhere.unit = "MM";
  elsewhere.nominal = 8;
  elsewhere.lower_limit = 7.9;
  elsewhere.upper_limit = 8.1;
  return row;
}

absl::StatusOr<DrawingRow> Recorded(DrawingStore* drawings, const DrawingRow& row, const std::string& request_id = "",
                                    const std::string& bytes = "request") {
  RecordEntry entry;
  entry.inputs = {"parts/" + row.part_id + "@1"};
  entry.software_version = "test";
  return drawings->Record({"plant.CreateDrawing", request_id, bytes}, row, entry, Soon());
}

TEST(DrawingStore, AnotherDescriptionIsANewRevisionAndTheSameIsNot) {
  OnBothDrawingStores([](DrawingStore* drawings) {
    const auto first = Recorded(drawings, Drawing("d", "p1", '0'), kSomeUuid);
    ASSERT_TRUE(first.ok()) << first.status();
    EXPECT_EQ(first->revision, 1);
    EXPECT_EQ(first->characteristic_count, 1);
    EXPECT_EQ(Recorded(drawings, Drawing("d", "p1", '0'))->recorded.sequence, first->recorded.sequence);
    EXPECT_EQ(Recorded(drawings, Drawing("d", "p1", 'b'))->revision, 2);
    EXPECT_EQ(Recorded(drawings, Drawing("d", "p1", '0'), kSomeUuid)->revision, 1) << "the kept answer";
    EXPECT_TRUE(absl::IsAlreadyExists(Recorded(drawings, Drawing("d", "p1", '0'), kSomeUuid, "other").status()));
    const auto newest = drawings->Find("d", 0, Soon()), before = drawings->Find("d", 1, Soon());
    ASSERT_TRUE(newest.ok() && before.ok());
    EXPECT_EQ((*newest)->revision, 2);
    EXPECT_EQ((*before)->content_sha256, std::string(64, '0'));
    ASSERT_EQ((*before)->characteristics.size(), 1u);
    EXPECT_EQ((*before)->characteristics[0].upper_limit, 8.1);
    EXPECT_FALSE((*drawings->Find("d", 3, Soon())).has_value());
    EXPECT_FALSE((*drawings->Find("none", 0, Soon())).has_value());
  });
}

TEST(DrawingStore, WhoSaysWhatHeRevisesIsHeldToIt) {
  OnBothDrawingStores([](DrawingStore* drawings) {
    DrawingRow row = Drawing("d", "p1", '0');
    const auto revising = [&](int newest, char content) {
      row.revises = newest;
      row.content_sha256 = std::string(64, content);
      return Recorded(drawings, row).status();
    };
    EXPECT_THAT(std::string(revising(1, 'a').message()), HasSubstr("revises: 1, want 0"));
    EXPECT_TRUE(revising(0, 'a').ok());
    EXPECT_THAT(std::string(revising(0, 'b').message()), HasSubstr("revises: 0, want 1"));
    EXPECT_TRUE(absl::IsInvalidArgument(revising(0, 'b')));
    EXPECT_TRUE(revising(1, 'b').ok());
  });
}

TEST(DrawingStore, IsOfOnePartForEverAndListedByIt) {
  OnBothDrawingStores([](DrawingStore* drawings) {
    for (const auto& [id, part] : {std::pair("b", "p1"), {"a", "p1"}, {"c", "p2"}})
      ASSERT_TRUE(Recorded(drawings, Drawing(id, part, '0')).ok());
    const absl::Status other = Recorded(drawings, Drawing("b", "p2", '1')).status();
    EXPECT_TRUE(absl::IsAlreadyExists(other)) << other;
    EXPECT_THAT(std::string(other.message()), HasSubstr("want parts/p1"));
    const auto ids = [&](const std::string& part, const std::string& after, int limit) {
      RegisteredFilter filter;
      filter.part_id = part;
      filter.reader = Reader::Everything();
      const auto listed = drawings->List(filter, after, limit, Soon());
      EXPECT_TRUE(listed.ok()) << listed.status();
      std::vector<std::string> found;
      for (const DrawingRow& row : *listed) {
        found.push_back(row.drawing_id);
        EXPECT_EQ(row.characteristic_count, 1);
        EXPECT_THAT(row.characteristics, IsEmpty()) << "lists leave them out";
      }
      return found;
    };
    EXPECT_THAT(ids("", "", 9), ElementsAre("a", "b", "c"));
    EXPECT_THAT(ids("p1", "", 9), ElementsAre("a", "b"));
    EXPECT_THAT(ids("p1", "a", 9), ElementsAre("b"));
    EXPECT_THAT(ids("", "", 1), ElementsAre("a"));
  });
}

}  // namespace
}  // namespace sixpoint::storage
