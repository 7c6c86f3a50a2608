#include "cli/plant_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

TEST(DataFolderLock, IsOneAtATime) {
  std::string folder = (fs::temp_directory_path() / "sixpoint-lock-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  std::optional<absl::StatusOr<DataFolderLock>> first = DataFolderLock::Take(folder);
  ASSERT_TRUE(first->ok()) << first->status();
  const absl::Status second = DataFolderLock::Take(folder).status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.message()), ::testing::HasSubstr("another `sixpoint` is at work on it"));
  first.reset();
  EXPECT_TRUE(DataFolderLock::Take(folder).ok());
  fs::remove_all(folder);
  EXPECT_FALSE(DataFolderLock::Take(folder).ok());
}

}  // namespace
}  // namespace sixpoint::cli
