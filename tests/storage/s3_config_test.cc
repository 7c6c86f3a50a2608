#include "storage/s3_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

namespace sixpoint::storage {
namespace {

using ::testing::HasSubstr;

class S3ConfigTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& text, mode_t mode = 0600) {
    const std::string path = ::testing::TempDir() + "/sixpoint-s3-config.yaml";
    std::ofstream(path) << text;
    chmod(path.c_str(), mode);
    return path;
  }
  const std::string whole_ =
      "endpoint: http://objects:8000\nbucket: clouds\naccess_key: plant\nsecret_key: whispered\nconnect_timeout_s: "
      "1.5\n";
};

TEST_F(S3ConfigTest, ReadsWhatIsThereAndKeepsDefaults) {
  const auto config = ReadS3Config(Write(whole_));
  ASSERT_TRUE(config.ok()) << config.status();
  EXPECT_EQ(config->endpoint, "http://objects:8000");
  EXPECT_EQ(config->secret_key, "whispered");
  EXPECT_EQ(config->region, "us-east-1");
  EXPECT_EQ(config->connect_timeout.count(), 1500);
  EXPECT_EQ((*OpenBlobStore("s3://" + Write(whole_)))->name(), "s3");
  EXPECT_EQ((*OpenBlobStore("s3://" + Write(whole_ + "new_blobs: postgresql\n")))->name(), "postgresql");
  EXPECT_EQ((*OpenBlobStore("postgresql"))->name(), "postgresql");
}

TEST_F(S3ConfigTest, TheEnvironmentGivesKeysThatTheFileNeedNotHold) {
  const std::string path = Write("endpoint: https://objects\nbucket: clouds\n");
  EXPECT_THAT(std::string(ReadS3Config(path).status().message()), HasSubstr("SIXPOINT_S3_ACCESS_KEY"));
  setenv("SIXPOINT_S3_ACCESS_KEY", "plant", 1);
  setenv("SIXPOINT_S3_SECRET_KEY", "whispered", 1);
  EXPECT_EQ(ReadS3Config(path)->secret_key, "whispered");
  unsetenv("SIXPOINT_S3_ACCESS_KEY");
  unsetenv("SIXPOINT_S3_SECRET_KEY");
}

TEST_F(S3ConfigTest, RefusalsNameTheKeyAndNeverTheSecret) {
  const std::pair<std::string, std::string> refused[] = {
      {"endpoint: ftp://objects\nbucket: clouds\nsecret_key: whispered\n", "endpoint: ftp://objects"},
      {"endpoint: http://objects/deep\nbucket: clouds\nsecret_key: whispered\n", "endpoint: http://objects/deep"},
      {"endpoint: http://objects\nbucket: Clouds!\nsecret_key: whispered\n", "bucket: Clouds!"},
      {whole_ + "conect_timeout_s: 3\n", "conect_timeout_s: unknown"},
      {whole_ + "request_timeout_s: 0\n", "request_timeout_s: 0"},
      {whole_ + "new_blobs: tape\n", "new_blobs: tape"},
      {whole_ + "region: [1]\n", "region: not one value"},
      {"secret_key: {whispered", "cannot be read as YAML"},
  };
  for (const auto& [text, wanted] : refused) {
    const absl::Status status = ReadS3Config(Write(text)).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(wanted));
    EXPECT_THAT(std::string(status.message()), ::testing::Not(HasSubstr("whispered")));
  }
  EXPECT_THAT(std::string(ReadS3Config(Write(whole_, 0644)).status().message()), HasSubstr("everybody may read it"));
  EXPECT_FALSE(OpenBlobStore("s3").ok());
  EXPECT_FALSE(OpenBlobStore("s3:///nowhere/at/all").ok());
}

}  // namespace
}  // namespace sixpoint::storage
