// A person of the house signs in by its identity provider: the whole dance of browser (curl and its jar), gateway, provider and plant, and
// whatever may go wrong in it.
#include <absl/strings/match.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/end_to_end/door.h"
#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/services/plant/provider_tokens.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr char kSecret[] = "s3cret/of+the=gateway";

struct WholeAnswer {
  int status = 0;
  std::string text;  // head and body
  std::string Header(const std::string& name) const {
    std::smatch found;
    std::regex_search(text, found, std::regex("\n" + name + ": ([^\r]*)", std::regex::icase));
    return found.empty() ? "" : found[1].str();
  }
};

class DirectorySignIn : public Door {
 protected:
  void SetUp() override {
    if (!plant::ProviderTokens::MayBeMade())
      GTEST_SKIP() << "SKIPPED: python3-jwt or python3-cryptography is absent (deploy/install_packages tests)";
    Door::SetUp();
    folder_ = fs::path(plant_.folder()) / "provider";
    fs::create_directories(folder_ / "web");
    Write("web/index.html", "<p>page");
    Mode("good");
    provider_ = popen(
        (plant::ProviderTokens::Source("tests/end_to_end/fake_identity_provider") + " " + folder_.string()).c_str(),
        "we");  // closed in what the plant starts, or it would stay open
    ASSERT_TRUE(Becomes(60s, [&] { return fs::exists(folder_ / "port"); }));
    Configure();
    plant_.Kill("plant");
    plant_.Start("plant", {"--oidc", oidc_file()});
    ASSERT_TRUE(plant_.WaitUntilUp("plant", 60));
    ASSERT_TRUE(Becomes(60s, [&] { return IsReady(plant_.credentials()); }));
    Start();
  }
  void TearDown() override {
    if (HasFailure()) std::printf("%s\n%s\n", ReadFile(log()).c_str(), ReadFile((folder_ / "asked").string()).c_str());
    gateway_.reset();
    if (provider_ != nullptr) pclose(provider_);
    Door::TearDown();
  }

  void Write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  void Mode(const std::string& word) const { Write("mode", word); }
  std::string oidc_file() const { return (folder_ / "oidc.yaml").string(); }
  std::string log() const { return (folder_ / "gateway.log").string(); }
  void Configure(const std::string& more = "", const std::string& host = "localhost", std::string ca_file = "") const {
    const std::string url = "https://" + host + ":" + ReadFile((folder_ / "port").string());
    if (ca_file.empty()) ca_file = (folder_ / "ca.pem").string();
    Write("oidc.yaml", "issuer: https://id.plant.example\nclient_id: 'sixpoint: the plant'\nkeys_file: " +
                           (folder_ / "keys.json").string() + "\nca_file: " + ca_file +
                           "\nroles: {turbine-engineers: engineer}\nauthorization_url: " + url +
                           "/authorize?tenant=turbines\ntoken_url: " + url + "/token\ndisplay_name: Müller Turbinen\n" +
                           more);
  }
  std::string At() const { return "http://127.0.0.1:" + std::to_string(port_); }
  std::vector<std::string> Command() {
    std::vector<std::string> command = GatewayCommand(port_, folder_ / "web");
    command.insert(command.end(), {"--oidc", oidc_file(), "--page", At() + "/"});
    return command;
  }
  void Start() {
    gateway_.reset();
    gateway_ = std::make_unique<Process>(Command(), log());
    EXPECT_TRUE(Becomes(60s, [&] { return Curl("/health/live").status == 200; }));
  }

