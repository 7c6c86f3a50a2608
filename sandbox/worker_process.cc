#include "sandbox/worker_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sandbox/confine.h"

namespace sixpoint::sandbox {
namespace {

// Copies of the descriptors, with numbers beyond those that the worker has: none is overwritten before it is passed on.
class Copies {
 public:
  explicit Copies(const std::vector<int>& descriptors) {
    for (const int descriptor : descriptors) {
      const int copied = descriptor == kNothing ? open("/dev/null", O_RDWR | O_CLOEXEC) : descriptor;
      copies_.push_back(fcntl(copied, F_DUPFD_CLOEXEC, static_cast<int>(descriptors.size())));
      if (copies_.back() < 0) error_ = errno;
      if (descriptor == kNothing && copied >= 0) close(copied);
    }
  }
  ~Copies() {
    for (const int copy : copies_) {
      if (copy >= 0) close(copy);
    }
  }
  Copies(const Copies&) = delete;
  Copies& operator=(const Copies&) = delete;
  const std::vector<int>& numbers() const { return copies_; }
  int error() const { return error_; }

 private:
  std::vector<int> copies_;
  int error_ = 0;
};

}  // namespace

absl::StatusOr<pid_t> StartWorker(std::vector<std::string> command, const std::vector<int>& descriptors) {
  const Copies copies(descriptors);
  std::vector<char*> arguments;
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  char* environment[] = {nullptr};

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  int number = 0;
  for (const int copy : copies.numbers()) posix_spawn_file_actions_adddup2(&actions, copy, number++);
  posix_spawn_file_actions_addclosefrom_np(&actions, number);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = -1;
  const int failure = copies.error() != 0
                          ? copies.error()
                          : posix_spawn(&pid, arguments[0], &actions, &attributes, arguments.data(), environment);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) return absl::UnavailableError(command[0] + ": " + std::strerror(failure));
  return pid;
}

bool CouldNotConfine(int wait_status) { return WIFEXITED(wait_status) && WEXITSTATUS(wait_status) == kNotConfined; }

}  // namespace sixpoint::sandbox
