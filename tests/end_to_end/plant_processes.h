// The plant's real executables ($SIXPOINT_BIN_DIR) as child processes on free ports, to be killed and started again.
#pragma once

#include <sys/types.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace sixpoint::testing {

// One child process; killed when this goes, or when the test process does.
class Process {
 public:
  // Standard output and error are appended to log_file.
  Process(const std::vector<std::string>& command, const std::string& log_file);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // The exit status (128 + signal where a signal ended it), or -1 while it runs.
  int Poll();
  // Waits at most that long; -1 when it still runs then.
  int Wait(double seconds);
  // SIGKILL, and gone when this returns.
  void Kill();

 private:
  pid_t pid_ = 0;
  int status_ = -1;
};

class PlantProcesses {
 public:
  // Starts the six services; they become ready by themselves.
  explicit PlantProcesses(const std::string& conninfo);
  ~PlantProcesses();

  static const std::vector<std::string>& Areas();
  static std::string Program(const std::string& name);
  // The plant service's address.
  std::string server() const { return addresses_.at("plant"); }
  std::string folder() const { return folder_; }
  std::string address(const std::string& area) const { return addresses_.at(area); }
  // Accepts connections within that time.
  bool WaitUntilUp(const std::string& area, double seconds) const;
  void Kill(const std::string& area);
  void Start(const std::string& area);
  // The ends of all logs, for a failed test.
  std::string Logs() const;

 private:
  std::string folder_, conninfo_;
  std::map<std::string, std::string> addresses_;
  std::map<std::string, std::unique_ptr<Process>> processes_;
};

// The whole text of a file; empty where there is none.
std::string ReadFile(const std::string& file);

}  // namespace sixpoint::testing
