#include "services/plant/cad_worker.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <sstream>
#include <thread>
#include <vector>

#include "refusal/message_text.h"
#include "sandbox/worker_process.h"
#include "services/runtime/errors.h"

namespace sixpoint::plant {
namespace {

constexpr int kRefused = 2;  // the worker's own exit code for a file that it does not take
constexpr std::size_t kGreatestMeshBytes = std::size_t{512} << 20;
constexpr std::size_t kGreatestMessageBytes = 2000;

// A file in memory without a name.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : descriptor_(memfd_create(name, MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int descriptor() const { return descriptor_; }

  bool Write(const std::string& bytes) const {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t put = pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
      if (put < 0 && errno == EINTR) continue;
      if (put <= 0) return false;
      done += static_cast<std::size_t>(put);
    }
    return true;
  }

  // At most `limit` bytes from its beginning.
  std::string Read(std::size_t limit) const {
    struct stat status {};
    if (fstat(descriptor_, &status) != 0) return {};
    std::string bytes(std::min(limit, static_cast<std::size_t>(status.st_size)), '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t got = pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      done += static_cast<std::size_t>(got);
    }
    bytes.resize(done);
    return bytes;
  }

 private:
  int descriptor_;
};

absl::StatusOr<pid_t> Start(const CadWorkerOptions& options, const CadFile& file, const MemoryFile& input,
                            const MemoryFile& output, const MemoryFile& errors) {
  return sandbox::StartWorker({options.program, "--format", file.format, "--unit-mm", NumberText(file.unit_mm),
                               "--error-um", NumberText(file.chordal_error_um), "--solid", file.solid, "--memory-mb",
                               std::to_string(options.memory_mb), "--cpu-s", std::to_string(options.cpu_s)},
                              {input.descriptor(), sandbox::kNothing, errors.descriptor(), output.descriptor()});
}

absl::Status Missing(const std::string& why) {
  return runtime::Failure(errors::v1::CAD_WORKER_MISSING, "cad worker " + why);
}

// The worker writes what it refuses as violations, and anything else as it comes.
absl::Status RefusedAs(const std::string& written) {
  const std::vector<Violation> violations = ViolationsOfLines(written);
  return violations.empty() ? runtime::Refuse("cad", written, "readable CAD") : runtime::Refuse(violations);
}

enum class End { kExited, kTooLate, kCancelled };

// Waits for the process, and ends it when its time is over. It is gone afterwards.
End WaitFor(pid_t pid, std::chrono::milliseconds patience, const std::function<bool()>& keep_going, int* status) {
  const auto until = std::chrono::steady_clock::now() + patience;
  while (waitpid(pid, status, WNOHANG) == 0) {
    const bool late = std::chrono::steady_clock::now() >= until;
    if (late || !keep_going()) {
      kill(pid, SIGKILL);
      waitpid(pid, status, 0);
      return late ? End::kTooLate : End::kCancelled;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return End::kExited;
}

}  // namespace

absl::StatusOr<std::string> TessellateInWorker(const CadWorkerOptions& options, const CadFile& file,
                                               const std::string& cad, const std::function<bool()>& keep_going) {
  const MemoryFile input("cad"), output("mesh"), errors("errors");
  if (input.descriptor() < 0 || output.descriptor() < 0 || errors.descriptor() < 0 || !input.Write(cad))
    return absl::ResourceExhaustedError("cad: no memory for " + std::to_string(cad.size()) + " bytes");
  const absl::StatusOr<pid_t> pid = Start(options, file, input, output, errors);
  if (!pid.ok()) return Missing(std::string(pid.status().message()));
  int status = 0;
  const End end = WaitFor(*pid, options.patience, keep_going, &status);
  if (end == End::kCancelled) return absl::CancelledError("the client went away or its time ended; nothing is stored");
  if (sandbox::CouldNotConfine(status)) return Missing(options.program + ": " + errors.Read(kGreatestMessageBytes));
  if (end == End::kTooLate || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU))
    return runtime::Refuse("cad",
                           file.format + " of " + std::to_string(cad.size()) + " bytes, still unread after its time",
                           "CAD that is read within " + std::to_string(options.cpu_s) + " s of CPU time");
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    std::string mesh = output.Read(kGreatestMeshBytes + 1);
    if (mesh.size() <= kGreatestMeshBytes) return mesh;
    return runtime::Refuse("cad", "a surface of more than 512 MiB", "a simpler part");
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == kRefused) return RefusedAs(errors.Read(kGreatestMessageBytes));
  return runtime::Refuse(
      "cad", file.format + " of " + std::to_string(cad.size()) + " bytes, which breaks its reader",
      "a sound file of at most the complexity that " + std::to_string(options.memory_mb) + " MB of memory hold");
}

}  // namespace sixpoint::plant
