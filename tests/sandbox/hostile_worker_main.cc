// What foreign code in a worker would try. usage: sixpoint-hostile-worker HOW ACT [TARGET]
// HOW: confined (as the workers are), without-files (Landlock alone), free.
// Exit code 0: the act succeeded. Otherwise the errno that refused it.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <string>

#include "sandbox/confine.h"
#include "sandbox/landlock.h"

namespace {

constexpr std::size_t kPageBytes = 4096;

bool ReadsByte(int descriptor) {
  char byte = 0;
  return read(descriptor, &byte, 1) == 1;
}

bool Reads(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY);
  return file >= 0 && ReadsByte(file);
}

bool Writes(const std::string& path) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
  return file >= 0 && write(file, "x", 1) == 1;
}

bool ConnectsToUnixSocket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int client = socket(AF_UNIX, SOCK_STREAM, 0);
  return client >= 0 && connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
}

bool ConnectsToPort(const std::string& port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(port)));
  const int client = socket(AF_INET, SOCK_STREAM, 0);
  return client >= 0 && connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
}

bool LimitsItsParent() {
  rlimit limit{};
  return prlimit(getppid(), RLIMIT_CORE, nullptr, &limit) == 0 && prlimit(getppid(), RLIMIT_CORE, &limit, nullptr) == 0;
}

bool ReadsItsParentsMemory() {
  char copy = 0;
  iovec mine{&copy, 1}, its{&copy, 1};
  // EFAULT: it has the right, and guessed the address wrong.
  return process_vm_readv(getppid(), &mine, 1, &its, 1, 0) >= 0 || errno == EFAULT;
}

bool Forks() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  return child > 0 && waitpid(child, nullptr, 0) == child;
}

bool StartsThread() {
  static char stack[16 * kPageBytes];
  const auto sleep = [](void*) -> int { return 0; };
  return clone(sleep, stack + sizeof stack, CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD, nullptr) >
         0;
}

bool RunsProgram() {
  char* const arguments[] = {const_cast<char*>("/bin/true"), nullptr};
  char* const environment[] = {nullptr};
  return execve(arguments[0], arguments, environment) == 0;  // which returns only where it fails
}

bool MapsExecutable() {
  return mmap(nullptr, kPageBytes, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) !=
         MAP_FAILED;
}

bool MakesExecutable() {
  void* page = mmap(nullptr, kPageBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return page != MAP_FAILED && mprotect(page, kPageBytes, PROT_READ | PROT_EXEC) == 0;
}

bool MapsItsInput() { return mmap(nullptr, kPageBytes, PROT_READ, MAP_SHARED, STDIN_FILENO, 0) != MAP_FAILED; }

// Address space beyond the limit of the confinement below.
bool TakesMuchMemory() {
  return mmap(nullptr, std::size_t{1} << 30, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1,
              0) != MAP_FAILED;
}

bool LiftsItsMemoryLimit() {
  const rlimit limit{RLIM_INFINITY, RLIM_INFINITY};
  return setrlimit(RLIMIT_AS, &limit) == 0;
}

// What parsing itself needs: these succeed where all else fails.
bool Parses() {
  void* page = mmap(nullptr, kPageBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  const rlimit limit{60, RLIM_INFINITY};
  return page != MAP_FAILED && munmap(page, kPageBytes) == 0 && ReadsByte(STDIN_FILENO) &&
         write(STDOUT_FILENO, "x", 1) == 1 && setrlimit(RLIMIT_CPU, &limit) == 0 &&
         syscall(SYS_tgkill, getpid(), gettid(), 0) == 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string how = argv[1], act = argv[2], target = argc > 3 ? argv[3] : "";
  const std::map<std::string, std::function<bool()>> acts{
      {"parse", Parses},
      {"wait", [] { return ReadsByte(STDIN_FILENO); }},
      {"read file", [&] { return Reads(target); }},
      {"write file", [&] { return Writes(target); }},
      {"list folder", [&] { return open(target.c_str(), O_RDONLY | O_DIRECTORY) >= 0; }},
      {"remove file", [&] { return unlink(target.c_str()) == 0; }},
      {"read parent's environment", [] { return Reads("/proc/" + std::to_string(getppid()) + "/environ"); }},
      {"read parent's command line", [] { return Reads("/proc/" + std::to_string(getppid()) + "/cmdline"); }},
      {"read parent's memory", ReadsItsParentsMemory},
      {"take parent's descriptor",
       [] {
         const long parent = syscall(SYS_pidfd_open, getppid(), 0);
         return parent >= 0 && syscall(SYS_pidfd_getfd, parent, STDIN_FILENO, 0) >= 0;
       }},
      {"trace parent", [] { return ptrace(PTRACE_SEIZE, getppid(), nullptr, nullptr) == 0; }},
      {"signal parent", [] { return kill(getppid(), 0) == 0; }},
      {"signal parent's thread", [] { return syscall(SYS_tgkill, getppid(), getppid(), 0) == 0; }},
      {"limit parent", LimitsItsParent},
      {"connect to Unix socket", [&] { return ConnectsToUnixSocket(target); }},
      {"connect to TCP port", [&] { return ConnectsToPort(target); }},
      {"make socket pair",
       [] {
         int pair[2];
         return socketpair(AF_UNIX, SOCK_STREAM, 0, pair) == 0;
       }},
      {"fork", Forks},
      {"start thread", StartsThread},
      {"run program", RunsProgram},
      {"map executable memory", MapsExecutable},
      {"make memory executable", MakesExecutable},
      {"map a file", MapsItsInput},
      {"take much memory", TakesMuchMemory},
      {"lift its memory limit", LiftsItsMemoryLimit},
      {"write to its input", [] { return write(STDIN_FILENO, "x", 1) == 1; }},
      {"duplicate a descriptor", [] { return dup(STDIN_FILENO) >= 0; }},
      {"become dumpable", [] { return prctl(PR_SET_DUMPABLE, 1, 0, 0, 0) == 0; }},
      {"make a namespace", [] { return unshare(CLONE_FS) == 0; }},
      {"make an I/O ring",
       [] {
         char parameters[120] = {};
         return syscall(SYS_io_uring_setup, 1, parameters) >= 0;
       }},
  };
  const auto chosen = acts.find(act);
  if (chosen == acts.end()) return 2;
  sixpoint::sandbox::Confinement confinement;
  confinement.memory_bytes = rlim_t{512} << 20;
  confinement.file_bytes = kPageBytes;
  if (how == "confined") sixpoint::sandbox::Confine(confinement);
  if (how == "without-files" && (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || !sixpoint::sandbox::GiveUpFiles()))
    return sixpoint::sandbox::kNotConfined;
  errno = 0;
  _exit(chosen->second() ? 0 : errno);
}
