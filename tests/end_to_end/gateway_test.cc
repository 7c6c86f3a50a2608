// The gateway on the real processes, by curl as anybody has it: sign-in, calls by the Connect protocol, streams, what is refused, and
// what happens when a service or the gateway itself goes away.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "tests/end_to_end/door.h"

namespace sixpoint::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kPassword[] = "correct horse battery staple";
constexpr char kJson[] = "-H 'Content-Type: application/json'";

struct Answer {
  int status = 0;
  std::string head, body;
  nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
  std::string Header(const std::string& name) const {
    std::smatch found;
    std::regex_search(head, found, std::regex("\n" + name + ": ([^\r]*)", std::regex::icase));
    return found.empty() ? "" : found[1].str();
  }
};

class Gateway : public Door {
 protected:
  void SetUp() override {
    Door::SetUp();
    for (const char* const name : {"it", "jane", "mes"}) CreateAccount(name);
    web_ = std::filesystem::path(plant_.folder()) / "web";
    std::filesystem::create_directories(web_);
    std::ofstream(web_ / "index.html") << "<p>page";
    Start();
  }
  void CreateAccount(const std::string& name) {
    const auto admin = plant::v1::AccountService::NewStub(
        ChannelTo("plant", Of(plant_.certificates().User("root", {identity::Role::kAdmin}))));
    plant::v1::CreateAccountRequest create;
    create.set_name("users/" + name);
    create.set_password(kPassword);
    create.add_roles(name == "it"     ? access::v1::ROLE_ADMIN
                     : name == "jane" ? access::v1::ROLE_ENGINEER
                                      : access::v1::ROLE_MES_READER);
    plant::v1::Account account;
    grpc::ClientContext context;
    context.set_deadline(Within(20));
    const grpc::Status created = admin->CreateAccount(&context, create, &account);
    ASSERT_TRUE(created.ok()) << created.error_message();
  }
  void Start() {
    std::vector<std::string> command = {PlantProcesses::Program("sixpoint-gateway"),
                                        "--listen",
                                        "127.0.0.1:" + std::to_string(port_),
                                        "--certificates",
                                        plant_.certificates().Gateway().string(),
                                        "--web",
                                        web_.string(),
                                        "--revoked",
                                        plant_.certificates().revoked_file().string(),
                                        "--behind-proxy"};
    for (const std::string& area : PlantProcesses::Areas())
      command.insert(command.end(), {"--peer", area + "=" + plant_.address(area)});
    gateway_ = std::make_unique<Process>(command, log());
    for (const auto end = Within(20); Curl("/health/live").status != 200 && std::chrono::system_clock::now() < end;)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  std::string log() const { return plant_.folder() + "/gateway.log"; }
  void TearDown() override {
    if (HasFailure()) std::printf("%s\n", ReadFile(log()).c_str());
    Door::TearDown();
  }

  Answer Curl(const std::string& path, const std::string& words = "") const {
    const std::string command =
        "curl -sS -i --max-time 30 " + words + " 'http://127.0.0.1:" + std::to_string(port_) + path + "' 2>/dev/null";
    std::string text;
    FILE* const pipe = popen(command.c_str(), "r");
    char piece[4096];
    for (std::size_t count = 0; (count = fread(piece, 1, sizeof piece, pipe)) > 0;) text.append(piece, count);
    pclose(pipe);
    Answer answer;
    const std::size_t end = text.find("\r\n\r\n");
    answer.head = text.substr(0, end);
    if (end != std::string::npos) answer.body = text.substr(end + 4);
    std::sscanf(answer.head.c_str(), "HTTP/1.1 %d", &answer.status);
    return answer;
  }
  // As curl's option: the cookie of who signed in.
  std::string SignIn(const std::string& name) const {
    const Answer answer = Curl(
        "/session", std::string("--data '{\"name\": \"users/") + name + "\", \"password\": \"" + kPassword + "\"}'");
    EXPECT_EQ(answer.status, 200) << answer.body;
    const std::string cookie = answer.Header("Set-Cookie");
    return "-H 'Cookie: " + cookie.substr(0, cookie.find(';')) + "'";
  }
  Answer Call(const std::string& method, const std::string& message, const std::string& who) const {
    return Curl("/sixpoint.plant.v1." + method, std::string(kJson) + " " + who + " --data '" + message + "'");
  }
  static std::string ReasonOf(const Answer& answer) {
    const auto json = answer.json();
    return json.is_object() && json.contains("details") ? json["details"][0]["debug"].value("reason", "") : answer.body;
  }
  std::size_t OpenFiles() const {
    const std::filesystem::directory_iterator files("/proc/" + std::to_string(gateway_->pid()) + "/fd");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }
  static std::string ReadFile(const std::string& file) { return sixpoint::testing::ReadFile(file); }

  const int port_ = [] { return 20'000 + static_cast<int>(getpid()) % 10'000; }();
  std::filesystem::path web_;
  std::unique_ptr<Process> gateway_;
};

TEST_F(Gateway, PeopleSignInAndCallByTheirSession) {
  EXPECT_EQ(Curl("/session").body, "{}");
  EXPECT_EQ(Curl("/session", "-H 'Cookie: sixpoint-session=s1.x.y.z'").status, 401);
  const Answer wrong = Curl("/session", R"(--data '{"name": "users/jane", "password": "wrong wrong wrong"}')");
  EXPECT_EQ(wrong.status, 401);
  EXPECT_EQ(ReasonOf(wrong), "SIGN_IN_REFUSED");
  EXPECT_EQ(Curl("/session", R"(--data '{"name": 5}')").status, 400);
  EXPECT_EQ(Curl("/session", R"(--data '{"nmae": "x"}')").status, 400);
  EXPECT_EQ(Curl("/session", "--data '" + std::string(5000, 'x') + "'").status, 429);

  const std::string jane = SignIn("jane");
  const Answer who = Curl("/session", jane);
  EXPECT_EQ(who.json()["name"], "users/jane") << who.body;
  EXPECT_EQ(who.json()["roles"][0], "ROLE_ENGINEER");
  EXPECT_THAT(who.body, Not(HasSubstr("token")));
  // Recorded as who asked.
  const Answer created = Call("PlantService/GetMachine", R"({"name": "machines/none"})", jane);
  EXPECT_EQ(created.status, 404);
  EXPECT_EQ(ReasonOf(created), "MACHINE_NOT_FOUND");
  // By a role that he does not have, and by none.
  EXPECT_EQ(Call("AccountService/ListAccounts", "{}", jane).status, 403);
  EXPECT_EQ(ReasonOf(Call("AccountService/ListAccounts", "{}", "")), "SESSION_NOT_VALID");
  EXPECT_EQ(Call("AccountService/ListAccounts", "{}", SignIn("it")).status, 200);
  // The gateway's own methods are nobody's.
  EXPECT_EQ(Call("AccountService/SignIn", "{}", jane).status, 403);
  EXPECT_EQ(Call("AccountService/SignIn", "{}", "").status, 401);
  EXPECT_EQ(Call("PlantService/ListEndpoints", "{}", "").status, 401);
  EXPECT_EQ(ReasonOf(Call("PlantService/ListMachines", "{}", "-H 'Authorization: Bearer s1.x.y.z'")),
            "SESSION_NOT_VALID");

  EXPECT_EQ(Curl("/session", "-X DELETE " + jane).status, 200);
  for (const auto end = Within(20);
       Call("PlantService/ListMachines", "{}", jane).status == 200 && std::chrono::system_clock::now() < end;)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(ReasonOf(Call("PlantService/ListMachines", "{}", jane)), "SESSION_ENDED");
}

TEST_F(Gateway, AnswersAreTheServicesOwn) {
  const std::string jane = SignIn("jane");
  const Answer listed = Call("PlantService/ListMachines", "{}",
                             jane + " -H 'traceparent: 00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01'");
  EXPECT_EQ(listed.status, 200) << listed.body;
  EXPECT_EQ(listed.Header("Content-Type"), "application/json");
  EXPECT_EQ(listed.Header("Cache-Control"), "no-store");
  EXPECT_NE(listed.Header("Trailer-sixpoint-version"), "");
  EXPECT_THAT(listed.Header("Content-Security-Policy"), HasSubstr("default-src 'none'"));
  // The trace goes through both processes' logs.
  for (const auto end = Within(10); plant_.Logs().find("0af7651916cd43dd8448eb211c80319c") == std::string::npos &&
                                    std::chrono::system_clock::now() < end;)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_THAT(plant_.Logs(), HasSubstr("0af7651916cd43dd8448eb211c80319c"));
  EXPECT_THAT(ReadFile(log()), HasSubstr("0af7651916cd43dd8448eb211c80319c"));

  const std::string get = "/sixpoint.plant.v1.PlantService/ListMachines?connect=v1&encoding=json&message=%7B%7D";
  const Answer got = Curl(get, jane);
  EXPECT_EQ(got.status, 200) << got.body;
  EXPECT_EQ(got.body, listed.body);
  EXPECT_EQ(Curl(get, jane + " -H 'If-None-Match: " + got.Header("ETag") + "'").status, 304);
  EXPECT_EQ(Curl(get + "&x=1", jane).status, 400);
  EXPECT_EQ(Curl("/sixpoint.plant.v1.PlantService/CreateMachine?encoding=json&message=%7B%7D", jane).status, 405);

  // Refusals as gRPC has them, with the field by name.
  const Answer refused = Call("PlantService/ListMachines", R"({"pageSize": "many"})", jane);
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(refused.json()["code"], "invalid_argument");
  const Answer unknown = Call("PlantService/ListMachines", R"({"pagesize": 5})", jane);
  EXPECT_THAT(unknown.body, HasSubstr("pagesize"));
  const Answer token = Call("PlantService/ListMachines", R"({"pageToken": "of another"})", jane);
  EXPECT_EQ(token.status, 400);
  EXPECT_THAT(token.body, HasSubstr("page_token"));
  EXPECT_EQ(Call("PlantService/Nothing", "{}", jane).status, 404);
  EXPECT_EQ(
      Curl("/sixpoint.plant.v1.PlantService/ListMachines", "-H 'Content-Type: text/plain' --data x " + jane).status,
      415);
  const Answer late = Curl("/sixpoint.plant.v1.PlantService/ListMachines",
                           std::string(kJson) + " -H 'Connect-Timeout-Ms: 0' --data '{}' " + jane);
  EXPECT_EQ(late.status, 504) << late.body;
  std::ofstream(web_ / "large") << "{\"pageToken\":\"" << std::string(1 << 20, 'x') << "\"}";
  EXPECT_EQ(Curl("/sixpoint.plant.v1.PlantService/ListMachines",
                 std::string(kJson) + " --data-binary @" + (web_ / "large").string() + " " + jane)
                .status,
            429);
}

TEST_F(Gateway, AnotherSitesPageAsksForNothing) {
  const std::string jane = SignIn("jane");
  for (const char* const words :
       {"-H 'Origin: https://evil.example'", "-H 'Origin: null'", "-H 'Sec-Fetch-Site: cross-site'"}) {
    EXPECT_EQ(Call("PlantService/ListMachines", "{}", jane + " " + words).status, 403) << words;
    EXPECT_EQ(Curl("/session", jane + " " + words).status, 403) << words;
  }
  const Answer own =
      Call("PlantService/ListMachines", "{}", jane + " -H 'Origin: http://127.0.0.1:" + std::to_string(port_) + "'");
  EXPECT_EQ(own.status, 200) << own.body;
  EXPECT_EQ(own.Header("Access-Control-Allow-Origin"), "");
  // Behind a proxy that says so the cookie is for encrypted ways alone.
  const Answer encrypted = Curl(
      "/session", std::string("-H 'X-Forwarded-Proto: https' --data '{\"name\": \"users/jane\", \"password\": \"") +
                      kPassword + "\"}'");
  EXPECT_THAT(encrypted.Header("Set-Cookie"), HasSubstr("__Host-sixpoint-session="));
  EXPECT_THAT(encrypted.Header("Set-Cookie"), HasSubstr("; Secure"));
  EXPECT_THAT(encrypted.Header("Set-Cookie"), HasSubstr("HttpOnly; SameSite=Strict"));
}

TEST_F(Gateway, EventsStreamAsTheyHappen) {
  const std::string jane = SignIn("jane");
  // {} in its envelope.
  const std::string request = (web_ / "request").string(), heard = (web_ / "heard").string();
  std::ofstream(request, std::ios::binary) << std::string("\0\0\0\0\2{}", 7);
  const std::string words = "-H 'Content-Type: application/connect+json' --data-binary @" + request + " " + jane;
  const Answer begun = Curl("/sixpoint.plant.v1.EventService/WatchEvents", words + " --max-time 3");
  EXPECT_EQ(begun.status, 200) << begun.body;
  EXPECT_EQ(begun.Header("Content-Type"), "application/connect+json");
  EXPECT_EQ(begun.Header("Transfer-Encoding"), "chunked");
  EXPECT_EQ(begun.body.substr(0, 1), std::string(1, '\0')) << "an answer comes at once";
  // A refusal of the service's ends the stream, with words.
  std::ofstream(request, std::ios::binary)
      << std::string("\0\0\0\0\x17{\"afterSequence\":\"-5\"}!", 28).substr(0, 5) + "{\"afterSequence\":\"-55\"}";
  const Answer refused = Curl("/sixpoint.plant.v1.EventService/WatchEvents", words);
  EXPECT_EQ(refused.status, 200);
  EXPECT_THAT(refused.body, HasSubstr(R"("code":"invalid_argument")"));
  EXPECT_EQ(refused.body[0], 2);
  // Who leaves takes no place, and no connection stays behind: far more than may watch at once.
  std::ofstream(request, std::ios::binary) << std::string("\0\0\0\0\2{}", 7);
  const std::size_t before = OpenFiles();
  for (int i = 0; i < 40; ++i) {
    const Answer once = Curl("/sixpoint.plant.v1.EventService/WatchEvents", words + " --max-time 0.5");
    ASSERT_EQ(once.status, 200) << i << " " << once.head;
    ASSERT_EQ(once.body.substr(0, 1), std::string(1, '\0')) << i << " " << once.body;
  }
  EXPECT_LE(OpenFiles(), before + 2);
}

TEST_F(Gateway, ThePageIsServedAndNothingElse) {
  EXPECT_EQ(Curl("/").body, "<p>page");
  EXPECT_EQ(Curl("/blades/SN-1", "-H 'Accept: text/html'").body, "<p>page");
  EXPECT_EQ(Curl("/none.js").status, 404);
  EXPECT_EQ(Curl("/../../etc/passwd", "--path-as-is").status, 404);
  EXPECT_EQ(Curl("/%2e%2e/%2e%2e/etc/passwd", "--path-as-is").status, 404);
  EXPECT_EQ(Curl("/", "-X PUT --data x").status, 404);
  EXPECT_EQ(Curl("/", "-I").body, "");
}

TEST_F(Gateway, WhatGoesAwayIsSaidAndComesBack) {
  const std::string jane = SignIn("jane");
  plant_.Kill("correction");
  const Answer away =
      Curl("/sixpoint.correction.v1.CorrectionService/ListCorrections", std::string(kJson) + " --data '{}' " + jane);
  EXPECT_EQ(away.status, 503) << away.body;
  EXPECT_EQ(Call("PlantService/ListMachines", "{}", jane).status, 200);
  plant_.Start("correction");
  for (const auto end = Within(30);
       Curl("/sixpoint.correction.v1.CorrectionService/ListCorrections", std::string(kJson) + " --data '{}' " + jane)
               .status != 200 &&
       std::chrono::system_clock::now() < end;)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(
      Curl("/sixpoint.correction.v1.CorrectionService/ListCorrections", std::string(kJson) + " --data '{}' " + jane)
          .status,
      200);
  // A session outlives the gateway.
  gateway_->Kill();
  Start();
  EXPECT_EQ(Call("PlantService/ListMachines", "{}", jane).status, 200);
  EXPECT_EQ(kill(gateway_->pid(), SIGTERM), 0);
  EXPECT_EQ(gateway_->Wait(15), 0);
}

}  // namespace
}  // namespace sixpoint::testing
