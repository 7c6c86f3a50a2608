// The gateway on the real processes, by curl as anybody has it: sign-in, calls by the Connect protocol, streams, what is refused, and
// what happens when a service or the gateway itself goes away.
#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <google/protobuf/util/json_util.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "identity/certificate_token.h"
#include "metrology/frames/pose.h"
#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "storage/blobs.h"
#include "tests/end_to_end/door.h"
#include "tests/services/ingest/sample_scans.h"
#include "tests/support/registered.h"

namespace sixpoint::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

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
    CreateAccount("it", access::v1::ROLE_ADMIN);
    CreateAccount("jane", access::v1::ROLE_ENGINEER);
    CreateAccount("mes", access::v1::ROLE_MES_READER);
    web_ = std::filesystem::path(plant_.folder()) / "web";
    std::filesystem::create_directories(web_);
    std::ofstream(web_ / "index.html") << "<p>page";
    Start();
  }
  void Start() {
    gateway_ = std::make_unique<Process>(GatewayCommand(port_, web_), log());
    EXPECT_TRUE(Becomes(20s, [&] { return Curl("/health/live").status == 200; }));
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
    const auto said = answer.json();
    return said.is_object() && said.contains("details") ? said["details"][0]["debug"].value("reason", "") : answer.body;
  }
  std::string WriteFile(const std::string& name, const std::string& text) const {
    std::ofstream(web_ / name, std::ios::binary) << text;
    return (web_ / name).string();
  }
  std::size_t OpenFiles() const {
    const std::filesystem::directory_iterator files("/proc/" + std::to_string(gateway_->pid()) + "/fd");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }
  static std::string ReadFile(const std::string& file) { return sixpoint::testing::ReadFile(file); }

  const int port_ = FreePorts(1).front();
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
  EXPECT_TRUE(Becomes(20s, [&] { return Call("PlantService/ListMachines", "{}", jane).status != 200; }));
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
  const auto has_trace = [](const std::string& logs) {
    return absl::StrContains(logs, "0af7651916cd43dd8448eb211c80319c");
  };
  EXPECT_TRUE(Becomes(10s, [&] { return has_trace(plant_.Logs()); }));
  EXPECT_TRUE(Becomes(10s, [&] { return has_trace(ReadFile(log())); }));

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

