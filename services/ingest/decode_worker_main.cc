// sixpoint-decode-worker: decodes untrusted Draco blocks that come over the socket at its standard input, confined before it
// reads one. What a hostile block breaks is this process, which ingest replaces.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <string>
#include <utility>

#include "metrology/cloud/draco_codec.h"
#include "sandbox/confine.h"
#include "services/ingest/decode_worker_protocol.h"

namespace sixpoint::ingest {
namespace {

constexpr rlim_t kMemoryBytes = rlim_t{512} << 20;
constexpr rlim_t kCpuSecondsPerBlock = 5;

// The soft limit only, so that it can be moved on for every block.
void AllowCpuForOneBlock() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto used_s = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  const rlimit limit{used_s + 1 + kCpuSecondsPerBlock, RLIM_INFINITY};
  if (setrlimit(RLIMIT_CPU, &limit) != 0) _exit(sandbox::kNotConfined);
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

// `reencoded`: what follows the reply.
DecodeReply Answer(const DecodeRequest& request, const std::string& payload, std::string* reencoded) {
  DecodeReply reply;
  reencoded->clear();
  auto block = metrology::ReencodeBlock(payload, request.point_count);
  if (block.ok()) {
    reply.decoded = 1;
    reply.statistics = StatisticsOf(block->points_mm, request.profile_pitch_mm, request.begin);
    if (block->bytes != payload) *reencoded = std::move(block->bytes);
    reply.reencoded_bytes = static_cast<std::uint32_t>(reencoded->size());
    return reply;
  }
  const std::string message(block.status().message());
  std::copy_n(message.begin(), std::min(message.size(), reply.message.size() - 1), reply.message.begin());
  return reply;
}

int Work() {
  sandbox::Confinement confinement;
  confinement.memory_bytes = kMemoryBytes;
  sandbox::Confine(confinement);
  std::string payload, reencoded;
  for (DecodeRequest request; ReadAll(&request, sizeof request);) {
    if (request.magic != kDecodeMagic || request.payload_bytes > kGreatestPayloadBytes) return 2;
    payload.resize(request.payload_bytes);
    if (!ReadAll(payload.data(), payload.size())) return 2;
    AllowCpuForOneBlock();
    const DecodeReply reply = Answer(request, payload, &reencoded);
    if (!WriteAll(&reply, sizeof reply) || !WriteAll(reencoded.data(), reencoded.size())) return 2;
  }
  return 0;
}

}  // namespace
}  // namespace sixpoint::ingest

int main() { return sixpoint::ingest::Work(); }