  // One request, of a browser that keeps its cookies in this jar.
  WholeAnswer Curl(const std::string& path, const std::string& words = "") const {
    return Fetch(At() + path, words + " -b " + Jar() + " -c " + Jar());
  }
  WholeAnswer Fetch(const std::string& url, const std::string& words) const {
    WholeAnswer answer;
    answer.text = ShellOutput("curl -sS -i --noproxy '*' --max-time 60 --cacert " + (folder_ / "ca.pem").string() +
                              " " + words + " '" + url + "'");
    std::sscanf(answer.text.c_str(), "HTTP/%*s %d", &answer.status);
    return answer;
  }
  std::string Jar() const { return (folder_ / "jar").string(); }
  void NewJar() const { fs::remove(Jar()); }
  // To the provider and up to where it sends the browser: the callback's path and query.
  std::string GoAndComeBack(const std::string& from = "/blades?serial=SN-1") const {
    const WholeAnswer sent = Curl("/session/start", "-G --data-urlencode 'return=" + from + "'");
    EXPECT_EQ(sent.status, 302) << sent.text;
    const std::string back = Fetch(sent.Header("Location"), "").Header("Location");
    EXPECT_EQ(back.rfind(At() + "/session/callback?", 0), 0u) << back;
    return back.substr(std::min(back.size(), At().size()));
  }
  // A browser of its own, at this address, that was at the provider: the command that sends it to the callback, again and again alike.
  std::string BrowserComesBack(const std::string& address) {
    NewJar();
    const std::string back = GoAndComeBack("/parts");
    const fs::path jar = folder_ / ("jar_" + std::to_string(++jars_));
    fs::copy_file(Jar(), jar);
    return "curl -sS -i --noproxy '*' --max-time 60 -H 'X-Forwarded-For: " + address + "' -b " + jar.string() + " '" +
           At() + back + "'";
  }
  // Refused in words of the page's, with nobody signed in and nothing of the outside in the answer.
  void ExpectNobody(const WholeAnswer& answer, const std::string& where) const {
    EXPECT_EQ(answer.status, 303) << answer.text;
    EXPECT_EQ(answer.Header("Location"), where);
    EXPECT_THAT(answer.text, Not(HasSubstr("outside")));
    EXPECT_THAT(answer.text, Not(HasSubstr("sixpoint-session")));
    EXPECT_THAT(Who(), HasSubstr("\r\n\r\n{}"));
  }
  std::string Who() const { return Curl("/session").text; }
  std::size_t AskedCount(const std::string& what) const {
    const std::string asked = ReadFile((folder_ / "asked").string());
    std::size_t count = 0;
    for (std::size_t at = 0; (at = asked.find(what + "\n", at)) != std::string::npos; ++at) ++count;
    return count;
  }
  static std::string ReadFile(const std::string& file) { return sixpoint::testing::ReadFile(file); }

  const int port_ = FreePorts(1).front();
  fs::path folder_;
  FILE* provider_ = nullptr;
  std::unique_ptr<Process> gateway_;
  int jars_ = 0;
};

TEST_F(DirectorySignIn, APersonOfTheHouseGoesThereAndComesBackSignedIn) {
  EXPECT_THAT(Curl("/session/provider").text, HasSubstr("\r\n\r\n{\"name\":\"Müller Turbinen\"}"));
  const WholeAnswer sent = Curl("/session/start?return=/blades%3Fserial%3DSN-1");
  EXPECT_EQ(sent.status, 302) << sent.text;
  EXPECT_THAT(sent.Header("Set-Cookie"),
              MatchesRegex("sixpoint-sign-in=[A-Za-z0-9._-]+; Path=/; HttpOnly; SameSite=Lax; Max-Age=600"));
  EXPECT_THAT(sent.Header("Location"), HasSubstr("client_id=sixpoint%3A%20the%20plant&redirect_uri=http%3A%2F%2F"));
  EXPECT_EQ(sent.Header("Cache-Control"), "no-store");
  // The whole way as a browser goes it, and on to where one was.
  const WholeAnswer all = Curl("/session/start?return=/blades%3Fserial%3DSN-1", "-L -w '%{url_effective}'");
  EXPECT_THAT(all.text, HasSubstr("\r\nSet-Cookie: sixpoint-session="));
  EXPECT_THAT(all.text, HasSubstr("; HttpOnly; SameSite=Strict"));
  EXPECT_THAT(all.text, HasSubstr(At() + "/blades?serial=SN-1"));
  EXPECT_THAT(all.text, HasSubstr("sixpoint-sign-in=; "));  // used, and forgotten
  EXPECT_THAT(Who(), HasSubstr("\"users/ann\""));
  EXPECT_THAT(Who(), HasSubstr("ROLE_ENGINEER"));
  const WholeAnswer called = Curl("/sixpoint.plant.v1.PlantService/GetMachine",
                                  "-H 'Content-Type: application/json' --data '{\"name\": \"machines/none\"}'");
  EXPECT_EQ(called.status, 404) << called.text;
  // Over TLS by the names that browsers guard.
  const WholeAnswer encrypted = Curl("/session/start", "-H 'X-Forwarded-Proto: https'");
  EXPECT_THAT(encrypted.Header("Set-Cookie"),
              MatchesRegex("__Host-sixpoint-sign-in=[^;]+; Path=/; HttpOnly; SameSite=Lax; Secure; Max-Age=600"));
  // A code and a token are in no log.
  EXPECT_THAT(ReadFile(log()), Not(HasSubstr("code=")));
  EXPECT_THAT(ReadFile(log()), Not(HasSubstr("eyJ")));
}

