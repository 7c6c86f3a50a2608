// gRPC decrypts what comes by SSL_read, which the linker finds here first. gRPC has no place where a server's bytes could be looked at
// between TLS and HTTP/2, and a proxy in front would have to tell it who the caller is.
#include <dlfcn.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>

#include "services/runtime/frame_watch.h"
#include "services/runtime/line_budget.h"
#include "services/runtime/log.h"

namespace sixpoint::runtime {
namespace {

// gRPC reads a connection on one thread after the other. That they take turns is its own affair; the watch does not rest on it.
struct Watched {
  std::mutex taking;
  FrameWatch watch;
};

void Forget(void*, void* watched, CRYPTO_EX_DATA*, int, long, void*) { delete static_cast<Watched*>(watched); }

int WatchIndex() {
  static const int index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, &Forget);
  return index;
}

// Of a connection that gRPC serves; null where memory is short.
Watched* WatchedOf(SSL* connection) {
  auto* watched = static_cast<Watched*>(SSL_get_ex_data(connection, WatchIndex()));
  if (watched != nullptr) return watched;
  watched = new Watched;
  if (SSL_set_ex_data(connection, WatchIndex(), watched) == 1) return watched;
  delete watched;
  return nullptr;
}

bool MayGoOn(SSL* connection, const void* bytes, int count) {
  Watched* const watched = WatchedOf(connection);
  if (watched == nullptr) return false;
  std::string_view wrong;
  {
    const std::lock_guard<std::mutex> lock(watched->taking);
    wrong = watched->watch.Take({static_cast<const char*>(bytes), static_cast<std::size_t>(count)},
                                std::chrono::steady_clock::now());
  }
  if (wrong.empty()) return true;
  static LineBudget lines;
  if (!lines.Take()) return false;
  LogFields fields;
  if (const long left_out_count = lines.TakeLeftOut(); left_out_count > 0)
    fields.emplace_back("messages_left_out_count", left_out_count);
  Log(LogLevel::kWarning, "connection ended: " + std::string(wrong), fields);
  return false;
}

}  // namespace

void WatchFrames() { WatchIndex(); }

}  // namespace sixpoint::runtime

// As OpenSSL's. Of a connection that is to be ended it fails as of one whose bytes are corrupt.
extern "C" int SSL_read(SSL* connection, void* buffer, int size) {
  using Read = int (*)(SSL*, void*, int);
  static const auto read = reinterpret_cast<Read>(dlsym(RTLD_NEXT, "SSL_read"));
  const int count = read(connection, buffer, size);
  if (count <= 0 || SSL_is_server(connection) == 0) return count;
  if (sixpoint::runtime::MayGoOn(connection, buffer, count)) return count;
  ERR_raise(ERR_LIB_SSL, SSL_R_BAD_LENGTH);
  return -1;
}
