#include "tests/end_to_end/plant_processes.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "services/runtime/credentials.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;

// Below those that the kernel gives to whoever calls out: one of these, or what is left of it for a minute, would keep a server out.
constexpr int kFirstPort = 10'000, kPortsToLookAt = 10'000;

bool IsFree(int port, int handle) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  return bind(handle, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
}

}  // namespace

std::vector<int> FreePorts(std::size_t count) {
  // Each process looks from a place of its own, so that two that look at once find others.
  static int next = static_cast<int>(getpid()) * 61 % kPortsToLookAt;
  std::vector<int> sockets, ports;
  for (int looked = 0; ports.size() < count && looked < kPortsToLookAt; ++looked) {
    const int port = kFirstPort + next++ % kPortsToLookAt;
    sockets.push_back(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (IsFree(port, sockets.back())) ports.push_back(port);
  }
  for (const int handle : sockets) close(handle);
  if (ports.size() == count) return ports;
  ADD_FAILURE() << "no free port";
  std::abort();
}

Process::Process(const std::vector<std::string>& command, const std::string& log_file) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    // Only calls that are safe after a fork of a process with threads.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent || log < 0 || dup2(log, 1) < 0 || dup2(log, 2) < 0) _exit(126);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  if (log >= 0) close(log);
  if (pid_ < 0) ADD_FAILURE() << "cannot start " << command[0];
}

Process::~Process() { Kill(); }

int Process::Poll() {
  int status = 0;
  if (status_ < 0 && pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_)
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return status_;
}

int Process::Wait(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (Poll() < 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return Poll();
}

void Process::Kill() {
  if (pid_ <= 0 || Poll() >= 0) return;
  kill(pid_, SIGKILL);
  int status = 0;
  waitpid(pid_, &status, 0);
  status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

const std::vector<std::string>& PlantProcesses::Areas() {
  static const std::vector<std::string> areas = {"plant",        "ingest",     "calibration",
                                                 "registration", "correction", "inspection"};
  return areas;
}

std::string PlantProcesses::Program(const std::string& name) {
  const char* folder = std::getenv("SIXPOINT_BIN_DIR");
  return (folder == nullptr ? std::string(".") : std::string(folder)) + "/" + name;
}

PlantProcesses::PlantProcesses(const std::string& conninfo)
    : conninfo_(conninfo),
      identity_(
          certificates_.User("tester", {identity::Role::kEngineer, identity::Role::kQuality, identity::Role::kAdmin})) {
  auto credentials = runtime::ChannelCredentialsOf(identity_);
  if (!credentials.ok()) {
    ADD_FAILURE() << credentials.status();
    std::abort();
  }
  credentials_ = *credentials;
  setenv("SIXPOINT_IDENTITY", identity_.c_str(), 1);
  std::string pattern = (fs::temp_directory_path() / "sixpoint-plant-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) {
    ADD_FAILURE() << "cannot make " << pattern;
    std::abort();
  }
  folder_ = pattern;
  const std::vector<int> ports = FreePorts(Areas().size());
  for (std::size_t i = 0; i < ports.size(); ++i) addresses_[Areas()[i]] = "127.0.0.1:" + std::to_string(ports[i]);
  for (const std::string& area : Areas()) Start(area);
}

PlantProcesses::~PlantProcesses() {
  unsetenv("SIXPOINT_IDENTITY");
  processes_.clear();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void PlantProcesses::Start(const std::string& area, const std::vector<std::string>& flags) {
  std::vector<std::string> command = {Program("sixpoint-" + area),
                                      "--listen",
                                      address(area),
                                      "--database",
                                      sixpoint::testing::AsRole(conninfo_, area),
                                      "--certificates",
                                      certificates_.Service(area),
                                      "--revoked",
                                      certificates_.revoked_file(),
                                      "--workers",
                                      Program(""),
                                      "--database-connections",
                                      "6"};
  for (const auto& [peer, at] : addresses_) command.insert(command.end(), {"--peer", peer + "=" + at});
  command.insert(command.end(), flags.begin(), flags.end());
  processes_[area] = std::make_unique<Process>(command, folder_ + "/" + area + ".log");
}

void PlantProcesses::Kill(const std::string& area) { processes_.at(area)->Kill(); }

bool PlantProcesses::WaitUntilUp(const std::string& area, double seconds) const {
  const auto channel = grpc::CreateChannel(address(area), credentials_);
  return channel->WaitForConnected(std::chrono::system_clock::now() +
                                   std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * seconds)));
}

std::string PlantProcesses::Logs() const {
  std::string all;
  for (const std::string& area : Areas()) {
    const std::string log = ReadFile(folder_ + "/" + area + ".log");
    all += "== " + area + "\n" + log.substr(log.size() - std::min<std::size_t>(log.size(), 3000)) + "\n";
  }
  return all;
}

std::string ReadFile(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace sixpoint::testing
