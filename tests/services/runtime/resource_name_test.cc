#include "services/runtime/resource_name.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::runtime {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ResourceName, NameAndIdAreInverse) {
  for (const std::string& id : {std::string("s1"), std::string("A-b_c.9"), std::string(64, 'x')}) {
    const absl::StatusOr<std::string> back = IdOf("name", "scans", NameOf("scans", id));
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(*back, id);
  }
}

TEST(ResourceName, RefusesOthersAndSaysFieldValueAndWanted) {
  for (const std::string& name :
       {std::string(), std::string("scans/"), std::string("s1"), std::string("scan/s1"), std::string("scans/a b"),
        std::string("scans/a/b"), std::string("scans/../x"), std::string("scans/.."), std::string("scans/.x"),
        std::string("scans/s1@2"), "scans/" + std::string(65, 'x'), std::string("scans/\xc3\xa9"),
        std::string("scans/a\0b", 9), std::string("/scans/s1"), std::string("Scans/s1")}) {
    const absl::Status refused = IdOf("request.name", "scans", name).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << name;
    EXPECT_THAT(std::string(refused.message()), AllOf(HasSubstr("request.name: "), HasSubstr("want scans/{id}")));
  }
  EXPECT_THAT(std::string(CheckId("scan_id", "a b").message()), AllOf(HasSubstr("scan_id: a b"), HasSubstr("want ")));
  EXPECT_TRUE(CheckId("scan_id", "V1-airfoil_0.9").ok());
}

TEST(ResourceName, ANameMaySayItsRevision) {
  const absl::StatusOr<RevisedId> third = RevisedIdOf("name", "parts", "parts/vane@3");
  ASSERT_TRUE(third.ok()) << third.status();
  EXPECT_EQ(third->id, "vane");
  EXPECT_EQ(third->revision, 3);
  const absl::StatusOr<RevisedId> newest = RevisedIdOf("name", "parts", "parts/vane");
  ASSERT_TRUE(newest.ok()) << newest.status();
  EXPECT_EQ(newest->revision, 0);
  for (const char* name : {"parts/vane@", "parts/vane@0", "parts/vane@03", "parts/vane@-1", "parts/vane@x",
                           "parts/vane@1@2", "parts/vane@1234567890", "parts/@1", "machines/vane@1", "parts/vane@1 "}) {
    const absl::Status refused = RevisedIdOf("name", "parts", name).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << name;
  }
}

TEST(ResourceName, AnyNameOfTheJournalPasses) {
  for (const char* name : {"machines/m1@2", "scans/s1", "withdrawals/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e"})
    EXPECT_TRUE(CheckName("name", name).ok()) << name;
  for (const char* name : {"", "/s1", "scans", "scans/", "Scans/s1", "sc ans/s1", "scans/s1@x", "scans/a/b"})
    EXPECT_EQ(CheckName("name", name).code(), absl::StatusCode::kInvalidArgument) << name;
}

TEST(ResourceName, UuidsAreChecked) {
  EXPECT_TRUE(CheckUuid("request_id", "").ok());
  EXPECT_TRUE(CheckUuid("request_id", "018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e").ok());
  for (const char* uuid : {"018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6", "018f6f3e07c1a-7e5b-9d5a-2f1c3b4a5d6e",
                           "g18f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e", "x"}) {
    EXPECT_THAT(std::string(CheckUuid("request_id", uuid).message()), HasSubstr("request_id: ")) << uuid;
  }
}

}  // namespace
}  // namespace sixpoint::runtime
