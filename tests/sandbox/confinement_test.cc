// What foreign code can do in a worker: each act is tried free, where it must succeed, and confined, where it must not.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "sandbox/confine.h"
#include "sandbox/landlock.h"
#include "sandbox/worker_process.h"
#include "tests/sandbox/denied_call.h"

namespace sixpoint::sandbox {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

constexpr char kSecret[] = "the-key-of-the-object-store";

std::string Program() {
  const char* folder = std::getenv("SIXPOINT_BIN_DIR");
  return fs::absolute(folder == nullptr ? "." : folder) / "sixpoint-hostile-worker";
}

std::string Contents(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Where a worker reads and writes: a file in memory.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("worker", MFD_CLOEXEC)) { EXPECT_EQ(ftruncate(descriptor_, 4096), 0); }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

// What waitpid says of the act.
int Outcome(const std::string& how, const std::string& act, const std::string& target = "") {
  const MemoryFile input, output;
  const auto pid = StartWorker({Program(), how, act, target}, {input.descriptor(), output.descriptor(), kNothing});
  EXPECT_TRUE(pid.ok()) << pid.status();
  int status = -1;
  if (pid.ok()) waitpid(*pid, &status, 0);
  return status;
}

bool Succeeded(int status) { return WIFEXITED(status) && WEXITSTATUS(status) == 0; }
// What a worker sees of a refusal: it is ended, or an error.
bool Killed(int status) { return WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS; }
bool Denied(int status) { return WIFEXITED(status) && (WEXITSTATUS(status) == EACCES || WEXITSTATUS(status) == EPERM); }

std::string Text(int status) {
  return WIFSIGNALED(status) ? std::string("ended by ") + strsignal(WTERMSIG(status))
                             : std::string("errno ") + strerror(WEXITSTATUS(status));
}

// A plant in small: a file of keys that anybody may read, and a database that listens on a socket and a port.
class HostileWorker : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = fs::temp_directory_path() / "sixpoint-confinement-XXXXXX";
    folder_ = mkdtemp(name.data());
    fs::permissions(folder_, fs::perms::all);
    std::ofstream(keys_ = folder_ / "keys") << kSecret;

    sockaddr_un local{};
    local.sun_family = AF_UNIX;
    socket_path_ = folder_ / "database";
    socket_path_.copy(local.sun_path, sizeof local.sun_path - 1);
    local_ = Listening(AF_UNIX, reinterpret_cast<sockaddr*>(&local), sizeof local);
    fs::permissions(socket_path_, fs::perms::all);

    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    network_ = Listening(AF_INET, reinterpret_cast<sockaddr*>(&any), sizeof any);
    socklen_t size = sizeof any;
    ASSERT_EQ(getsockname(network_, reinterpret_cast<sockaddr*>(&any), &size), 0);
    port_ = std::to_string(ntohs(any.sin_port));
  }
  void TearDown() override {
    close(local_);
    close(network_);
    fs::remove_all(folder_);
  }
  static int Listening(int family, sockaddr* address, socklen_t size) {
    const int listener = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(bind(listener, address, size), 0);
    EXPECT_EQ(listen(listener, 8), 0);
    return listener;
  }

  fs::path folder_, keys_;
  std::string socket_path_, port_;
  int local_ = -1, network_ = -1;
};

// Debian's kernel lets a process trace its descendants only, unless told otherwise; then the free act fails too.
bool TracingIsRestricted() {
  const std::string scope = Contents("/proc/sys/kernel/yama/ptrace_scope");
  return geteuid() != 0 && !scope.empty() && scope[0] != '0';
}