// As a control without gRPC fetches it: once released, by who may, and each fetch recorded.
TEST_F(Gateway, AReleasedProgramIsFetchedByGet) {
  Process demo({PlantProcesses::Program("sixpoint-simulator"), "demo", "--server", plant_.server(), "--machines", "1",
                "--airfoil-pitch-mm", "0.4", "--pins-pitch-mm", "0.15"},
               plant_.folder() + "/demo.log");
  ASSERT_EQ(demo.Wait(200), 0) << ReadFile(plant_.folder() + "/demo.log");
  const std::string jane = SignIn("jane"), service = "/sixpoint.correction.v1.CorrectionService/";
  const auto ask = [&](const std::string& method, const std::string& message) {
    return Curl(service + method, std::string(kJson) + " " + jane + " --data @" + WriteFile("message", message));
  };
  const nlohmann::json cut = ask("ListCorrections", "{}").json()["corrections"][0];
  const nlohmann::json registration =
      Curl("/sixpoint.registration.v1.RegistrationService/GetRegistration",
           std::string(kJson) + " " + jane + " --data '{\"name\": \"" + cut.value("registration", "") + "\"}'")
          .json();
  const auto query = "?machine=" + cut.value("machine", "") + "&blade=" + cut.value("blade", "") +
                     "&clamping=" + registration.value("clamping", "");
  const auto program_of = [](const std::string& name) { return "/programs/" + name.substr(name.find('/') + 1); };
  // All of its holes were cut: there is nothing left to fetch.
  const Answer over = Curl(program_of(cut.value("name", "")) + query, jane);
  EXPECT_EQ(over.status, 400) << over.body;
  EXPECT_EQ(over.json()["code"], "failed_precondition");

  const auto database = storage::Database::Open(database_.conninfo(), 1);
  auto transaction = database->Begin(Soon());
  const auto template_digest = transaction->Execute("SELECT encode(nc_template_sha256, 'hex') FROM corrections");
  ASSERT_TRUE(template_digest.ok()) << template_digest.status();
  const auto nc_template = storage::GetBlob(*transaction, template_digest->Text(0, 0));
  ASSERT_TRUE(nc_template.ok()) << nc_template.status();
  const nlohmann::json correct = {{"registration", cut["registration"]},
                                  {"ncTemplate", *nc_template},
                                  {"requestId", "6f1d3c52-0f6e-4d4e-8f46-3f1f0c1d2e3f"}};
  const Answer corrected = ask("Correct", correct.dump());
  ASSERT_EQ(corrected.status, 200) << corrected.body;
  const std::string path = program_of(corrected.json().value("name", ""));
  // The blade's holes are there already: a person decides.
  EXPECT_EQ(ReasonOf(Curl(path + query, jane)), "PROGRAM_NOT_RELEASED");
  const nlohmann::json release = {{"name", corrected.json()["name"]},
                                  {"reason", "a second pass"},
                                  {"requestId", "6f1d3c52-0f6e-4d4e-8f46-3f1f0c1d2e3d"}};
  const Answer released = ask("ReleaseCorrection", release.dump());
  ASSERT_EQ(released.status, 200) << released.body;
  const Answer program = Curl(path + query, jane);
  ASSERT_EQ(program.status, 200) << program.body;
  EXPECT_THAT(program.body, HasSubstr("G1"));
  EXPECT_EQ(program.Header("Repr-Digest"),
            "sha-256=:" + absl::Base64Escape(absl::HexStringToBytes(storage::Sha256Hex(program.body))) + ":");
  EXPECT_EQ(program.Header("Cache-Control"), "no-store");
  EXPECT_THAT(program.Header("Sixpoint-Usable-Until"), HasSubstr("T"));
  EXPECT_EQ(program.Header("Sixpoint-Hole-Count"), "14");
  EXPECT_THAT(program.Header("Sixpoint-Fetch"), HasSubstr("fetches/"));
  EXPECT_NE(Curl(path + query, jane).Header("Sixpoint-Fetch"), program.Header("Sixpoint-Fetch"));
  const std::string once = query + "&request_id=6f1d3c52-0f6e-4d4e-8f46-3f1f0c1d2e40";
  EXPECT_EQ(Curl(path + once, jane).Header("Sixpoint-Fetch"), Curl(path + once, jane).Header("Sixpoint-Fetch"));

  EXPECT_EQ(Curl(path + query, "").status, 401);
  EXPECT_EQ(Curl(path + query, SignIn("mes")).status, 403);
  EXPECT_EQ(Curl(path + query, "-X POST --data x " + jane).status, 405);
  EXPECT_EQ(Curl(path + query, "-I " + jane).status, 405);  // each is recorded: there is no looking
  EXPECT_THAT(Curl(path + query + "&blad=1", jane).body, HasSubstr("query: blad"));
  EXPECT_GE(Curl(path + "?machine=machines/other&blade=" + cut.value("blade", ""), jane).status, 400);
  EXPECT_GE(Curl(path + "?machine=" + cut.value("machine", ""), jane).status, 400);
  EXPECT_EQ(Curl("/programs/6f1d3c52-0f6e-4d4e-8f46-3f1f0c1d2e3f" + query, jane).status, 404);
}

