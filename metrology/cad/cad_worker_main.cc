// sixpoint-cad-worker: one CAD file in, mesh bytes out, within limits that it puts on itself before it reads a byte.
// Exit code 0: the mesh is written. 2: refused, the reason is on stderr. Anything else: the parser broke.
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>

#include "metrology/cad/tessellation.h"
#include "metrology/mesh/mesh_bytes.h"
#include "metrology/mesh/stl.h"
#include "refusal/refusal.h"

namespace {

using namespace sixpoint::metrology;  // NOLINT: a main of one page

constexpr int kRefused = 2;
constexpr std::uintmax_t kGreatestInputBytes = 64u << 20;

// Field, value and wanted on a line each: the server reads them as data.
int Refused(const absl::Status& status) {
  const std::vector<sixpoint::Violation> violations = sixpoint::ViolationsOf(status);
  std::cerr << (violations.empty() ? std::string(status.message()) + "\n" : sixpoint::ViolationLines(violations));
  return kRefused;
}

void Limit(int resource, rlim_t value, rlim_t grace = 0) {
  const rlimit limit{value, value + grace};
  if (setrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) {
    std::cerr << "cannot limit resource " << resource << std::endl;
    std::_Exit(1);
  }
}

// A parser that a file took over reaches no network and starts no program.
void ForbidNetworkAndPrograms() {
  scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
  // OpenCASCADE asks for the user's name when it reads IGES, and the C library the name service: it has to do without.
  bool made = filter != nullptr && seccomp_rule_add(filter, SCMP_ACT_ERRNO(EACCES), SCMP_SYS(socket), 0) == 0;
  for (const int call :
       {SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(ptrace),
        SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(mount), SCMP_SYS(bpf), SCMP_SYS(keyctl)}) {
    made = made && seccomp_rule_add(filter, SCMP_ACT_KILL_PROCESS, call, 0) == 0;
  }
  if (!made || seccomp_load(filter) != 0) {
    std::cerr << "cannot filter system calls" << std::endl;
    std::_Exit(1);
  }
  seccomp_release(filter);
}

absl::StatusOr<TriangleMesh> Read(const std::string& format, const std::string& path, double unit_mm,
                                  const TessellationOptions& options) {
  if (format == "step") return TessellateCad(CadFormat::kStep, path, options);
  if (format == "iges") return TessellateCad(CadFormat::kIges, path, options);
  if (format != "stl") return sixpoint::Refuse("--format", format, "step, iges or stl");
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return ReadStl(bytes, unit_mm);
}

}  // namespace

int main(int argc, char** argv) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  std::map<std::string, std::string> flags{{"--format", ""},   {"--in", ""},          {"--out", ""},
                                           {"--unit-mm", "1"}, {"--error-um", "0.5"}, {"--memory-mb", "4096"},
                                           {"--cpu-s", "120"}};
  for (int i = 1; i < argc; i += 2) {
    auto flag = flags.find(argv[i]);
    if (flag == flags.end() || i + 1 == argc) {
      return Refused(absl::InvalidArgumentError(
          "usage: sixpoint-cad-worker --format step|iges|stl --in FILE --out FILE [--unit-mm 1] [--error-um 0.5]"
          " [--memory-mb 4096] [--cpu-s 120]"));
    }
    flag->second = argv[i + 1];
  }
  Limit(RLIMIT_CORE, 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these reserve terabytes of address space
  Limit(RLIMIT_AS, rlim_t(std::atol(flags["--memory-mb"].c_str())) << 20);
#endif
  Limit(RLIMIT_CPU, rlim_t(std::atol(flags["--cpu-s"].c_str())), 1);  // SIGXCPU first: it says what the matter was
  Limit(RLIMIT_FSIZE, rlim_t(1) << 30);
  ForbidNetworkAndPrograms();

  struct stat status {};
  if (stat(flags["--in"].c_str(), &status) != 0 || status.st_size <= 0)
    return Refused(sixpoint::Refuse("cad", "", "a CAD file"));
  if (std::uintmax_t(status.st_size) > kGreatestInputBytes)
    return Refused(sixpoint::Refuse("cad", "too large", "at most 64 MiB"));

  TessellationOptions options;
  options.chordal_error_um = std::atof(flags["--error-um"].c_str());
  const absl::StatusOr<TriangleMesh> mesh =
      Read(flags["--format"], flags["--in"], std::atof(flags["--unit-mm"].c_str()), options);
  if (!mesh.ok()) return Refused(mesh.status());
  const std::string bytes = MeshBytes(*mesh);
  std::ofstream out(flags["--out"], std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), std::streamsize(bytes.size())).flush();
  return out ? 0 : 1;
}