TEST_F(HostileWorker, IsRefusedEveryAct) {
  if (!kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  struct Act {
    const char* name;
    std::string target;
    bool needs_tracing = false;
  };
  const std::string made = folder_ / "made", removed = folder_ / "removed";
  const std::vector<Act> acts{
      {"read file", keys_},
      {"write file", made},
      {"list folder", folder_},
      {"remove file", removed},
      {"read parent's environment", ""},
      {"read parent's command line", ""},
      {"read parent's memory", "", true},
      {"take parent's descriptor", "", true},
      {"trace parent", "", true},
      {"signal parent", ""},
      {"signal parent's thread", ""},
      {"limit parent", ""},
      {"connect to Unix socket", socket_path_},
      {"connect to TCP port", port_},
      {"make socket pair", ""},
      {"fork", ""},
      {"start thread", ""},
      {"run program", ""},
      {"map executable memory", ""},
      {"make memory executable", ""},
      {"map a file", ""},
      {"lift its memory limit", ""},
      {"write to its input", ""},
      {"duplicate a descriptor", ""},
      {"become dumpable", ""},
      {"make a namespace", ""},
  };
  for (const Act& act : acts) {
    SCOPED_TRACE(act.name);
    std::ofstream(removed) << "x";
    if (!act.needs_tracing || !TracingIsRestricted()) {
      const int free = Outcome("free", act.name, act.target);
      EXPECT_TRUE(Succeeded(free)) << Text(free);
    }
    fs::remove(made);
    std::ofstream(removed) << "x";
    const int confined = Outcome("confined", act.name, act.target);
    EXPECT_TRUE(Killed(confined) || Denied(confined)) << Text(confined);
    EXPECT_FALSE(fs::exists(made));
    EXPECT_TRUE(fs::exists(removed));
  }
  const int ring = Outcome("confined", "make an I/O ring");  // many kernels refuse it to everybody
  EXPECT_TRUE(Killed(ring)) << Text(ring);
}

TEST_F(HostileWorker, CanStillParse) {
  const int free = Outcome("free", "parse"), confined = Outcome("confined", "parse");
  EXPECT_TRUE(Succeeded(free)) << Text(free);
  EXPECT_TRUE(Succeeded(confined)) << Text(confined);
}

TEST_F(HostileWorker, HasLittleMemory) {
  if (!kApplied) GTEST_SKIP() << "sanitizers reserve terabytes of address space";
  EXPECT_TRUE(Succeeded(Outcome("free", "take much memory")));
  const int confined = Outcome("confined", "take much memory");
  EXPECT_TRUE(WIFEXITED(confined) && WEXITSTATUS(confined) == ENOMEM) << Text(confined);
}

// The kernel's own rule, behind the filter: whatever the filter let through, files stay out of reach.
TEST_F(HostileWorker, HasNoFilesByLandlockAlone) {
  const int version = LandlockVersion();
  if (version == 0) GTEST_SKIP() << "this kernel has no Landlock, or has it switched off";
  RecordProperty("landlock_version", version);
  const std::string made = folder_ / "made";
  const auto expect_denied = [&](const char* act, const std::string& target) {
    SCOPED_TRACE(act);
    std::ofstream(keys_) << kSecret;
    const int free = Outcome("free", act, target);
    std::ofstream(keys_) << kSecret;
    const int without_files = Outcome("without-files", act, target);
    EXPECT_TRUE(Succeeded(free)) << Text(free);
    EXPECT_TRUE(Denied(without_files)) << Text(without_files);
  };
  expect_denied("read file", keys_);
  expect_denied("write file", made);
  expect_denied("list folder", folder_);
  expect_denied("remove file", keys_);
  expect_denied("read parent's command line", "");
  expect_denied("run program", "");
  if (version >= 4) expect_denied("connect to TCP port", port_);
  if (version >= 6) expect_denied("signal parent", "");
}

// A worker that waits, with what it inherited from a starter that holds secrets.
class WaitingWorker {
 public:
  explicit WaitingWorker(const std::string& how) {
    EXPECT_EQ(pipe2(pipe_, O_CLOEXEC), 0);
    const auto started = StartWorker({Program(), how, "wait"}, {pipe_[0], kNothing, kNothing});
    EXPECT_TRUE(started.ok()) << started.status();
    pid_ = started.value_or(-1);
  }
  ~WaitingWorker() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(pipe_[0]);
    close(pipe_[1]);
  }
  WaitingWorker(const WaitingWorker&) = delete;
  WaitingWorker& operator=(const WaitingWorker&) = delete;

  fs::path Folder() const { return "/proc/" + std::to_string(pid_); }
  // Until it sleeps in its act, behind the filter; false after five seconds.
  bool WaitForAct(const std::string& sign) const {
    for (int attempt = 0; attempt < 500; ++attempt) {
      if (Contents(Folder() / "status").find(sign) != std::string::npos) return true;
      usleep(10'000);
    }
    return false;
  }

 private:
  int pipe_[2] = {-1, -1};
  pid_t pid_ = -1;
};

TEST_F(HostileWorker, InheritsNothing) {
  ASSERT_EQ(setenv("SIXPOINT_TEST_SECRET", kSecret, 1), 0);
  const int inherited = open(keys_.c_str(), O_RDONLY);  // a library that forgot O_CLOEXEC
  ASSERT_GE(inherited, 3);
  {
    const WaitingWorker worker("free");
    ASSERT_TRUE(worker.WaitForAct("State:\tS"));
    EXPECT_EQ(Contents(worker.Folder() / "environ"), "");
    std::vector<std::string> descriptors;
    for (const auto& entry : fs::directory_iterator(worker.Folder() / "fd"))
      descriptors.push_back(entry.path().filename());
    std::sort(descriptors.begin(), descriptors.end());
    EXPECT_THAT(descriptors, ElementsAre("0", "1", "2"));
    EXPECT_EQ(fs::read_symlink(worker.Folder() / "fd/2"), "/dev/null");
  }
  close(inherited);
  unsetenv("SIXPOINT_TEST_SECRET");
}

TEST_F(HostileWorker, HasNoRights) {
  if (!kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  const gid_t group = 0;
  if (geteuid() == 0) {  // one to lose
    ASSERT_EQ(setgroups(1, &group), 0);
  }
  const WaitingWorker worker("confined");
  ASSERT_TRUE(worker.WaitForAct("Seccomp:\t2\n"));
  const std::string status = Contents(worker.Folder() / "status");
  EXPECT_THAT(status, HasSubstr("NoNewPrivs:\t1\n"));
  EXPECT_THAT(status, HasSubstr("CapPrm:\t0000000000000000\n"));
  EXPECT_THAT(status, HasSubstr("CapEff:\t0000000000000000\n"));
  EXPECT_THAT(status, HasSubstr("CapAmb:\t0000000000000000\n"));
  // Not dumpable: what /proc shows of it is root's.
  struct stat memory {};
  ASSERT_EQ(stat((worker.Folder() / "mem").c_str(), &memory), 0);
  EXPECT_EQ(memory.st_uid, 0U);
  EXPECT_THAT(Contents(worker.Folder() / "limits"), HasSubstr("Max core file size        0                    0 "));
  if (geteuid() != 0) return;
  EXPECT_THAT(status, HasSubstr("Uid:\t65534\t65534\t65534\t65534\n"));
  EXPECT_THAT(status, HasSubstr("Gid:\t65534\t65534\t65534\t65534\n"));
  EXPECT_THAT(status, HasSubstr("Groups:\t \n"));
  EXPECT_EQ(fs::read_symlink(worker.Folder() / "cwd"), "/");
}

// A kernel without Landlock: the worker starts all the same, and the filter alone refuses what it refused.
TEST_F(HostileWorker, IsHeldWithoutLandlock) {
  if (!kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  const auto refused = [&](const char* act, const std::string& target) {
    const int status = Outcome("confined", act, target);
    return Killed(status) || Denied(status);
  };
  EXPECT_EXIT(
      {
        testing::DenyCall("landlock_create_ruleset", ENOSYS);
        const bool held = LandlockVersion() == 0 && Succeeded(Outcome("confined", "parse")) &&
                          refused("read file", keys_) && refused("write file", folder_ / "made") &&
                          refused("connect to Unix socket", socket_path_) && refused("connect to TCP port", port_) &&
                          refused("signal parent", "") && refused("read parent's environment", "");
        _exit(held ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST_F(HostileWorker, EndsWhereItCannotConfineItself) {
  if (!kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  EXPECT_EXIT(
      {
        testing::DenyCall("seccomp", EPERM);
        _exit(CouldNotConfine(Outcome("confined", "parse")) ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "");
}

TEST(WorkerProcess, SaysThatItsProgramIsMissing) {
  const auto pid = StartWorker({"/nowhere/worker"}, {kNothing});
  EXPECT_TRUE(absl::IsUnavailable(pid.status()));
  EXPECT_THAT(std::string(pid.status().message()), HasSubstr("/nowhere/worker: No such file"));
  EXPECT_TRUE(
      absl::IsUnavailable(StartWorker({Program(), "free", "parse"}, {1'000'000}).status()));  // no such descriptor
}

}  // namespace
}  // namespace sixpoint::sandbox