TEST_F(Gateway, WhatGoesAwayIsSaidAndComesBack) {
  const std::string jane = SignIn("jane");
  plant_.Kill("correction");
  const auto list_corrections = [&] {
    return Curl("/sixpoint.correction.v1.CorrectionService/ListCorrections",
                std::string(kJson) + " --data '{}' " + jane);
  };
  const Answer away = list_corrections();
  EXPECT_EQ(away.status, 503) << away.body;
  EXPECT_EQ(Call("PlantService/ListMachines", "{}", jane).status, 200);
  plant_.Start("correction");
  EXPECT_TRUE(Becomes(30s, [&] { return list_corrections().status == 200; }));
  // A session outlives the gateway.
  gateway_->Kill();
  Start();
  EXPECT_EQ(Call("PlantService/ListMachines", "{}", jane).status, 200);
  EXPECT_EQ(kill(gateway_->pid(), SIGTERM), 0);
  EXPECT_EQ(gateway_->Wait(15), 0);
}

// What a control without gRPC does: it says who it is by its certificate's key, puts its scan, and anybody who may reads it by digest.
class PlainHttp : public Gateway {
 protected:
  void SetUp() override {
    Gateway::SetUp();
    const auto database = storage::Database::Open(database_.conninfo(), 1);
    RegisterUsual(database.get());
    auto transaction = database->Begin(Soon());
    RegisterBlade(*transaction, "sn1", "p1");
    ASSERT_TRUE(transaction->Commit().ok());
    points_mm_ = ingest::SampleProfiles(8, 100);
    header_ = ingest::SampleHeader("g1", 800, ingest::v1::ENCODING_XYZ_F64);
    header_.clear_a_deg();  // the machine that is registered has no such axes
    header_.clear_b_deg();
    blocks_ = ingest::SampleBlocks(points_mm_, 300, ingest::v1::ENCODING_XYZ_F64);
    for (const auto& block : blocks_) digests_.push_back(storage::Sha256Hex(block.payload()));
  }
  static std::string TokenOf(const std::filesystem::path& credentials, std::chrono::seconds age = {}) {
    const auto now = std::chrono::system_clock::now() - age;
    return identity::SignCertificateToken(credentials / identity::kIdentityFile, now, now + std::chrono::minutes(10))
        .value();
  }
  static std::string Bearer(const std::string& token) { return "-H 'Authorization: Bearer " + token + "'"; }
  std::string AsMachine(const std::string& id) { return Bearer(TokenOf(plant_.certificates().Machine(id))); }
  static std::string JsonOf(const google::protobuf::Message& message) {
    std::string text;
    EXPECT_TRUE(google::protobuf::util::MessageToJsonString(message, &text).ok());
    return text;
  }
  Answer Put(const std::string& path, const std::string& body, const std::string& who) const {
    return Curl(path,
                "-X PUT --data-binary @" + WriteFile("body", body) + " -H 'Content-Type: application/json' " + who);
  }
  Answer PutHeader(const std::string& who) const { return Put("/scans/g1", JsonOf(header_), who); }
  Answer PutBlock(int index, const std::string& who) const {
    const auto& block = blocks_[static_cast<std::size_t>(index)];
    return Put("/scans/g1/blocks/" + std::to_string(index) + "?points=" + std::to_string(block.point_count()),
               block.payload(), who);
  }
  Answer PutEnd(const std::string& who) const {
    ingest::v1::ScanEnd end;
    end.set_block_count(static_cast<int>(blocks_.size()));
    end.set_point_count(800);
    end.set_sha256(storage::Sha256OfDigests(digests_));
    return Put("/scans/g1/end", JsonOf(end), who);
  }

  metrology::Points points_mm_;
  ingest::v1::ScanHeader header_;
  std::vector<ingest::v1::ScanBlock> blocks_;
  std::vector<std::string> digests_;
};

