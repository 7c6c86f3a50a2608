// The shipped configuration of a proxy, as it stands but for its names, ports and files, in front of the real gateway.
#include <filesystem>
#include <fstream>

#include "tests/end_to_end/door.h"
#include "tests/end_to_end/plant_on_this_machine.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class Proxied : public Door {
 protected:
  void SetUp() override {
    if (!fs::exists("/usr/sbin/nginx")) GTEST_SKIP() << "SKIPPED: no nginx here (deploy/install_packages tests)";
    Door::SetUp();
    folder_ = fs::path(plant_.folder()) / "nginx";
    fs::create_directories(folder_ / "web");
    std::ofstream(folder_ / "web" / "index.html") << "<p>page";
    gateway_ = std::make_unique<Process>(GatewayCommand(port_, folder_ / "web"), (folder_ / "gateway.log").string());
    ShellOutput(
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=plant.example -addext "
        "subjectAltName=DNS:plant.example -keyout " +
        (folder_ / "key.pem").string() + " -out " + (folder_ / "house.pem").string());
    std::ofstream(folder_ / "nginx.conf")
        << (geteuid() == 0 ? "user root;\n" : "")  // as whom it runs is the house's
        << "daemon off;\npid " << (folder_ / "pid").string() << ";\nerror_log " << (folder_ / "error.log").string()
        << ";\nevents {}\nhttp {\naccess_log off;\nclient_body_temp_path " << (folder_ / "body").string()
        << ";\nproxy_temp_path " << (folder_ / "proxy").string() << ";\nfastcgi_temp_path "
        << (folder_ / "fastcgi").string() << ";\nuwsgi_temp_path " << (folder_ / "uwsgi").string()
        << ";\nscgi_temp_path " << (folder_ / "scgi").string() << ";\n"
        << Shipped() << "}\n";
    nginx_ =
        std::make_unique<Process>(std::vector<std::string>{"/usr/sbin/nginx", "-c", (folder_ / "nginx.conf").string()},
                                  (folder_ / "nginx.log").string());
    for (const auto end = Within(20);
         Fetch("/health/live").find("ok") == std::string::npos && std::chrono::system_clock::now() < end;) {
      ASSERT_EQ(nginx_->Poll(), -1) << "nginx ended: " << ReadFile((folder_ / "nginx.log").string())
                                    << ReadFile((folder_ / "error.log").string());
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  void TearDown() override {
    if (HasFailure())
      for (const char* log : {"nginx.log", "error.log"})
        std::printf("%s: %s\n", log, ReadFile((folder_ / log).string()).c_str());
    Door::TearDown();
  }
  std::string Shipped() const {
    std::string text = ReadFile(std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/deploy/nginx/sixpoint.conf");
    const auto change = [&text](const std::string& from, const std::string& to) {
      EXPECT_NE(text.find(from), std::string::npos) << from;
      for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    };
    change("127.0.0.1:7480", "127.0.0.1:" + std::to_string(port_));
    change("listen 443 ", "listen 127.0.0.1:" + std::to_string(tls_port_) + " ");
    change("listen 80;", "listen 127.0.0.1:" + std::to_string(plain_port_) + ";");
    change("/etc/ssl/plant.example.pem", (folder_ / "house.pem").string());
    change("/etc/ssl/private/plant.example.key", (folder_ / "key.pem").string());
    return text;
  }
  std::string Fetch(const std::string& path, const std::string& words = "") const {
    const std::string at = std::to_string(tls_port_);
    return ShellOutput("curl -sS -i --noproxy '*' --max-time 20 --cacert " + (folder_ / "house.pem").string() +
                       " --connect-to plant.example:443:127.0.0.1:" + at + " " + words + " 'https://plant.example" +
                       path + "'");
  }

  const std::vector<int> ports_ = FreePorts(3);
  const int port_ = ports_[0], tls_port_ = ports_[1], plain_port_ = ports_[2];
  fs::path folder_;
  std::unique_ptr<Process> gateway_, nginx_;
};

TEST_F(Proxied, ByHttp2AndTlsOfTheHouse) {
  const std::string page = Fetch("/");
  EXPECT_THAT(page, HasSubstr("HTTP/2 200"));
  EXPECT_THAT(page, HasSubstr("<p>page"));
  EXPECT_THAT(page, HasSubstr("strict-transport-security: max-age"));
  EXPECT_THAT(page, HasSubstr("content-security-policy: default-src 'none'"));
  EXPECT_THAT(Fetch("/session"), HasSubstr("{}"));
  // The client's own word about where it is counts for nothing; its way is encrypted, and the cookie is for such ways alone.
  const std::string wrong = Fetch(
      "/session",
      R"(-H 'X-Forwarded-Proto: http' -H 'X-Forwarded-For: 10.9.8.7' --data '{"name": "users/x", "password": "none of that name"}')");
  EXPECT_THAT(wrong, HasSubstr("SIGN_IN_REFUSED"));
  EXPECT_THAT(plant_.Logs(), Not(HasSubstr("10.9.8.7")));
  // Own origin and others'.
  EXPECT_THAT(Fetch("/session", "-H 'Origin: https://plant.example'"), HasSubstr("HTTP/2 200"));
  EXPECT_THAT(Fetch("/session", "-H 'Origin: https://evil.example'"), HasSubstr("HTTP/2 403"));
  EXPECT_THAT(ShellOutput("curl -sS -i --max-time 10 -H 'Host: plant.example' http://127.0.0.1:" +
                          std::to_string(plain_port_) + "/x"),
              HasSubstr("Location: https://plant.example/x"));

  // A person who signs in, a call, and a stream that is heard as it comes.
  CreateAccount("jane", access::v1::ROLE_ENGINEER);
  const std::string jar = "-c " + (folder_ / "jar").string() + " -b " + (folder_ / "jar").string();
  const std::string signed_in =
      Fetch("/session", jar + R"( --data '{"name": "users/jane", "password": "correct horse battery staple"}')");
  EXPECT_THAT(signed_in, HasSubstr("set-cookie: __Host-sixpoint-session="));
  EXPECT_THAT(
      Fetch("/sixpoint.plant.v1.PlantService/ListMachines", jar + " -H 'Content-Type: application/json' --data '{}'"),
      HasSubstr("HTTP/2 200"));
  std::ofstream(folder_ / "request", std::ios::binary) << std::string("\0\0\0\0\2{}", 7);
  const std::string heard = Fetch("/sixpoint.plant.v1.EventService/WatchEvents",
                                  jar + " -H 'Content-Type: application/connect+json' --max-time 3 --data-binary @" +
                                      (folder_ / "request").string() + " -o " + (folder_ / "heard").string());
  EXPECT_FALSE(ReadFile((folder_ / "heard").string()).empty()) << heard;
  gateway_->Kill();
  EXPECT_THAT(Fetch("/session"), HasSubstr("HTTP/2 502"));
}

}  // namespace
}  // namespace sixpoint::testing
