// sixpoint-cad-worker: one CAD file in at descriptor 0, mesh bytes out at 3, confined before it reads a byte. What its parsers
// print goes to 1, which the plant gives nowhere to lead.
// Exit code 0: the mesh is written. 2: refused, the reason is on stderr. 3: it could not confine itself. Anything else:
// the parser broke.
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "metrology/cad/tessellation.h"
#include "metrology/mesh/mesh_bytes.h"
#include "metrology/mesh/stl.h"
#include "refusal/refusal.h"
#include "sandbox/confine.h"

#if defined(__SANITIZE_ADDRESS__)
// OpenCASCADE's readers keep their tables for as long as the process lives, and stderr is the plant's to read.
extern "C" const char* __asan_default_options() { return "detect_leaks=0"; }
#endif

namespace {

using namespace sixpoint::metrology;  // NOLINT: a main of one page

constexpr int kRefused = 2;
constexpr int kMesh = 3;  // descriptor
constexpr off_t kGreatestInputBytes = off_t{64} << 20;
constexpr rlim_t kGreatestMeshBytes = rlim_t{1} << 30;

// Field, value and wanted on a line each: the server reads them as data.
int Refused(const absl::Status& status) {
  const std::vector<sixpoint::Violation> violations = sixpoint::ViolationsOf(status);
  std::cerr << (violations.empty() ? std::string(status.message()) + "\n" : sixpoint::ViolationLines(violations));
  return kRefused;
}

absl::StatusOr<TriangleMesh> Read(const std::string& format, off_t size, double unit_mm,
                                  const TessellationOptions& options) {
  if (format == "step") return TessellateCad(CadFormat::kStep, "", options);
  if (format == "iges") return TessellateCad(CadFormat::kIges, "", options);
  if (format != "stl") return sixpoint::Refuse("--format", format, "step, iges or stl");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  std::cin.read(bytes.data(), size);
  bytes.resize(static_cast<std::size_t>(std::cin.gcount()));
  return ReadStl(bytes, unit_mm);
}

bool WriteAll(const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t put = write(kMesh, bytes.data() + done, bytes.size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    done += static_cast<std::size_t>(put);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  std::map<std::string, std::string> flags{{"--format", ""}, {"--unit-mm", "1"},      {"--error-um", "0.5"},
                                           {"--solid", ""},  {"--memory-mb", "4096"}, {"--cpu-s", "120"}};
  for (int i = 1; i < argc; i += 2) {
    auto flag = flags.find(argv[i]);
    if (flag == flags.end() || i + 1 == argc) {
      return Refused(absl::InvalidArgumentError(
          "usage: sixpoint-cad-worker --format step|iges|stl [--unit-mm 1] [--error-um 0.5] [--solid NAME]"
          " [--memory-mb 4096] [--cpu-s 120] <CAD 3>MESH"));
    }
    flag->second = argv[i + 1];
  }
  // Asked here: behind the confinement a descriptor tells nothing.
  struct stat input {};
  if (fstat(STDIN_FILENO, &input) != 0 || input.st_size <= 0) return Refused(sixpoint::Refuse("cad", "", "a CAD file"));
  if (input.st_size > kGreatestInputBytes)
    return Refused(sixpoint::Refuse("cad", std::to_string(input.st_size) + " bytes", "at most 64 MiB"));

  sixpoint::sandbox::Confinement confinement;
  confinement.descriptor_count = kMesh + 1;
  confinement.memory_bytes = rlim_t(std::atol(flags["--memory-mb"].c_str())) << 20;
  confinement.file_bytes = kGreatestMeshBytes;
  confinement.cpu_s = rlim_t(std::atol(flags["--cpu-s"].c_str()));
  confinement.ends_with_starter = true;
  sixpoint::sandbox::Confine(confinement);

  TessellationOptions options;
  options.chordal_error_um = std::atof(flags["--error-um"].c_str());
  options.solid = flags["--solid"];
  const absl::StatusOr<TriangleMesh> mesh =
      Read(flags["--format"], input.st_size, std::atof(flags["--unit-mm"].c_str()), options);
  if (!mesh.ok()) return Refused(mesh.status());
  return WriteAll(MeshBytes(*mesh)) ? 0 : 1;
}
