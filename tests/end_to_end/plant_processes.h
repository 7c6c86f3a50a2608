// The plant's real executables ($SIXPOINT_BIN_DIR) as child processes on free ports, to be killed and started again.
#pragma once

#include <grpcpp/security/credentials.h>
#include <sys/types.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/plant_certificates.h"

namespace sixpoint::testing {

// One child process; killed when this goes, or when the test process does.
class Process {
 public:
  // Standard output and error are appended to log_file.
  Process(const std::vector<std::string>& command, const std::string& log_file);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
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
  // Starts the six services; they become ready by themselves. While it lives $SIXPOINT_IDENTITY is identity(), so that programs
  // which the test starts are let in.
  explicit PlantProcesses(const std::string& conninfo);
  ~PlantProcesses();

  static const std::vector<std::string>& Areas();
  static std::string Program(const std::string& name);
  // The plant service's address.
  std::string server() const { return addresses_.at("plant"); }
  std::string folder() const { return folder_; }
  std::string address(const std::string& area) const { return addresses_.at(area); }
  // A user with the roles engineer, quality and admin: the folder, and what a channel takes.
  std::string identity() const { return identity_; }
  std::shared_ptr<grpc::ChannelCredentials> credentials() const { return credentials_; }
  PlantCertificates& certificates() { return certificates_; }
  // Accepts connections within that time.
  bool WaitUntilUp(const std::string& area, double seconds) const;
  void Kill(const std::string& area);
  // With a certificate of its own, new at each start, and these flags besides.
  void Start(const std::string& area, const std::vector<std::string>& flags = {});
  // The ends of all logs, for a failed test.
  std::string Logs() const;

 private:
  std::string folder_, conninfo_;
  PlantCertificates certificates_;
  std::string identity_;
  std::shared_ptr<grpc::ChannelCredentials> credentials_;
  std::map<std::string, std::string> addresses_;
  std::map<std::string, std::unique_ptr<Process>> processes_;
};

// Ports on which nobody listened a moment ago.
std::vector<int> FreePorts(std::size_t count);
// The whole text of a file; empty where there is none.
std::string ReadFile(const std::string& file);

}  // namespace sixpoint::testing
