// sixpoint-decode-worker: decodes untrusted Draco blocks that come over the socket at its standard input, in limited memory
// and CPU time, with no files, and with no system call but the few that decoding takes. What a hostile block breaks is
// this process, which ingest replaces.
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <string>

#include "metrology/cloud/draco_codec.h"
#include "services/ingest/decode_worker_protocol.h"

namespace sixpoint::ingest {
namespace {

constexpr rlim_t kMemoryBytes = rlim_t{512} << 20;
constexpr rlim_t kCpuSecondsPerBlock = 5;

void Limit(int resource, rlim_t value) {
  const rlimit limit{value, value};
  if (setrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) _exit(3);
}

// The soft limit only, so that it can be moved on for every block.
void AllowCpuForOneBlock() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto used_s = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  const rlimit limit{used_s + 1 + kCpuSecondsPerBlock, RLIM_INFINITY};
  if (setrlimit(RLIMIT_CPU, &limit) != 0) _exit(3);
}

// Any other call ends the process: bytes that take over the decoder find no file, no socket, no program to start.
[[maybe_unused]] void AllowOnlyDecoding() {
  scmp_filter_ctx filter = seccomp_init(SCMP_ACT_KILL_PROCESS);
  if (filter == nullptr) _exit(3);
  bool made = true;
  for (const int call : {SCMP_SYS(read), SCMP_SYS(write), SCMP_SYS(exit), SCMP_SYS(exit_group), SCMP_SYS(brk),
                         SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(futex), SCMP_SYS(rt_sigreturn),
                         SCMP_SYS(rt_sigprocmask), SCMP_SYS(getrusage), SCMP_SYS(setrlimit), SCMP_SYS(prlimit64),
                         SCMP_SYS(getpid), SCMP_SYS(gettid), SCMP_SYS(tgkill), SCMP_SYS(clock_gettime)}) {
    made = made && seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0) == 0;
  }
  // Memory, but none that can be executed.
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)}) {
    made = made && seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 1, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)) == 0;
  }
  if (!made || seccomp_load(filter) != 0) _exit(3);
  seccomp_release(filter);
}

void Confine() {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) != 0) _exit(3);
  if (close_range(3, ~0U, 0) != 0) _exit(3);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these reserve terabytes of address space
  Limit(RLIMIT_AS, kMemoryBytes);
#endif
  Limit(RLIMIT_CORE, 0);
  Limit(RLIMIT_FSIZE, 0);
  Limit(RLIMIT_NOFILE, 3);  // 0, 1 and 2 are open; nothing else ever is
  Limit(RLIMIT_NPROC, 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  AllowOnlyDecoding();
#endif
}

// False at the end of the stream.
bool ReadAll(void* bytes, std::size_t size) {
  auto* at = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = read(STDIN_FILENO, at, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

bool WriteAll(const void* bytes, std::size_t size) {
  const auto* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t put = write(STDOUT_FILENO, at, size);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    at += put;
    size -= static_cast<std::size_t>(put);
  }
  return true;
}

DecodeReply Answer(const DecodeRequest& request, const std::string& payload) {
  DecodeReply reply;
  const auto points_mm = metrology::DecodeBlock(payload, request.point_count);
  if (points_mm.ok()) {
    reply.decoded = 1;
    reply.statistics = StatisticsOf(*points_mm, request.profile_pitch_mm, request.begin);
    return reply;
  }
  const std::string message(points_mm.status().message());
  std::copy_n(message.begin(), std::min(message.size(), reply.message.size() - 1), reply.message.begin());
  return reply;
}

int Work() {
  Confine();
  std::string payload;
  for (DecodeRequest request; ReadAll(&request, sizeof request);) {
    if (request.magic != kDecodeMagic || request.payload_bytes > kGreatestPayloadBytes) return 2;
    payload.resize(request.payload_bytes);
    if (!ReadAll(payload.data(), payload.size())) return 2;
    AllowCpuForOneBlock();
    const DecodeReply reply = Answer(request, payload);
    if (!WriteAll(&reply, sizeof reply)) return 2;
  }
  return 0;
}

}  // namespace
}  // namespace sixpoint::ingest

int main() { return sixpoint::ingest::Work(); }
