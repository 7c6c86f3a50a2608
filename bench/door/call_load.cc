#include "bench/door/call_load.h"

#include <nghttp2/nghttp2.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <stdexcept>

#include "bench/door/flood_connection.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;

// As gRPC's clients keep it.
constexpr int kMostStreams = 100;
constexpr int kExhausted = 8;
// Who finds no stream free for so long asks nobody: what waits for one in its client says nothing of the server.
constexpr std::chrono::milliseconds kWithoutAStream{10};

struct Call {
  Clock::time_point due, sent;
  std::string body;
  std::size_t sent_bytes = 0;
  std::int32_t stream = 0;
  int code = -1;
  bool has_details = false;
};

struct Tally {
  std::vector<double> ok_ms, refused_ms;
  std::map<std::string, std::int64_t> ends;
  std::int64_t without_details = 0;
};

double Milliseconds(Clock::duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

double Quantile(std::vector<double>* values, double share) {
  if (values->empty()) return 0;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values->size() - 1));
  std::nth_element(values->begin(), values->begin() + static_cast<std::ptrdiff_t>(at), values->end());
  return (*values)[at];
}

class Connection {
 public:
  Connection(const CallLoad& load, Tally* tally) : load_(load), tally_(*tally) { Open(); }
  ~Connection() { nghttp2_session_del(session_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  bool is_open() const { return socket_ != nullptr; }
  bool MayCall() const {
    const auto allowed = nghttp2_session_get_remote_settings(session_, NGHTTP2_SETTINGS_MAX_CONCURRENT_STREAMS);
    const int most = load_.most_in_flight > 0 ? load_.most_in_flight : kMostStreams;
    return is_open() && calls_.size() < std::min<std::size_t>(static_cast<std::size_t>(most), allowed);
  }

  // What there is to wait for.
  pollfd Awaited() const {
    if (!is_open()) return {-1, 0, 0};
    return {socket_->fd(), static_cast<short>(POLLIN | (unsent_.empty() ? 0 : POLLOUT)), 0};
  }

  void Begin(Clock::time_point due, std::string body) {
    auto call = std::make_unique<Call>();
    call->due = due;
    call->sent = Clock::now();
    call->body = std::move(body);
    const auto left_ms = static_cast<std::int64_t>(load_.deadline_ms - Milliseconds(call->sent - due));
    const std::string timeout = std::to_string(std::max<std::int64_t>(left_ms, 1)) + "m";
    const auto field = [](const char* name, const std::string& value) {
      return nghttp2_nv{reinterpret_cast<std::uint8_t*>(const_cast<char*>(name)),
                        reinterpret_cast<std::uint8_t*>(const_cast<char*>(value.data())), std::strlen(name),
                        value.size(), NGHTTP2_NV_FLAG_NONE};
    };
    static const std::string post = "POST", https = "https", type = "application/grpc", trailers = "trailers";
    const nghttp2_nv fields[] = {field(":method", post),        field(":scheme", https),
                                 field(":path", load_.path),    field(":authority", load_.address),
                                 field("content-type", type),   field("te", trailers),
                                 field("grpc-timeout", timeout)};
    nghttp2_data_provider body_of{};
    body_of.source.ptr = call.get();
    body_of.read_callback = &Connection::Read;
    call->stream = nghttp2_submit_request(session_, nullptr, fields, std::size(fields), &body_of, call.get());
    if (call->stream < 0) return Count("not sent", *call);
    calls_[call->stream] = std::move(call);
  }

  // Writes and reads what can be; gives up what is beyond its deadline, as clients do.
  void Turn() {
    if (!is_open()) return Open();
    const Clock::time_point late = Clock::now() - std::chrono::milliseconds(load_.deadline_ms);
    while (!calls_.empty() && calls_.begin()->second->due < late) {
      nghttp2_submit_rst_stream(session_, NGHTTP2_FLAG_NONE, calls_.begin()->first, NGHTTP2_CANCEL);
      Count("late", *calls_.begin()->second);
      calls_.erase(calls_.begin());
    }
    if (!Write() || !ReadAway()) Close();
  }

 private:
  void Open() {
    socket_ = FloodConnection::Connect(load_.address, load_.identity, load_.source);
    nghttp2_session_del(session_);
    session_ = nullptr;
    nghttp2_session_callbacks* callbacks = nullptr;
    nghttp2_session_callbacks_new(&callbacks);
    nghttp2_session_callbacks_set_on_header_callback(callbacks, &Connection::OnHeader);
    nghttp2_session_callbacks_set_on_stream_close_callback(callbacks, &Connection::OnClose);
    nghttp2_session_client_new(&session_, callbacks, this);
    nghttp2_session_callbacks_del(callbacks);
    nghttp2_submit_settings(session_, NGHTTP2_FLAG_NONE, nullptr, 0);
  }
  void Close() {
    for (const auto& [stream, call] : calls_) Count("connection lost", *call);
    calls_.clear();
    socket_.reset();
  }

  bool Write() {
    while (unsent_.size() < (1U << 16)) {
      const std::uint8_t* bytes = nullptr;
      const ssize_t count = nghttp2_session_mem_send(session_, &bytes);
      if (count < 0) return false;
      if (count == 0) break;
      unsent_.append(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(count));
    }
    return socket_->Write(&unsent_);
  }
  bool ReadAway() {
    char bytes[65'536];
    for (int i = 0; i < 4; ++i) {
      const int count = socket_->Read(bytes, sizeof bytes);
      if (count < 0) return false;
      if (count == 0) return true;
      if (nghttp2_session_mem_recv(session_, reinterpret_cast<std::uint8_t*>(bytes), static_cast<std::size_t>(count)) <
          0)
        return false;
    }
    return true;
  }

  void Count(const std::string& end, const Call&) { ++tally_.ends[end]; }
  void End(const Call& call) {
    const Clock::time_point now = Clock::now();
    if (call.code == 0) tally_.ok_ms.push_back(Milliseconds(now - call.due));
    if (call.code == kExhausted) {
      tally_.refused_ms.push_back(Milliseconds(now - call.due));
      tally_.without_details += call.has_details ? 0 : 1;
    }
    Count(call.code < 0 ? "reset" : std::to_string(call.code), call);
  }

  static ssize_t Read(nghttp2_session*, std::int32_t, std::uint8_t* to, std::size_t length, std::uint32_t* flags,
                      nghttp2_data_source* source, void*) {
    auto* const call = static_cast<Call*>(source->ptr);
    const std::size_t count = std::min(length, call->body.size() - call->sent_bytes);
    std::memcpy(to, call->body.data() + call->sent_bytes, count);
    call->sent_bytes += count;
    if (call->sent_bytes == call->body.size()) *flags |= NGHTTP2_DATA_FLAG_EOF;
    return static_cast<ssize_t>(count);
  }
  static int OnHeader(nghttp2_session* session, const nghttp2_frame* frame, const std::uint8_t* name,
                      std::size_t name_length, const std::uint8_t* value, std::size_t value_length, std::uint8_t,
                      void*) {
    auto* const call = static_cast<Call*>(nghttp2_session_get_stream_user_data(session, frame->hd.stream_id));
    const std::string_view field(reinterpret_cast<const char*>(name), name_length);
    if (call == nullptr) return 0;
    if (field == "grpc-status") call->code = std::atoi(std::string(value, value + value_length).c_str());
    // google.rpc.RetryInfo is looked for by its type's name, which base64 writes in one of three ways.
    if (field == "grpc-status-details-bin") {
      const std::string_view text(reinterpret_cast<const char*>(value), value_length);
      for (const char* retry_info : {"UmV0cnlJbmZv", "JldHJ5SW5mb", "SZXRyeUluZm"})
        call->has_details = call->has_details || text.find(retry_info) != std::string_view::npos;
    }
    return 0;
  }
  static int OnClose(nghttp2_session*, std::int32_t stream, std::uint32_t, void* self) {
    auto* const connection = static_cast<Connection*>(self);
    const auto found = connection->calls_.find(stream);
    if (found == connection->calls_.end()) return 0;  // given up before
    connection->End(*found->second);
    connection->calls_.erase(found);
    return 0;
  }

  const CallLoad& load_;
  Tally& tally_;
  std::unique_ptr<FloodConnection> socket_;
  nghttp2_session* session_ = nullptr;
  std::map<std::int32_t, std::unique_ptr<Call>> calls_;  // by stream: the oldest first
  std::string unsent_;
};

// Bodies in turns, each with an id of its own.
class Bodies {
 public:
  explicit Bodies(const CallLoad& load) : bodies_(load.bodies) {}
  std::string Next() {
    std::string body = bodies_[static_cast<std::size_t>(count_) % bodies_.size()];
    char id[37];
    std::snprintf(id, sizeof id, "%08x-0000-7000-8000-%012llx", seed_, static_cast<unsigned long long>(count_++));
    for (std::size_t at = 0; (at = body.find(kPlaceholder, at)) != std::string::npos;) body.replace(at, 36, id);
    return body;
  }

 private:
  const std::vector<std::string>& bodies_;
  std::int64_t count_ = 0;
  const unsigned seed_ = static_cast<unsigned>(Clock::now().time_since_epoch().count() >> 10);
};

}  // namespace

nlohmann::json RunCallLoad(const CallLoad& load) {
  Tally tally;
  Bodies bodies(load);
  std::vector<std::unique_ptr<Connection>> connections;
  for (int i = 0; i < load.connection_count; ++i) connections.push_back(std::make_unique<Connection>(load, &tally));
  const bool open_loop = load.most_in_flight == 0;
  const Clock::time_point begin = Clock::now();
  const auto at = [&](double seconds) {
    return begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  };
  const Clock::time_point stop = at(load.seconds);
  const Clock::time_point end = stop + std::chrono::milliseconds(load.deadline_ms);
  std::deque<Clock::time_point> due;
  std::int64_t asked = 0, never_sent = 0;
  std::size_t turn = 0;
  std::vector<pollfd> awaited;
  for (Clock::time_point now = begin; now < end; now = Clock::now()) {
    if (open_loop)
      for (; now < stop && at(static_cast<double>(asked) / load.calls_per_s) <= now; ++asked)
        due.push_back(at(static_cast<double>(asked) / load.calls_per_s));
    for (; !due.empty() && due.front() < now - kWithoutAStream; ++never_sent) due.pop_front();
    bool begun = false;
    for (std::size_t i = 0; i < connections.size(); ++i) {
      Connection& one = *connections[(turn + i) % connections.size()];
      // A share of what is due each, so that they go side by side.
      for (int k = 0; k < 8 && now < stop && one.MayCall() && !(open_loop && due.empty()); ++k) {
        // Whoever asks last has the most time left: what has waited for a stream would only be answered too late.
        one.Begin(open_loop ? due.back() : Clock::now(), bodies.Next());
        if (open_loop)
          due.pop_back();
        else
          ++asked;
        begun = true;
      }
      one.Turn();
    }
    ++turn;
    awaited.clear();
    for (const auto& one : connections) awaited.push_back(one->Awaited());
    // Who sleeps is woken in time on a machine where others compute.
    poll(awaited.data(), awaited.size(), begun ? 0 : 1);
  }
  nlohmann::json ends;
  for (const auto& [name, count] : tally.ends) ends[name] = count;
  const double ok_count = static_cast<double>(tally.ok_ms.size());
  return {{"asked", asked},
          {"asked_per_s", static_cast<double>(asked) / load.seconds},
          {"goodput_per_s", ok_count / load.seconds},
          {"ok_p50_ms", Quantile(&tally.ok_ms, 0.5)},
          {"ok_p99_ms", Quantile(&tally.ok_ms, 0.99)},
          {"refused", tally.refused_ms.size()},
          {"refusal_p50_ms", Quantile(&tally.refused_ms, 0.5)},
          {"refusal_p99_ms", Quantile(&tally.refused_ms, 0.99)},
          {"refused_without_retry_info", tally.without_details},
          {"never_sent", never_sent},
          {"ends", ends}};
}

}  // namespace sixpoint::bench