TEST_F(PlainHttp, AMachinePutsItsScanAndGoesOnWhereItBrokeOff) {
  const std::string m1 = AsMachine("m1");
  EXPECT_EQ(PutHeader("").status, 401);
  EXPECT_EQ(ReasonOf(PutHeader(AsMachine("m2"))), "MACHINE_DIFFERS");
  EXPECT_THAT(PutBlock(0, m1).body, HasSubstr("want PUT /scans/g1 first"));
  const Answer begun = PutHeader(m1);
  ASSERT_EQ(begun.status, 200) << begun.body;
  EXPECT_EQ(begun.json().value("nextBlock", 0), 0);
  EXPECT_EQ(PutBlock(0, m1).json()["nextBlock"], 1);
  // Nobody else has this upload here, whoever he is.
  EXPECT_EQ(PutBlock(1, AsMachine("m2")).status, 400);
  EXPECT_EQ(PutBlock(1, SignIn("jane")).status, 400);

  // The control was off for a while: the header once more says where it goes on. A block sent again is one block.
  EXPECT_EQ(PutHeader(m1).json()["nextBlock"], 1);
  EXPECT_EQ(PutBlock(0, m1).json()["nextBlock"], 1);
  // The gateway went away: what it held is gone, what was acknowledged is not.
  gateway_->Kill();
  Start();
  EXPECT_EQ(PutBlock(1, m1).status, 400);
  EXPECT_EQ(PutHeader(m1).json()["nextBlock"], 1);
  // Ingest went away.
  plant_.Kill("ingest");
  EXPECT_EQ(PutBlock(1, m1).status, 503);
  plant_.Start("ingest");
  Answer again;
  EXPECT_TRUE(Becomes(30s, [&] { return (again = PutHeader(m1)).status == 200; }));
  EXPECT_EQ(again.json()["nextBlock"], 1) << again.body;
  EXPECT_EQ(PutBlock(1, m1).json()["nextBlock"], 2);
  EXPECT_EQ(PutEnd(m1).status, 400);  // a block is missing
  EXPECT_EQ(PutHeader(m1).json()["nextBlock"], 2);
  EXPECT_EQ(PutBlock(2, m1).json()["nextBlock"], 3);
  const Answer stored = PutEnd(m1);
  ASSERT_EQ(stored.status, 200) << stored.body;
  EXPECT_EQ(stored.json()["scan"]["name"], "scans/g1");
  EXPECT_EQ(PutHeader(m1).json()["complete"], true);
  EXPECT_EQ(PutEnd(m1).json()["alreadyStored"], true);
}

