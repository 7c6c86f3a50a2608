#include "tests/end_to_end/plant_on_this_machine.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "tests/end_to_end/plant_processes.h"

namespace sixpoint::testing {

namespace fs = std::filesystem;

namespace {

// The first of ports that no other test on this machine uses, as long as this process lives: a plant that is down holds no port
// itself, and another test's would come up there. The mark is a socket's abstract name, which the kernel frees.
int PortsOfThisProcess() {
  constexpr int kFirstPort = 20'000, kPlaces = 90, kPortsEach = 140;  // room for two plants, and where each is seen
  for (int tried = 0; tried < kPlaces; ++tried) {
    const int place = (static_cast<int>(getpid()) + tried) % kPlaces;
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    const std::string mark = "sixpoint-test-ports-" + std::to_string(place);
    mark.copy(name.sun_path + 1, sizeof name.sun_path - 1);
    const int handle = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (bind(handle, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0)
      return kFirstPort + place * kPortsEach;
    close(handle);
  }
  ADD_FAILURE() << "every place is taken";
  std::abort();
}

}  // namespace

void PlantOnThisMachine::SetUp() {
  if (std::system("command -v supervisord >/dev/null") != 0) GTEST_SKIP() << "SKIPPED: no supervisord";
  std::string pattern = (fs::temp_directory_path() / "sixpoint-up-XXXXXX").string();
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  folder_ = pattern;
  chmod(folder_.c_str(), 0755);  // the services run as another user
  static const int ports = PortsOfThisProcess();
  port_ = ports;
  // Else the plant would be looked for where one without --data is.
  setenv("SIXPOINT_IDENTITY", (data() + "/certificates/local").c_str(), 1);
}

void PlantOnThisMachine::TearDown() {
  unsetenv("SIXPOINT_IDENTITY");
  if (folder_.empty()) return;
  Run({"down", "--data", data()});
  fs::remove_all(folder_);
}

PlantOnThisMachine::Answer PlantOnThisMachine::Run(std::vector<std::string> words) {
  words.insert(words.begin(), PlantProcesses::Program("sixpoint"));
  const std::string log = (folder_ / (std::to_string(++run_count_) + ".log")).string();
  Process process(words, log);
  const int exit_code = process.Wait(120);
  return {exit_code, ReadFile(log)};
}

PlantOnThisMachine::Answer PlantOnThisMachine::Up(std::vector<std::string> options) {
  const std::vector<std::string> words = {"up", "--data", data(), "--base-port", std::to_string(port_)};
  options.insert(options.begin(), words.begin(), words.end());
  return Run(options);
}

std::string PlantOnThisMachine::Order(const std::string& words) {
  return ShellOutput("supervisorctl -c " + data() + "/supervisord.conf " + words);
}

std::string PlantOnThisMachine::Sql(const std::string& statement) {
  return ShellOutput("psql -h " + data() + "/run -U sixpoint -d sixpoint -Atc \"" + statement + "\"");
}

std::string ShellOutput(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return "cannot run " + command;
  std::string output;
  for (char buffer[4096]; const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe);)
    output.append(buffer, got);
  pclose(pipe);
  while (!output.empty() && output.back() == '\n') output.pop_back();
  return output;
}

std::string ServiceShellOutput(const std::string& command) {
  const std::string user = geteuid() == 0 ? "setpriv --reuid=sixpoint --regid=sixpoint --init-groups " : "";
  return ShellOutput(user + "sh -c '" + command + "'");
}

}  // namespace sixpoint::testing