TEST_F(DirectorySignIn, WhatIsOfNoSignInOfThisBrowserSignsNobodyIn) {
  // Another state; and what it began itself goes on all the same.
  const std::string back = GoAndComeBack();
  const std::string other = std::regex_replace(back, std::regex("state=[^&]+"), "state=" + std::string(43, 'A'));
  ExpectNobody(Curl(other), "/blades?serial=SN-1&sign_in=again");
  ExpectNobody(Curl("/session/callback"), "/blades?serial=SN-1&sign_in=again");
  EXPECT_EQ(AskedCount("/token given"), 0u);
  const std::string ticket = ReadFile(Jar());
  EXPECT_EQ(Curl(back).Header("Location"), "/blades?serial=SN-1");
  EXPECT_THAT(Who(), HasSubstr("users/ann"));

  // The same once more: the ticket is gone; and where somebody kept it, the provider is not asked again, by this code or another.
  NewJar();
  ExpectNobody(Curl(back), "/?sign_in=again");
  Write("kept", ticket);
  ExpectNobody(Fetch(At() + back, "-b " + folder_.string() + "/kept"), "/blades?serial=SN-1&sign_in=again");
  ExpectNobody(
      Fetch(At() + std::regex_replace(back, std::regex("code=[^&]+"), "code=x"), "-b " + folder_.string() + "/kept"),
      "/blades?serial=SN-1&sign_in=again");
  EXPECT_EQ(AskedCount("/token no such code"), 0u);
  EXPECT_EQ(AskedCount("/token given"), 1u);

  // Without the cookie, with somebody else's, with one that was changed.
  NewJar();
  const std::string again = GoAndComeBack("/parts");
  const std::string kept = ReadFile(Jar());
  NewJar();
  ExpectNobody(Curl(again), "/?sign_in=again");
  Curl("/session/start");
  ExpectNobody(Curl(again), "/?sign_in=again");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(kept, found, std::regex("t1\\.\\S+")));
  const std::string text = found[0];
  for (std::string changed :
       {text.substr(0, 3) + "9" + text.substr(4), text + "A", text.substr(0, text.size() - 1), std::string("t1"),
        std::string(), std::string(5000, 'A'), "t1.1.x.Lw." + text.substr(60)}) {
    NewJar();
    ExpectNobody(Fetch(At() + again, "-H 'Cookie: sixpoint-sign-in=" + changed + "'"), "/?sign_in=again");
  }
  EXPECT_EQ(AskedCount("/token given"), 1u);
  // A gateway that was started again knows no ticket of before.
  std::ofstream(Jar()) << kept;
  Start();
  ExpectNobody(Curl(again), "/?sign_in=again");
}

TEST_F(DirectorySignIn, WhoComesBackIsOnThisSite) {
  for (const char* elsewhere :
       {"https://evil.example/", "//evil.example", "/\\evil.example", "/.//evil.example", "/a//evil.example", "evil",
        "", "/blades#x", "/session/start", "/%2e%2e//evil.example%0d%0aSet-Cookie: a=b", "javascript:alert(1)"}) {
    const WholeAnswer refused = Curl("/session/start", std::string("-G --data-urlencode 'return=") + elsewhere + "'");
    EXPECT_EQ(refused.status, 400) << elsewhere << refused.text;
    EXPECT_EQ(refused.Header("Location"), "") << elsewhere;
    EXPECT_THAT(refused.text, HasSubstr("want a path of this site"));
  }
  EXPECT_EQ(Curl("/session/start?return=/" + std::string(1100, 'a')).status, 400);
  EXPECT_EQ(Curl("/session/start?other=/").status, 400);
  EXPECT_EQ(Curl("/session/start", "--data x").status, 405);
  EXPECT_EQ(Curl("/session/callback", "-X PUT").status, 405);
  // A picture of another site's page begins nothing; a link does.
  EXPECT_EQ(Curl("/session/start", "-H 'Sec-Fetch-Site: cross-site' -H 'Sec-Fetch-Mode: no-cors'").status, 403);
  EXPECT_EQ(Curl("/session/start", "-H 'Sec-Fetch-Site: cross-site' -H 'Sec-Fetch-Mode: navigate'").status, 302);
}