TEST_F(PlainHttp, WhatIsPutIsJudgedAsByGrpc) {
  const std::string m1 = AsMachine("m1");
  EXPECT_THAT(Put("/scans/other", JsonOf(header_), m1).body, HasSubstr("scan_id: g1, want other"));
  EXPECT_EQ(Put("/scans/g1", "{\"scanID\": 5}", m1).status, 400);
  EXPECT_EQ(Put("/scans/g1", std::string(100'000, 'x'), m1).status, 429);
  EXPECT_EQ(Put("/scans/g1/tail", "", m1).status, 404);
  EXPECT_EQ(Curl("/scans/g1", "-X POST --data x " + m1).status, 405);
  ASSERT_EQ(PutHeader(m1).status, 200);
  EXPECT_THAT(Put("/scans/g1/blocks/x?points=1", "", m1).body, HasSubstr("block: x, want a whole number"));
  EXPECT_THAT(Put("/scans/g1/blocks/0", "", m1).body, HasSubstr("points: "));
  const Answer wrong = Put("/scans/g1/blocks/0?points=5", std::string(24, '\0'), m1);
  EXPECT_EQ(wrong.status, 400) << wrong.body;
  EXPECT_EQ(Put("/scans/g1/blocks/0?points=5", std::string(8'000'000, 'x'), m1).status, 429);
  // Whoever was refused begins anew.
  EXPECT_EQ(PutHeader(m1).json().value("nextBlock", 0), 0);
  EXPECT_EQ(PutBlock(0, m1).json()["nextBlock"], 1);
  // One caller does not take all places.
  std::string last;
  for (int i = 0; i < 6; ++i) {
    header_.set_scan_id("h" + std::to_string(i));
    last = ReasonOf(Put("/scans/" + header_.scan_id(), JsonOf(header_), m1));
  }
  EXPECT_EQ(last, "UPLOADS_FULL");
}

TEST_F(PlainHttp, ABlobIsReadByItsDigestForEver) {
  const std::string m1 = AsMachine("m1"), jane = SignIn("jane");
  PutHeader(m1);
  for (int i = 0; i < 3; ++i) PutBlock(i, m1);
  ASSERT_EQ(PutEnd(m1).status, 200);
  const auto list = Curl("/sixpoint.ingest.v1.ScanService/ListScanBlocks",
                         std::string(kJson) + " " + jane + " --data '{\"name\": \"scans/g1\"}'");
  ASSERT_EQ(list.status, 200) << list.body;
  ASSERT_EQ(list.json()["blocks"].size(), 3u);
  const std::string digest = list.json()["blocks"][1]["sha256"], path = "/blobs/" + digest + "?of=scans/g1";
  const Answer whole = Curl(path, jane);
  ASSERT_EQ(whole.status, 200) << whole.body;
  EXPECT_EQ(storage::Sha256Hex(whole.body), digest);
  EXPECT_EQ(whole.Header("ETag"), "\"" + digest + "\"");
  EXPECT_EQ(whole.Header("Cache-Control"), "private, max-age=31536000, immutable");
  EXPECT_EQ(Curl(path, "-I " + jane).Header("Content-Length"), std::to_string(whole.body.size()));
  EXPECT_EQ(Curl(path, jane + " -H 'If-None-Match: \"" + digest + "\"'").status, 304);
  const auto range = [&](const std::string& words) { return Curl(path, jane + " -H 'Range: bytes=" + words + "'"); };
  const std::string size = std::to_string(whole.body.size());
  EXPECT_EQ(range("5-11").status, 206);
  EXPECT_EQ(range("5-11").body, whole.body.substr(5, 7));
  EXPECT_EQ(range("5-11").Header("Content-Range"), "bytes 5-11/" + size);
  EXPECT_EQ(range("5-").body, whole.body.substr(5));
  EXPECT_EQ(range("-4").body, whole.body.substr(whole.body.size() - 4));
  EXPECT_EQ(range("-999999").body, whole.body);
  EXPECT_EQ(range("999999-").status, 416);
  for (const char* const none : {"x-y", "7-5", "1-2,4-5", "-0"}) EXPECT_EQ(range(none).status, 200) << none;
  EXPECT_EQ(Curl(path, jane + " -H 'Range: bytes=5-11' -H 'If-Range: \"other\"'").status, 200);

  EXPECT_EQ(Curl(path, m1).body, whole.body);
  EXPECT_EQ(ReasonOf(Curl(path, AsMachine("m2"))), "MACHINE_DIFFERS");
  EXPECT_EQ(Curl(path, SignIn("mes")).status, 403);
  EXPECT_EQ(Curl(path, "").status, 401);
  EXPECT_EQ(Curl(path, "-X POST --data x " + jane).status, 405);
  EXPECT_EQ(ReasonOf(Curl("/blobs/" + digests_[0] + "?of=scans/g1", jane)), "BLOB_NOT_FOUND");
  EXPECT_EQ(ReasonOf(Curl("/blobs/" + digest + "?of=scans/none", jane)), "SCAN_NOT_FOUND");
  EXPECT_EQ(Curl("/blobs/" + digest, jane).status, 400);
  EXPECT_THAT(Curl(path + "&as=png", jane).body, HasSubstr("query: as, want of"));
}

// A certificate's own token: good while certificate and times are, and nobody's but its holder's.
TEST_F(PlainHttp, ACertificatesHolderSaysWhoHeIs) {
  const auto credentials = plant_.certificates().Machine("m1");
  const auto listed = [&](const std::string& token) {
    return Call("PlantService/GetMachine", "{\"name\": \"machines/m1\"}", Bearer(token));
  };
  EXPECT_EQ(listed(TokenOf(credentials)).status, 200);
  EXPECT_EQ(listed(TokenOf(plant_.certificates().User("erik", {identity::Role::kEngineer}))).status, 200);
  EXPECT_EQ(ReasonOf(listed(TokenOf(credentials, std::chrono::minutes(11)))), "SESSION_ENDED");
  EXPECT_EQ(ReasonOf(listed(TokenOf(credentials, -std::chrono::minutes(5)))), "SESSION_NOT_VALID");
  EXPECT_EQ(listed(TokenOf(plant_.certificates().Service("plant"))).status, 401);
  EXPECT_EQ(listed(TokenOf(PlantCertificates("another").Machine("m1"))).status, 401);
  std::string changed = TokenOf(credentials);
  changed[changed.size() - 5] = changed[changed.size() - 5] == 'A' ? 'B' : 'A';
  EXPECT_EQ(ReasonOf(listed(changed)), "SESSION_NOT_VALID");
  // As the machine, and no more.
  EXPECT_EQ(ReasonOf(Call("PlantService/GetMachine", "{\"name\": \"machines/m2\"}", Bearer(TokenOf(credentials)))),
            "MACHINE_DIFFERS");
  EXPECT_EQ(ReasonOf(Call("AccountService/ListAccounts", "{}", Bearer(TokenOf(credentials)))), "ROLE_MISSING");
  // It is no session: nobody renews it.
  EXPECT_EQ(Curl("/session", Bearer(TokenOf(credentials))).status, 401);
  // Taken back, it counts no more at the next call.
  const std::string token = TokenOf(credentials);
  EXPECT_EQ(listed(token).status, 200);
  plant_.certificates().Revoke(credentials);
  EXPECT_EQ(listed(token).status, 401);
}

// The example of the guide, and a token that another library made (python3-jwt).
TEST_F(PlainHttp, PythonPutsAScan) {
  const auto credentials = plant_.certificates().Machine("m1");
  const std::string folder = web_.string(), url = "http://127.0.0.1:" + std::to_string(port_);
  header_.set_scan_id("py1");
  std::ofstream(folder + "/header.json") << JsonOf(header_);
  std::ofstream points(folder + "/points.f64", std::ios::binary);
  for (const Eigen::Vector3d& p : points_mm_) points.write(reinterpret_cast<const char*>(p.data()), sizeof p);
  points.close();
  std::ofstream(folder + "/make_token.py") << R"(
import base64, sys, time, jwt
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
pem = open(sys.argv[1], "rb").read()
der = x509.load_pem_x509_certificate(pem[pem.index(b"-----BEGIN CERT"):]).public_bytes(Encoding.DER)
now = int(time.time())
print(jwt.encode({"aud": "sixpoint", "iat": now, "exp": now + 600}, pem[:pem.index(b"-----BEGIN CERT")] if pem.index(b"PRIVATE KEY") < pem.index(b"CERTIFICATE") else pem[pem.index(b"-----BEGIN PRIVATE"):],
                 algorithm="ES256", headers={"x5c": [base64.b64encode(der).decode()]}))
)";
  const std::string example = std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/docs/examples/put_scan.py";
  const std::string output = folder + "/output";
  const std::string command = "SIXPOINT_TOKEN=$(/usr/bin/python3 " + folder + "/make_token.py " +
                              (credentials / identity::kIdentityFile).string() + ") /usr/bin/python3 " + example + " " +
                              url + " " + folder + "/header.json " + folder + "/points.f64 > " + output + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << ReadFile(output);
  EXPECT_THAT(ReadFile(output), HasSubstr("scans/py1"));
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(ReadFile(output), HasSubstr("\"alreadyStored\": true"));
}

}  // namespace
}  // namespace sixpoint::testing
