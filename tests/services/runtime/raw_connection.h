// A connection by which a stranger, who has no certificate, sends a server whatever bytes it likes: HTTP/2 by hand.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace sixpoint::runtime::testing {

enum class Speaks { kTls, kNothing };  // kNothing: connects, and leaves it at that

class RawConnection {
 public:
  // "unix:PATH" or "127.0.0.1:PORT"; the source address makes the peer, empty: the usual one.
  explicit RawConnection(const std::string& address, const std::string& source = "", Speaks speaks = Speaks::kTls);
  RawConnection(RawConnection&& other) noexcept;
  ~RawConnection();

  // By TCP; whether TLS was spoken too, Send tells.
  bool connected() const { return fd_ >= 0; }
  // Reads away what comes meanwhile. False: the server has closed it, or takes nothing for 10 s.
  bool Send(std::string_view bytes);
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
enum class Frame { kData = 0, kHeaders = 1, kResetStream = 3, kSettings = 4, kPing = 6 };
std::string FrameOf(Frame type, int flags, unsigned stream, std::string_view payload);
// The header block of a gRPC call, without the compression table.
std::string CallHeaders(std::string_view path);

}  // namespace sixpoint::runtime::testing