TEST_F(DirectorySignIn, WhomTheProviderOrThePlantDoesNotTakeIsToldSo) {
  for (const auto& [mode, word] : std::vector<std::pair<std::string, std::string>>{{"access_denied", "declined"},
                                                                                   {"invalid_scope", "settings"},
                                                                                   {"server_error", "provider"},
                                                                                   {"<b>odd", "declined"},
                                                                                   {"nonce", "stranger"},
                                                                                   {"stranger", "stranger"},
                                                                                   {"client", "stranger"},
                                                                                   {"huge", "provider"},
                                                                                   {"broken", "provider"},
                                                                                   {"elsewhere", "provider"},
                                                                                   {"text", "provider"},
                                                                                   {"no_token", "provider"}}) {
    SCOPED_TRACE(mode);
    Mode(mode);
    const WholeAnswer refused = Curl(GoAndComeBack("/parts"));
    ExpectNobody(refused, "/parts?sign_in=" + word);
    EXPECT_THAT(refused.text, HasSubstr("sixpoint-sign-in=; "));
  }
  EXPECT_EQ(AskedCount("/token elsewhere"), 1u);  // not followed
  EXPECT_THAT(Denials("SIGN_IN_REFUSED"),
              ::testing::Contains(::testing::Field(&storage::Denial::sentence, HasSubstr("nonce"))));
  EXPECT_THAT(ReadFile(log()), Not(HasSubstr("outside")));
  EXPECT_THAT(ReadFile(log()), Not(HasSubstr("<b>")));
  EXPECT_TRUE(Becomes(10s, [&] { return absl::StrContains(ReadFile(log()), "the provider says invalid_scope"); }));
  // A name that an account with a password has already is nobody else's.
  CreateAccount("ann", access::v1::ROLE_MES_READER);
  Mode("good");
  ExpectNobody(Curl(GoAndComeBack("/parts")), "/parts?sign_in=stranger");
  // Another issuer's answer is none of this one's.
  const std::string back = GoAndComeBack("/");
  ExpectNobody(Curl(std::regex_replace(back, std::regex("iss=[^&]+"), "iss=https://evil.example")), "/?sign_in=again");
  plant_.Kill("plant");
  ExpectNobody(Curl(GoAndComeBack("/")), "/?sign_in=plant");
}

TEST_F(DirectorySignIn, ASlowProviderHoldsNobodyElseUp) {
  // Each a browser of its own, of two addresses.
  std::vector<std::string> anns, bobs;
  for (int i = 0; i < 6; ++i) {
    anns.push_back(BrowserComesBack("10.0.0.1"));
    bobs.push_back(BrowserComesBack("10.0.0.2"));
  }
  const std::string carols = BrowserComesBack("10.0.0.3");
  Mode("slow");
  const auto begun = std::chrono::steady_clock::now();
  const auto wait_for_slow = [this](std::size_t count) {
    EXPECT_TRUE(Becomes(8s, [&] { return AskedCount("/token slow") == count; }));
  };
  std::vector<std::thread> others;
  std::vector<std::string> answers(8);
  const auto begin = [&](std::size_t i, const std::string& command) {
    others.emplace_back([&answers, i, command] { answers[i] = ShellOutput(command); });
  };
  // One ticket takes one place, however often it comes.
  begin(0, anns[0]);
  wait_for_slow(1);
  EXPECT_THAT(ShellOutput(anns[0]), HasSubstr("sign_in=again"));
  EXPECT_THAT(ShellOutput(std::regex_replace(anns[0], std::regex("10\\.0\\.0\\.1"), "10.0.0.2")),
              HasSubstr("sign_in=again"));
  // As many as one address may have, and as there may be.
  for (std::size_t i = 1; i < 4; ++i) begin(i, anns[i]);
  wait_for_slow(4);
  EXPECT_THAT(ShellOutput(anns[4]), HasSubstr("sign_in=wait"));
  for (std::size_t i = 4; i < 8; ++i) begin(i, bobs[i - 4]);
  wait_for_slow(8);
  EXPECT_THAT(ShellOutput(bobs[4]), HasSubstr("sign_in=wait"));
  EXPECT_THAT(ShellOutput(carols), HasSubstr("sign_in=wait"));
  EXPECT_EQ(AskedCount("/token slow"), 8u);
  EXPECT_EQ(Curl("/health/live").status, 200);
  EXPECT_EQ(Curl("/").status, 200);
  EXPECT_EQ(Curl("/session").status, 200);
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::printf("others were answered %.1f s after the slow ones began\n", s);
  for (std::thread& each : others) each.join();
  for (const std::string& answer : answers) EXPECT_THAT(answer, HasSubstr("sign_in=provider"));
  const double all_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  std::printf("the slow ones ended after %.1f s\n", all_s);
  // The provider would take 30 s; the gateway waits for 10.
  EXPECT_GT(all_s, 9);
  EXPECT_LT(all_s, 25);
  // A gateway that is stopped meanwhile ends in order.
  std::thread waits([&anns] { ShellOutput(anns[5]); });
  wait_for_slow(9);
  kill(gateway_->pid(), SIGTERM);
  EXPECT_EQ(gateway_->Wait(30), 0);
  waits.join();
}

