// gRPC decrypts what comes by SSL_read, which the linker finds here first. gRPC has no place where a server's bytes could be looked at
// between TLS and HTTP/2, and a proxy in front would have to tell it who the caller is.
#include <dlfcn.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>

#include "services/runtime/frame_watch.h"
#include "services/runtime/line_budget.h"
#include "services/runtime/log.h"

namespace sixpoint::runtime {
namespace {

void Forget(void*, void* watch, CRYPTO_EX_DATA*, int, long, void*) { delete static_cast<FrameWatch*>(watch); }

int WatchIndex() {
  static const int index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, &Forget);
  return index;
}

// Of a connection that gRPC serves; null where memory is short.
FrameWatch* WatchOf(SSL* connection) {
  auto* watch = static_cast<FrameWatch*>(SSL_get_ex_data(connection, WatchIndex()));
  if (watch != nullptr) return watch;
  watch = new FrameWatch;
  if (SSL_set_ex_data(connection, WatchIndex(), watch) == 1) return watch;
  delete watch;
  return nullptr;
}

bool MayGoOn(SSL* connection, const void* bytes, int count) {
  FrameWatch* const watch = WatchOf(connection);
  if (watch == nullptr) return false;
  const std::string_view wrong =
      watch->Take({static_cast<const char*>(bytes), static_cast<std::size_t>(count)}, std::chrono::steady_clock::now());
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
