#include "services/gateway/files.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace sixpoint::gateway {
namespace {

namespace fs = std::filesystem;
namespace http = boost::beast::http;

class FilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/sixpoint-files-XXXXXX";
    folder_ = mkdtemp(name);
    Write("index.html", "<p>page");
    Write("assets/main-1.js", script_);
    fs::create_symlink("/etc/hostname", folder_ / "outside.txt");
  }
  void TearDown() override { fs::remove_all(folder_); }
  void Write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  std::optional<HttpResponse> Get(const std::string& path, const HttpHeaders& headers = {}) {
    Exchange::Head head;
    head.method(http::verb::get);
    for (const auto& [name, value] : headers) head.insert(name, value);
    return Files::Read(folder_).value().Answer(head, path);
  }
  static std::string Header(const HttpResponse& response, const std::string& name) {
    for (const auto& [has, value] : response.headers)
      if (has == name) return value;
    return "";
  }
  fs::path folder_;
  const std::string script_{std::string(5000, 'x')};
};

TEST_F(FilesTest, AreServedAsTheyWereBuilt) {
  EXPECT_EQ(Get("/")->body, "<p>page");
  EXPECT_EQ(Header(*Get("/"), "Cache-Control"), "no-cache");
  const auto plain = Get("/assets/main-1.js");
  EXPECT_EQ(plain->body, script_);
  EXPECT_EQ(Header(*plain, "Content-Encoding"), "");
  EXPECT_EQ(Header(*plain, "Cache-Control"), "public, max-age=31536000, immutable");
  auto squeezed = Get("/assets/main-1.js", {{"Accept-Encoding", "br, gzip"}});
  EXPECT_LT(squeezed->body.size(), script_.size() / 10);
  z_stream stream{};
  ASSERT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  std::string opened(script_.size() + 10, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(squeezed->body.data());
  stream.avail_in = static_cast<uInt>(squeezed->body.size());
  stream.next_out = reinterpret_cast<Bytef*>(opened.data());
  stream.avail_out = static_cast<uInt>(opened.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  inflateEnd(&stream);
  opened.resize(stream.total_out);
  EXPECT_EQ(opened, script_);
  EXPECT_EQ(Header(*squeezed, "Content-Encoding"), "gzip");
  const auto again = Get("/assets/main-1.js", {{"If-None-Match", Header(*plain, "ETag")}});
  EXPECT_EQ(again->status, 304u);
  EXPECT_EQ(again->body, "");
}

TEST_F(FilesTest, ThePageKnowsItsOwnPaths) {
  EXPECT_EQ(Get("/blades/SN-1", {{"Accept", "text/html,*/*"}})->body, "<p>page");
  EXPECT_FALSE(Get("/blades/SN-1", {{"Accept", "application/json"}}));
  EXPECT_FALSE(Get("/assets/gone.js", {{"Accept", "text/html"}}));
}

TEST_F(FilesTest, NothingOutsideIsServed) {
  for (const char* const path :
       {"/outside.txt", "/../etc/hostname", "/assets/../../etc/hostname", "/assets/other.js", ""})
    EXPECT_FALSE(Get(path)) << path;
}

TEST_F(FilesTest, AFolderWithoutAPageIsRefused) {
  fs::remove(folder_ / "index.html");
  EXPECT_TRUE(absl::IsInvalidArgument(Files::Read(folder_).status()));
  EXPECT_FALSE(Files::Read(folder_ / "none").ok());
}

}  // namespace
}  // namespace sixpoint::gateway
