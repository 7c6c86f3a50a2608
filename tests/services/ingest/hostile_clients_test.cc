// Clients that mean no good, or are broken in ways that no gRPC library is: the others do not notice.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "services/runtime/call.h"
#include "tests/services/ingest/scan_service_fixture.h"

namespace sixpoint::ingest {
namespace {

using Clock = std::chrono::steady_clock;

// One HTTP/2 connection with one open call, spoken by hand: gRPC's own client sends whole messages only, and reads ahead.
class HandmadeCall {
 public:
  HandmadeCall(const std::string& address, const std::string& method) {
    socket_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    std::string fields;
    for (const auto& [name, value] : {std::pair<std::string, std::string>{":method", "POST"},
                                      {":scheme", "http"},
                                      {":path", "/sixpoint.ingest.v1.ScanService/" + method},
                                      {":authority", "plant"},
                                      {"te", "trailers"},
                                      {"content-type", "application/grpc"}}) {
      fields += '\0';  // literal, not indexed, new name
      fields += static_cast<char>(name.size()) + name + static_cast<char>(value.size()) + value;
    }
    Write("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(kSettings, 0, 0, "") + Frame(kHeaders, kEndHeaders, 1, fields));
  }
  ~HandmadeCall() { close(socket_); }
  // Part of the stream's body. False once the server has closed the connection.
  bool SendData(const std::string& bytes, bool last = false) {
    window_ -= static_cast<std::int64_t>(bytes.size());
    connection_window_ -= static_cast<std::int64_t>(bytes.size());
    return Write(Frame(kData, last ? kEndStream : 0, 1, bytes));
  }
  // As much of that many bytes as the server takes until it ends the stream or grants nothing for so long; how many.
  std::int64_t SendAsFarAsItGoes(std::int64_t size, std::chrono::milliseconds patience) {
    std::int64_t sent = 0;
    Clock::time_point until = Clock::now() + patience;
    while (sent < size && !ended_ && Clock::now() < until) {
      const std::int64_t part =
          std::min({window_.load(), connection_window_.load(), std::int64_t{16'000}, size - sent});
      if (part <= 0) {
        Listen(std::chrono::milliseconds(20));
        continue;
      }
      if (!SendData(std::string(static_cast<std::size_t>(part), 'x'))) return sent;
      sent += part;
      until = Clock::now() + patience;
      Listen(std::chrono::milliseconds(0));
    }
    return sent;
  }
  // Whether the server ended the stream (its trailers or a reset) within that time.
  bool WaitForEnd(std::chrono::milliseconds patience) {
    const Clock::time_point until = Clock::now() + patience;
    while (!ended_ && Clock::now() < until) Listen(std::chrono::milliseconds(50));
    return ended_;
  }

 private:
  enum Type : char { kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kWindowUpdate = 8 };
  static constexpr char kEndStream = 1, kEndHeaders = 4;
  static constexpr std::size_t kFrameHead = 9;

  static std::string Frame(Type type, char flags, char stream, const std::string& body) {
    const auto byte = [&](int shift) { return static_cast<char>(body.size() >> shift & 0xff); };
    return std::string{byte(16), byte(8), byte(0), type, flags, 0, 0, 0, stream} + body;
  }
  std::int64_t Number(std::size_t from, std::size_t size) const {
    std::int64_t number = 0;
    for (std::size_t i = from; i < from + size; ++i) number = number << 8 | static_cast<unsigned char>(heard_[i]);
    return number;
  }
  void Listen(std::chrono::milliseconds patience) {
    pollfd waiting{socket_, POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) return;
    char bytes[65536];
    const ssize_t got = recv(socket_, bytes, sizeof bytes, 0);
    if (got <= 0) {
      ended_ = true;
      return;
    }
    heard_.append(bytes, static_cast<std::size_t>(got));
    while (heard_.size() >= kFrameHead && heard_.size() >= kFrameHead + static_cast<std::size_t>(Number(0, 3))) {
      const char type = heard_[3];
      if (type == kReset || (type == kHeaders && (heard_[4] & kEndStream) != 0)) ended_ = true;
      if (type == kWindowUpdate) (Number(5, 4) == 0 ? connection_window_ : window_) += Number(kFrameHead, 4);
      if (type == kSettings) {
        for (std::size_t at = kFrameHead; at + 6 <= kFrameHead + static_cast<std::size_t>(Number(0, 3)); at += 6) {
          constexpr int kInitialWindow = 4;
          if (Number(at, 2) != kInitialWindow) continue;
          window_ += Number(at + 2, 4) - initial_window_;
          initial_window_ = Number(at + 2, 4);
        }
      }
      heard_.erase(0, kFrameHead + static_cast<std::size_t>(Number(0, 3)));
    }
  }
  bool Write(const std::string& bytes) {
    return send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  int socket_ = -1;
  std::string heard_;
  bool ended_ = false;
  std::int64_t initial_window_ = 65'535;
  // One thread may send while another listens.
  std::atomic<std::int64_t> window_ = 65'535, connection_window_ = 65'535;
};

// The first bytes of a gRPC message that says it is that long.
std::string MessageHead(std::uint32_t length) {
  return {'\0', static_cast<char>(length >> 24), static_cast<char>(length >> 16), static_cast<char>(length >> 8),
          static_cast<char>(length)};
}

class HostileClientsTest : public ScanServiceTest {
 protected:
  // How long a sound upload takes now.
  std::chrono::milliseconds SoundUpload(const std::string& scan_id) {
    const Clock::time_point begin = Clock::now();
    const auto stored = Upload(SampleHeader(scan_id, 800), SampleBlocks(SampleProfiles(8, 100), 300));
    EXPECT_TRUE(stored.ok()) << stored.status();
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin);
  }
};

TEST_F(HostileClientsTest, OneByteASecondLosesItsSlotAndHarmsNobody) {
  std::vector<std::unique_ptr<HandmadeCall>> slow;
  for (int i = 0; i < kUploadSlots - 1; ++i)
    slow.push_back(std::make_unique<HandmadeCall>(server_.address(), "UploadScan"));
  std::atomic<bool> stop = false;
  std::thread dripping([&] {
    const std::string message = MessageHead(100'000) + std::string(100'000, 'x');
    for (std::size_t i = 0; !stop && i < message.size(); ++i) {
      for (const auto& upload : slow) upload->SendData(message.substr(i, 1));
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  });
  // The last slot still serves everybody else.
  for (int i = 0; i < 3; ++i) EXPECT_LT(SoundUpload("s" + std::to_string(i)), std::chrono::seconds(2));
  // Bytes that never become a message do not count as a sign of life.
  for (const auto& upload : slow) EXPECT_TRUE(upload->WaitForEnd(4 * kStreamPatience));
  stop = true;
  dripping.join();
}

// Streams that have said nothing hold no place among the uploads.
TEST_F(HostileClientsTest, StreamsWithoutAHeaderTakeNoSlot) {
  std::vector<std::unique_ptr<HandmadeCall>> silent;
  for (int i = 0; i < kUploadSlots - kSlotsOfAPeer; ++i)
    silent.push_back(std::make_unique<HandmadeCall>(server_.address(), "UploadScan"));
  std::vector<std::unique_ptr<Conversation>> uploads;
  for (int i = 0; i < kSlotsOfAPeer; ++i) {
    uploads.push_back(std::make_unique<Conversation>(stub_.get(), 20.0));
    EXPECT_TRUE(uploads.back()->Say(SampleHeader("s" + std::to_string(i), 800)).has_accepted()) << i;
  }
  for (const auto& stream : silent) EXPECT_TRUE(stream->WaitForEnd(4 * kStreamPatience));
}

TEST_F(HostileClientsTest, AMessageThatSaysItIsHugeIsRefusedAtOnce) {
  HandmadeCall upload(server_.address(), "UploadScan");
  ASSERT_TRUE(upload.SendData(MessageHead(0xfffffff0)));
  EXPECT_LT(upload.SendAsFarAsItGoes(200 << 20, kStreamPatience), 16 << 20);
  EXPECT_TRUE(upload.WaitForEnd(4 * kStreamPatience));
  Conversation large(stub_.get(), 20.0);
  large.Say(SampleHeader("s1", 800));
  v1::ScanBlock block;
  block.set_point_count(1);
  block.set_payload(std::string(9 << 20, 'x'));  // over the limit of a message
  large.Send(block);
  EXPECT_TRUE(absl::IsResourceExhausted(large.Finish()));
  ExpectNothingStored();
  SoundUpload("s2");
}

TEST_F(HostileClientsTest, BytesThatAreNoMessageEndTheirStreamAlone) {
  HandmadeCall upload(server_.address(), "UploadScan");
  ASSERT_TRUE(upload.SendData(MessageHead(64) + std::string(64, '\xff')));
  EXPECT_TRUE(upload.WaitForEnd(kStreamPatience / 2));
  SoundUpload("s1");
}

TEST_F(HostileClientsTest, WhoNeverReadsHoldsNoConnectionAndIsLetGo) {
  ASSERT_TRUE(client_.Upload(SampleHeader("big", 0), SampleProfiles(160, 1280), runtime::ContextFor(30.0)).ok());
  v1::DownloadScanRequest request;
  request.set_name("scans/big");
  request.set_format(v1::POINT_FORMAT_XYZ_F64);  // 4.9 MB
  const std::string bytes = request.SerializeAsString();
  std::vector<std::unique_ptr<HandmadeCall>> downloads;
  for (int i = 0; i < 12; ++i) {  // more than the pool has connections
    downloads.push_back(std::make_unique<HandmadeCall>(server_.address(), "DownloadScan"));
    ASSERT_TRUE(downloads.back()->SendData(MessageHead(static_cast<std::uint32_t>(bytes.size())) + bytes, true));
  }
  for (int i = 0; i < 3; ++i) EXPECT_LT(SoundUpload("s" + std::to_string(i)), std::chrono::seconds(3));
  for (const auto& download : downloads) EXPECT_TRUE(download->WaitForEnd(4 * kStreamPatience));
}

TEST_F(HostileClientsTest, ConnectionsThatSayNothingHarmNobody) {
  std::vector<std::unique_ptr<HandmadeCall>> idle;
  for (int i = 0; i < 100; ++i) idle.push_back(std::make_unique<HandmadeCall>(server_.address(), "UploadScan"));
  // They hold every slot for a while, and then none.
  absl::Status stored = absl::ResourceExhaustedError("");
  const Clock::time_point until = Clock::now() + 4 * kStreamPatience;
  for (int i = 0; !stored.ok() && Clock::now() < until; ++i) {
    stored = Upload(SampleHeader("s" + std::to_string(i), 800), SampleBlocks(SampleProfiles(8, 100), 300)).status();
    if (absl::IsResourceExhausted(stored)) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_TRUE(stored.ok()) << stored;
}

}  // namespace
}  // namespace sixpoint::ingest
