#include "tests/support/object_store_server.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;

class Server {
 public:
  Server() {
    const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
    if (source == nullptr) {
      why_not_ = "SIXPOINT_SOURCE_DIR is not set, want the repository's root (ctest sets it)";
      return;
    }
    folder_ = (fs::temp_directory_path() / "sixpoint-objects-XXXXXX").string();
    int input[2], output[2];
    if (mkdtemp(folder_.data()) == nullptr || pipe(input) != 0 || pipe(output) != 0) {
      why_not_ = "cannot make " + folder_;
      return;
    }
    const std::string script = std::string(source) + "/tests/support/object_store_server";
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      dup2(input[0], 0);
      dup2(output[1], 1);
      for (const int end : {input[0], input[1], output[0], output[1]}) close(end);
      execl(script.c_str(), script.c_str(), folder_.c_str(), nullptr);
      _exit(127);
    }
    close(input[0]);
    close(output[1]);
    input_ = input[1];
    std::string line;
    char c = 0;
    while (read(output[0], &c, 1) == 1 && c != '\n') line += c;
    close(output[0]);
    if (line.rfind("ready ", 0) == 0) {
      port_ = line.substr(6);
    } else {
      why_not_ = line.empty() ? "the object store's script ended, see tests/support/object_store_server" : line;
    }
  }

  ~Server() {
    if (input_ >= 0) close(input_);
    if (pid_ > 0) {
      kill(pid_, SIGTERM);
      waitpid(pid_, nullptr, 0);
    }
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }

  std::string why_not_, port_;

 private:
  std::string folder_;
  pid_t pid_ = 0;
  int input_ = -1;
};

const Server& TheServer() {
  static const Server server;
  return server;
}

}  // namespace

const std::string& WhyNoObjectStore() { return TheServer().why_not_; }

storage::S3Config ObjectStoreConfig() {
  storage::S3Config config;
  config.endpoint = "http://127.0.0.1:" + TheServer().port_;
  config.bucket = "clouds";
  config.access_key = "plant";
  config.secret_key = "plant-secret";
  return config;
}

}  // namespace sixpoint::testing
