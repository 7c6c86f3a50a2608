#include <sys/prctl.h>
#include <sys/statvfs.h>
#include <sys/timex.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "cli/doctor/gather.h"
#include "sandbox/landlock.h"

namespace sixpoint::cli::doctor {
namespace {

namespace fs = std::filesystem;

std::string FirstLine(const char* file) {
  std::string line;
  std::ifstream stream(file);
  std::getline(stream, line);
  return line.substr(0, 200);
}

Disk DiskOf(const std::string& what, const fs::path& path) {
  Disk disk;
  disk.what = what;
  disk.path = path.string();
  struct statvfs found {};
  if (statvfs(path.c_str(), &found) != 0) {
    disk.why_not = std::strerror(errno);
    return disk;
  }
  disk.free_bytes = static_cast<double>(found.f_bavail) * static_cast<double>(found.f_frsize);
  disk.total_bytes = static_cast<double>(found.f_blocks) * static_cast<double>(found.f_frsize);
  if (found.f_files > 0)
    disk.free_inode_part = static_cast<double>(found.f_favail) / static_cast<double>(found.f_files);
  disk.read_only = (found.f_flag & ST_RDONLY) != 0;
  return disk;
}

void GatherMemory(Host* host) {
  std::ifstream meminfo("/proc/meminfo");
  std::string name, unit;
  for (double kb = 0; meminfo >> name >> kb; std::getline(meminfo, unit)) {
    if (name == "MemTotal:") host->memory_bytes = 1024 * kb;
    if (name == "MemAvailable:") host->available_memory_bytes = 1024 * kb;
  }
}

void GatherClock(Host* host) {
  timex asked{};  // modes 0: nothing is set
  const int state = adjtimex(&asked);
  if (state < 0) return;
  host->clock_synchronised = state != TIME_ERROR && (asked.status & STA_UNSYNC) == 0;
  if (*host->clock_synchronised) host->clock_error_s = 1e-6 * static_cast<double>(asked.maxerror);
}

}  // namespace

Host GatherHost(const std::optional<LocalPlant>& plant) {
  Host host;
  if (plant) {
    host.disks.push_back(DiskOf("data folder", plant->data));
    host.disks.push_back(DiskOf("PostgreSQL", plant->database()));
    host.disks.push_back(DiskOf("logs", plant->logs()));
    // Where PostgreSQL's write-ahead log was moved to a disk of its own.
    std::error_code none;
    const fs::path wal = plant->database() / "pg_wal";
    if (fs::is_symlink(wal, none)) host.disks.push_back(DiskOf("write-ahead log", wal));
  }
  GatherMemory(&host);
  GatherClock(&host);
  const std::string actions = FirstLine("/proc/sys/kernel/seccomp/actions_avail");
  if (!actions.empty()) {
    host.seccomp = actions.find("kill_process") != std::string::npos;
  } else if (prctl(PR_GET_SECCOMP) < 0 && errno == EINVAL) {
    host.seccomp = false;
  }
  host.landlock_version = sandbox::LandlockVersion();
  if (const std::string pattern = FirstLine("/proc/sys/kernel/core_pattern"); !pattern.empty())
    host.core_pattern = pattern;
  return host;
}

}  // namespace sixpoint::cli::doctor
