#include <dirent.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "cli/doctor/gather.h"
#include "cli/log_files.h"
#include "cli/service_user.h"
#include "cli/subprocess.h"
#include "cli/supervisor.h"

namespace sixpoint::cli::doctor {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostProcesses = 20000, kMostDescriptors = 100000;

// The inodes of sockets that listen at these ports.
std::map<std::string, int> ListeningSockets(bool* known) {
  constexpr char kListen[] = "0A";
  std::map<std::string, int> port_by_inode;
  for (const char* file : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream table(file);
    if (table) *known = true;
    std::string line;
    std::getline(table, line);
    while (std::getline(table, line)) {
      std::istringstream words(line);
      std::string number, local, remote, state, queues, timer, retransmits, uid, timeout, inode;
      words >> number >> local >> remote >> state >> queues >> timer >> retransmits >> uid >> timeout >> inode;
      const std::size_t colon = local.rfind(':');
      if (state != kListen || colon == std::string::npos) continue;
      port_by_inode["socket:[" + inode + "]"] = static_cast<int>(std::strtol(local.c_str() + colon + 1, nullptr, 16));
    }
  }
  return port_by_inode;
}

std::string NameOfProcess(const std::string& pid) {
  std::string name;
  std::ifstream comm("/proc/" + pid + "/comm");
  std::getline(comm, name);
  return name;
}

struct ClosesFolder {
  void operator()(DIR* folder) const { closedir(folder); }
};

// Of each process that this user may look into, who has which of these sockets.
std::map<int, Listener> ListenersByPort(const std::map<std::string, int>& sockets) {
  std::map<int, Listener> by_port;
  for (const auto& [inode, port] : sockets) by_port[port];
  const std::unique_ptr<DIR, ClosesFolder> processes(opendir("/proc"));
  std::size_t looked = 0;
  while (const dirent* const process = processes == nullptr ? nullptr : readdir(processes.get())) {
    const std::string pid = process->d_name;
    if (pid.find_first_not_of("0123456789") != std::string::npos || ++looked > kMostProcesses) continue;
    const std::string folder = "/proc/" + pid + "/fd";
    const std::unique_ptr<DIR, ClosesFolder> descriptors(opendir(folder.c_str()));
    std::size_t count = 0;
    while (const dirent* const descriptor = descriptors == nullptr ? nullptr : readdir(descriptors.get())) {
      std::array<char, 64> target{};
      if (++count > kMostDescriptors ||
          readlink((folder + "/" + descriptor->d_name).c_str(), target.data(), target.size() - 1) <= 0)
        continue;
      const auto socket = sockets.find(target.data());
      if (socket != sockets.end()) by_port[socket->second] = {std::stoi(pid), NameOfProcess(pid)};
    }
  }
  return by_port;
}

void GatherDescriptors(Service* service) {
  if (!service->pid) return;
  const std::string process = "/proc/" + std::to_string(*service->pid);
  std::ifstream limits(process + "/limits");
  for (std::string line; std::getline(limits, line);) {
    if (line.rfind("Max open files", 0) != 0) continue;
    const std::int64_t soft = std::strtoll(line.c_str() + 14, nullptr, 10);
    if (soft > 0) service->descriptor_limit = soft;
  }
  std::error_code unseen;
  std::int64_t count = 0;
  for (fs::directory_iterator each(process + "/fd", unseen), end; !unseen && each != end; each.increment(unseen))
    ++count;
  if (!unseen && count > 0) service->descriptor_count = count;
}

// "ingest    RUNNING   pid 815, uptime 0:00:05"
void ReadSupervisor(const std::string& output, Facts* facts) {
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, state, pid_word, pid;
    words >> name >> state >> pid_word >> pid;
    if (name == "watchdog") facts->watchdog_state = state;
    for (Service& service : facts->services) {
      if (service.area != name) continue;
      service.state = state;
      if (pid_word == "pid") service.pid = static_cast<pid_t>(std::strtol(pid.c_str(), nullptr, 10));
    }
  }
}

}  // namespace

void GatherProcesses(const LocalPlant& plant, Facts* facts) {
  const std::string config = plant.supervisor_config().string();
  std::error_code none;
  if (fs::exists(config, none)) {
    const Finished asked =
        RunProgram(AsServiceUser({"timeout", "--kill-after=1", "5", "supervisorctl", "-c", config, "status"}));
    // 3: some of its programs do not run.
    facts->supervised = asked.exit_code == 0 || asked.exit_code == 3;
    if (facts->supervised) ReadSupervisor(asked.output, facts);
    if (asked.exit_code == 124 || asked.exit_code == 137)
      facts->supervisor_why_not = "the supervisor does not answer within 5 s: it is stuck";
  }
  bool known = false;
  const std::map<std::string, int> sockets = ListeningSockets(&known);
  const std::map<int, Listener> listeners = ListenersByPort(sockets);
  for (Service& service : facts->services) {
    service.listeners_known = known;
    if (const auto found = listeners.find(service.port); found != listeners.end()) service.listener = found->second;
    GatherDescriptors(&service);
    const Finished version = RunProgram(AsServiceUser(
        {"timeout", "--kill-after=1", "5", (plant.binaries / ("sixpoint-" + service.area)).string(), "--version"}));
    if (version.exit_code == 0) service.program_version = version.output.substr(0, version.output.find('\n'));
  }
}

Restarts GatherRestarts(const LocalPlant& plant, Time since) {
  Restarts restarts;
  LogStart start;
  start.since = since;
  start.last_bytes = 4 << 20;  // what has said more in a day has said enough
  std::vector<LogFile> files = LogFilesIn(plant.logs(), {"supervisord", "watchdog"}, FindServiceUser().uid, start);
  ForEachLogLine(&files, /*half_lines=*/false, [&](const LogLine& line) {
    if (!line.time || *line.time < since) return true;
    if (line.source == "watchdog") {
      const std::string said = FieldText(line, "msg");
      if (const std::size_t end = said.find(" does not answer"); end != std::string::npos)
        ++restarts.ended_by_watchdog[said.substr(0, end)];
      return true;
    }
    // "exited: ingest (terminated by SIGSEGV (core dumped); not expected)"
    const std::string begin = "exited: ";
    if (line.text.rfind(begin, 0) != 0 || line.text.find("not expected") == std::string::npos) return true;
    const std::string program = line.text.substr(begin.size(), line.text.find(' ', begin.size()) - begin.size());
    ++restarts.unexpected_ends[program];
    for (const char* signal : {"SIGSEGV", "SIGABRT", "SIGBUS", "SIGFPE", "SIGILL", "SIGSYS"})
      if (line.text.find(signal) != std::string::npos) ++restarts.crashes[program];
    return true;
  });
  return restarts;
}

}  // namespace sixpoint::cli::doctor