// Whoever answers there, and is not the provider by its certificate, is told no code.
TEST_F(DirectorySignIn, ACodeIsForTheProviderAlone) {
  for (const auto& [host, ca_file] : std::vector<std::pair<std::string, std::string>>{
           {"localhost", "/etc/ssl/certs/ca-certificates.crt"}, {"localhost", "/nowhere"}, {"127.0.0.1", ""}}) {
    SCOPED_TRACE(host + ca_file);
    Configure("", host, ca_file);
    Start();
    const WholeAnswer sent = Curl("/session/start");
    const std::string there = std::regex_replace(sent.Header("Location"), std::regex("//127.0.0.1:"), "//localhost:");
    const std::string back = Fetch(there, "").Header("Location");
    ASSERT_EQ(back.rfind(At(), 0), 0u) << back;
    ExpectNobody(Curl(back.substr(At().size())), "/?sign_in=provider");
  }
  EXPECT_EQ(AskedCount("/token given"), 0u);
  EXPECT_TRUE(Becomes(10s, [&] { return absl::StrContains(ReadFile(log()), "token_url: SSL peer certificate"); }));
}

// What the gateway is told, and what it does not start with.
TEST_F(DirectorySignIn, ASecretIsAFilesAndWhatIsOddIsRefusedByItsKey) {
  Write("secret", std::string(kSecret) + "\n");
  Configure();
  Start();
  ExpectNobody(Curl(GoAndComeBack("/")), "/?sign_in=settings");
  Write("client_secret", std::string(kSecret) + "\n");
  fs::permissions(folder_ / "client_secret", fs::perms::owner_read);
  const std::string file = "client_secret_file: " + (folder_ / "client_secret").string() + "\n";
  Configure(file);
  Start();
  EXPECT_EQ(Curl(GoAndComeBack("/parts")).Header("Location"), "/parts");
  EXPECT_THAT(Who(), HasSubstr("users/ann"));
  EXPECT_THAT(ReadFile("/proc/" + std::to_string(gateway_->pid()) + "/cmdline"), Not(HasSubstr(kSecret)));
  EXPECT_THAT(ReadFile(log()), Not(HasSubstr(kSecret)));

  gateway_.reset();
  const auto refused = [&](const std::string& more, const std::string& page) {
    Configure(more);
    std::vector<std::string> command = Command();
    command.back() = page;
    const std::string out = (folder_ / "out").string();
    fs::remove(out);
    Process process(command, out);
    EXPECT_EQ(process.Wait(30), 1) << more;
    return ReadFile(out);
  };
  EXPECT_THAT(refused("scope: profile\n", At()), HasSubstr("scope: profile, want words"));
  EXPECT_THAT(refused("asks_again: maybe\n", At()), HasSubstr("asks_again: maybe, want true or false"));
  EXPECT_THAT(refused("client_secret: x\n", At()), HasSubstr("client_secret, want a key that docs/access.md lists"));
  EXPECT_THAT(refused("client_secret_file: /nowhere\n", At()), HasSubstr("client_secret_file: /nowhere, want a file"));
  EXPECT_THAT(refused("", "https://plant.example/sixpoint"), HasSubstr("--page: https://plant.example/sixpoint, want"));
  EXPECT_THAT(refused("", "plant.example"), HasSubstr("--page: plant.example, want"));
  fs::permissions(folder_ / "client_secret", fs::perms::owner_read | fs::perms::others_read);
  const std::string open = refused(file, At());
  EXPECT_THAT(open, HasSubstr("which everybody may read, want a secret's file, mode 0600 or 0640"));
  EXPECT_THAT(open, Not(HasSubstr(kSecret)));
  // A file of before, without the gateway's keys: people sign in by password alone.
  Write("oidc.yaml", "issuer: https://id.plant.example\nclient_id: sixpoint\nkeys_file: /k\nroles: {a: admin}\n");
  Start();
  EXPECT_THAT(Curl("/session/provider").text, HasSubstr("\r\n\r\n{}"));
  EXPECT_THAT(Curl("/session/start").text, HasSubstr("IDENTITY_PROVIDER_MISSING"));
}

}  // namespace
}  // namespace sixpoint::testing
