#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/doctor/checks.h"

namespace sixpoint::cli::doctor {
namespace {

constexpr double kGb = 1e9;
// A blade with all its scans is some tens of megabytes (docs/sizing.md): below the first a day's work may fail, below the second the next one.
constexpr double kLowDisk_bytes = 20 * kGb, kLowDiskPart = 0.1, kNoDisk_bytes = 2 * kGb, kNoDiskPart = 0.01;
constexpr double kFewInodes = 0.05, kNoInodes = 0.005;
constexpr double kLowMemory_bytes = 1 * kGb, kNoMemory_bytes = 0.25 * kGb;
// The kernel's estimate of its own error; certificates and orders of events bear seconds, not minutes.
constexpr double kClockError_s = 1;

void JudgeDisk(const Disk& disk, Findings* findings) {
  const std::string name = "disk: " + disk.what;
  if (!disk.why_not.empty()) {
    findings->push_back({name, Grade::kUnknown, disk.path + ": " + disk.why_not, ""});
    return;
  }
  const std::string room = BytesText(disk.free_bytes) + " free of " + BytesText(disk.total_bytes) + " at " + disk.path;
  const std::string next =
      "make room there, or set how long clouds are kept: sixpoint store retention set KIND --keep-days N";
  const double part = disk.total_bytes > 0 ? disk.free_bytes / disk.total_bytes : 0;
  Grade grade = Grade::kOk;
  // Of a great disk a small part is enough, of a small one little is.
  if (disk.free_bytes < kLowDisk_bytes && part < kLowDiskPart) grade = Grade::kWarning;
  if (disk.free_bytes < kNoDisk_bytes && part < kLowDiskPart) grade = Grade::kWrong;
  if (part < kNoDiskPart) grade = Grade::kWrong;
  std::string words = room;
  if (disk.free_inode_part && *disk.free_inode_part < kFewInodes) {
    words += ", and hardly a file more may be made (inodes)";
    grade = std::max(grade, *disk.free_inode_part < kNoInodes ? Grade::kWrong : Grade::kWarning);
  }
  if (disk.read_only) {
    findings->push_back({name, Grade::kWrong, disk.path + " is mounted to be read only: nothing can be recorded",
                         "look at the kernel's messages for a failed disk: dmesg | tail; then mount it anew"});
    return;
  }
  findings->push_back({name, grade, words, grade == Grade::kOk ? "" : next});
}

void JudgeMemory(const Host& host, Findings* findings) {
  if (!host.available_memory_bytes || !host.memory_bytes) {
    findings->push_back({"memory", Grade::kUnknown, "the kernel does not tell how much is free", ""});
    return;
  }
  const double available = *host.available_memory_bytes;
  const Grade grade = available < kNoMemory_bytes    ? Grade::kWrong
                      : available < kLowMemory_bytes ? Grade::kWarning
                                                     : Grade::kOk;
  findings->push_back({"memory", grade,
                       BytesText(available) + " available of " + BytesText(*host.memory_bytes) +
                           (grade == Grade::kOk ? "" : ": the kernel may end a process to go on"),
                       grade == Grade::kOk ? "" : "see who holds it: ps -eo rss,comm --sort=-rss | head"});
}

void JudgeClock(const Host& host, Findings* findings) {
  if (!host.clock_synchronised) {
    findings->push_back({"clock", Grade::kUnknown, "the kernel does not tell whether its clock is kept by others", ""});
    return;
  }
  const std::string next = "start a time service: timedatectl set-ntp true, or chrony; then: timedatectl status";
  if (!*host.clock_synchronised) {
    findings->push_back({"clock", Grade::kWarning,
                         "this computer's clock is kept by no time service, and drifts from the others'", next});
    return;
  }
  char error[60];
  std::snprintf(error, sizeof error, "within %.3g s", host.clock_error_s.value_or(0));
  const bool is_close = host.clock_error_s.value_or(0) <= kClockError_s;
  findings->push_back({"clock", is_close ? Grade::kOk : Grade::kWarning,
                       "kept by a time service" + (host.clock_error_s ? ", " + std::string(error) : ""),
                       is_close ? "" : next});
}

void JudgeKernel(const Host& host, Findings* findings) {
  const std::string name = "kernel";
  if (host.seccomp && !*host.seccomp) {
    findings->push_back({name, Grade::kWrong,
                         "this kernel has no seccomp filters: workers that parse clouds and CAD do not start",
                         "run on a kernel with CONFIG_SECCOMP_FILTER, as Debian's has; in a container allow seccomp"});
    return;
  }
  if (!host.seccomp) {
    findings->push_back({name, Grade::kUnknown, "the kernel does not tell whether it has seccomp filters", ""});
    return;
  }
  if (host.landlock_version.value_or(1) == 0) {
    findings->push_back({name, Grade::kWarning, "no Landlock: workers are held by their filter of system calls alone",
                         "add landlock to the kernel's lsm= parameter, where its version has it (5.13 or newer)"});
    return;
  }
  findings->push_back({name, Grade::kOk, "has what confines workers: seccomp and Landlock", ""});
}

}  // namespace

std::string GradeText(Grade grade) {
  switch (grade) {
    case Grade::kOk:
      return "OK";
    case Grade::kWarning:
      return "WARNING";
    case Grade::kWrong:
      return "WRONG";
    case Grade::kUnknown:
      break;
  }
  return "UNKNOWN";
}

std::string BytesText(double bytes) {
  constexpr const char* kUnits[] = {"bytes", "kB", "MB", "GB", "TB", "PB"};
  int unit = 0;
  while (bytes >= 1000 && unit < 5) {
    bytes /= 1000;
    ++unit;
  }
  char text[40];
  std::snprintf(text, sizeof text, bytes < 10 && unit > 0 ? "%.1f %s" : "%.0f %s", bytes, kUnits[unit]);
  return text;
}

void JudgeHost(const Facts& facts, Findings* findings) {
  if (facts.is_local) {
    for (const Disk& disk : facts.host.disks) JudgeDisk(disk, findings);
    if (facts.blobs_in_object_store)
      findings->push_back({"disk: clouds", Grade::kUnknown,
                           "new clouds go to an object store; how much room it has its owner can say", ""});
    JudgeMemory(facts.host, findings);
    JudgeKernel(facts.host, findings);
  }
  JudgeClock(facts.host, findings);
}

Findings Judge(const Facts& facts) {
  Findings findings;
  if (!facts.settings_why_not.empty())
    findings.push_back({"settings", Grade::kWrong, facts.settings_why_not,
                        "correct what is named; `sixpoint up` writes the file anew"});
  for (const auto judge :
       {JudgeHost, JudgeProcesses, JudgeServices, JudgeVersions, JudgeCertificates, JudgeDatabase, JudgeRecord})
    judge(facts, &findings);
  return findings;
}

}  // namespace sixpoint::cli::doctor
