// A connection by which a stranger, or somebody whom the plant knows, sends a server whatever bytes it likes: HTTP/2 by hand.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace sixpoint::runtime::testing {

enum class Speaks { kTls, kNothing };  // kNothing: connects, and leaves it at that
enum class Answers { kReadAway, kLeft };

class RawConnection {
 public:
  // "unix:PATH" or "127.0.0.1:PORT"; the source address makes the peer, empty: the usual one.
  // identity: a folder with identity.pem, which is shown; empty: a stranger.
  explicit RawConnection(const std::string& address, const std::string& source = "", Speaks speaks = Speaks::kTls,
                         const std::string& identity = "");
  RawConnection(RawConnection&& other) noexcept;
  ~RawConnection();

  // By TCP; whether TLS was spoken too, Send tells.
  bool connected() const { return fd_ >= 0; }
  // False: the server has closed it, or takes nothing for 10 s.
  bool Send(std::string_view bytes, Answers answers = Answers::kReadAway);
  // Outside of TLS, on a connection that speaks none.
  bool SendBare(std::string_view bytes);
  // Asks for new keys within TLS 1.2, which costs the server what a handshake costs. False: refused.
  bool Renegotiate();
  // True once the server has closed it; looked for until then.
  bool IsClosedWithin(double seconds);

 private:
  struct Tls;
  bool ReadAway();
  int fd_ = -1;
  std::unique_ptr<Tls> tls_;  // none: kNothing, or no handshake came about
};

// What an HTTP/2 client begins with.
std::string Preface();
enum class Frame {
  kData = 0,
  kHeaders = 1,
  kPriority = 2,
  kResetStream = 3,
  kSettings = 4,
  kPushPromise = 5,
  kPing = 6,
  kWindowUpdate = 8,
  kContinuation = 9,
  kUnknown = 0xfa
};
std::string FrameOf(Frame type, int flags, unsigned stream, std::string_view payload);
// The header block of a gRPC call, without the compression table.
std::string CallHeaders(std::string_view path);

}  // namespace sixpoint::runtime::testing
