#include "services/ingest/decode_workers.h"

#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "metrology/cloud/draco_codec.h"
#include "sandbox/worker_process.h"
#include "services/ingest/decode_worker_protocol.h"

namespace sixpoint::ingest {
namespace {

using Clock = std::chrono::steady_clock;

// How a conversation with a worker went.
enum class Talk { kDone, kBroken, kTooLate };

// Waits until the socket is ready, then moves what can be moved.
template <typename Move>
Talk MoveAll(int socket, short event, std::size_t size, Clock::time_point until, Move move) {
  std::size_t done = 0;
  while (done < size) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    if (left <= 0) return Talk::kTooLate;
    pollfd waiting{socket, event, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::min<std::int64_t>(left, 60'000)));
    if (ready < 0 && errno != EINTR) return Talk::kBroken;
    if (ready <= 0) continue;
    const ssize_t moved = move(done);
    if (moved < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (moved <= 0) return Talk::kBroken;
    done += static_cast<std::size_t>(moved);
  }
  return Talk::kDone;
}

Talk SendAll(int socket, const void* bytes, std::size_t size, Clock::time_point until) {
  return MoveAll(socket, POLLOUT, size, until, [&](std::size_t done) {
    return send(socket, static_cast<const char*>(bytes) + done, size - done, MSG_NOSIGNAL | MSG_DONTWAIT);
  });
}

Talk ReceiveAll(int socket, void* bytes, std::size_t size, Clock::time_point until) {
  return MoveAll(socket, POLLIN, size, until, [&](std::size_t done) {
    return recv(socket, static_cast<char*>(bytes) + done, size - done, MSG_DONTWAIT);
  });
}

// Three floats a point, and what Draco puts before them.
std::int64_t GreatestReencodedBytes(std::int64_t point_count) { return 12 * point_count + 4096; }

// What every block from outside is held to before it is decoded anywhere.
bool IsBounded(const std::string& reencoded, std::int64_t point_count) {
  const auto header = metrology::InspectHeader(reencoded, point_count);
  return header.ok() && header->point_count == point_count;
}

// A worker that a block took over may say anything.
bool IsSane(const DecodeReply& reply, const DecodeRequest& request) {
  const std::int64_t point_count = request.point_count;
  if (reply.magic != kDecodeMagic || reply.decoded > 1 || reply.message.back() != '\0') return false;
  const BlockStatistics& s = reply.statistics;
  if (reply.reencoded_bytes > GreatestReencodedBytes(point_count)) return false;
  return std::isfinite(s.greatest_backstep_mm) && std::isfinite(s.end.profile_x_mm) && s.goes_on <= 1 &&
         s.begun_profile_count >= 0 && s.begun_profile_count <= point_count && s.end.column_count >= 0 &&
         (reply.decoded == 0 || !(request.profile_pitch_mm > 0) || s.begun_profile_count + s.goes_on > 0);
}

}  // namespace

DecodeWorkers::DecodeWorkers(std::string program, int worker_count, std::chrono::milliseconds patience)
    : program_(std::move(program)),
      patience_(patience),
      at_once_({worker_count, 0}, "decode workers", errors::v1::UPLOADS_FULL) {}

DecodeWorkers::~DecodeWorkers() {
  for (const Worker& worker : idle_) End(worker);
}

absl::StatusOr<DecodeWorkers::Worker> DecodeWorkers::Start() {
  int sockets[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) {
    return absl::UnavailableError(std::string("decode worker: ") + std::strerror(errno));
  }
  const absl::StatusOr<pid_t> pid = sandbox::StartWorker({program_}, {sockets[1], sockets[1], sandbox::kNothing});
  close(sockets[1]);
  if (!pid.ok()) {
    close(sockets[0]);
    return absl::UnavailableError("decode worker " + std::string(pid.status().message()));
  }
  ++started_count_;
  started_.Add();
  return Worker{*pid, sockets[0]};
}

int DecodeWorkers::End(const Worker& worker) {
  close(worker.socket);
  kill(worker.pid, SIGKILL);
  int status = 0;
  while (waitpid(worker.pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

absl::StatusOr<DecodeWorkers::Worker> DecodeWorkers::Take() {
  {
    std::lock_guard lock(mutex_);
    while (!idle_.empty()) {
      const Worker worker = idle_.back();
      idle_.pop_back();
      // One that died while idle (the machine ran out of memory, an operator's kill) says so by its closed socket.
      pollfd peek{worker.socket, POLLIN, 0};
      if (poll(&peek, 1, 0) == 0) return worker;
      End(worker);
    }
  }
  return Start();
}

bool DecodeWorkers::GiveBack(Worker worker, bool trusted) {
  if (!trusted) return !sandbox::CouldNotConfine(End(worker));
  std::lock_guard lock(mutex_);
  idle_.push_back(worker);
  return true;
}

absl::StatusOr<CheckedBlock> DecodeWorkers::Check(std::string_view payload, std::int64_t point_count,
                                                  double profile_pitch_mm, const ProfileCursor& begin,
                                                  const Caller& caller) {
  if (payload.size() > kGreatestPayloadBytes) return absl::InvalidArgumentError("more bytes than a block may have");
  absl::StatusOr<CheckedBlock> checked = CheckOnce(payload, point_count, profile_pitch_mm, begin, caller);
  // A worker that died may have been killed from outside; a block that kills two has done it itself.
  if (absl::IsAborted(checked.status())) checked = CheckOnce(payload, point_count, profile_pitch_mm, begin, caller);
  if (!absl::IsAborted(checked.status())) return checked;
  return absl::InvalidArgumentError(std::string(checked.status().message()));
}

absl::StatusOr<CheckedBlock> DecodeWorkers::CheckOnce(std::string_view payload, std::int64_t point_count,
                                                      double profile_pitch_mm, const ProfileCursor& begin,
                                                      const Caller& caller) {
  const auto slot = at_once_.Enter(caller.deadline, caller.keep_going, runtime::ComputePool::Patience::kPatient);
  if (!slot.ok()) return slot.status();
  const absl::StatusOr<Worker> worker = Take();
  if (!worker.ok()) return worker.status();
  const Clock::time_point until = std::min(caller.deadline, Clock::now() + patience_);
  DecodeRequest request;
  request.payload_bytes = static_cast<std::uint32_t>(payload.size());
  request.point_count = point_count;
  request.profile_pitch_mm = profile_pitch_mm;
  request.begin = begin;
  DecodeReply reply;
  Talk talk = SendAll(worker->socket, &request, sizeof request, until);
  if (talk == Talk::kDone) talk = SendAll(worker->socket, payload.data(), payload.size(), until);
  if (talk == Talk::kDone) talk = ReceiveAll(worker->socket, &reply, sizeof reply, until);
  bool sane = talk == Talk::kDone && IsSane(reply, request);
  std::string reencoded(sane ? reply.reencoded_bytes : 0, '\0');
  if (sane) talk = ReceiveAll(worker->socket, reencoded.data(), reencoded.size(), until);
  sane = sane && talk == Talk::kDone && (reencoded.empty() || IsBounded(reencoded, point_count));
  if (!GiveBack(*worker, sane && reply.decoded == 1)) {
    return absl::UnavailableError("decode worker " + program_ + ": cannot confine itself; started by hand it says why");
  }
  if (talk == Talk::kTooLate && until == caller.deadline) {
    return absl::DeadlineExceededError("the call's time ended while a block was decoded");
  }
  if (talk == Talk::kTooLate) return absl::InvalidArgumentError("took too long to decode");
  if (!sane) return absl::AbortedError("the decoder ran into its limits of memory or CPU time, or failed on it");
  if (reply.decoded == 0) return absl::InvalidArgumentError(reply.message.data());
  return CheckedBlock{reply.statistics, std::move(reencoded)};
}

}  // namespace sixpoint::ingest
