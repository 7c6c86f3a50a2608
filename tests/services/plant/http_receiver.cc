#include "tests/services/plant/http_receiver.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace sixpoint::testing {

HttpReceiver::HttpReceiver() {
  listening_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const at = reinterpret_cast<sockaddr*>(&address);
  if (bind(listening_, at, size) != 0 || listen(listening_, 16) != 0 || getsockname(listening_, at, &size) != 0)
    std::abort();
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Serve(); });
}

HttpReceiver::~HttpReceiver() {
  stopped_ = true;
  thread_.join();
  close(listening_);
}

std::vector<HttpReceiver::Posted> HttpReceiver::posted() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return posted_;
}

void HttpReceiver::Serve() {
  while (!stopped_) {
    pollfd waited{listening_, POLLIN, 0};
    if (poll(&waited, 1, 20) <= 0) continue;
    const int connection = accept(listening_, nullptr, nullptr);
    if (connection >= 0) Take(connection);
    close(connection);
  }
}

void HttpReceiver::Take(int connection) {
  std::string bytes;
  std::size_t body_at = std::string::npos, body_size = 0;
  Posted posted;
  char buffer[65536];
  while (body_at == std::string::npos || bytes.size() < body_at + body_size) {
    const ssize_t got = read(connection, buffer, sizeof buffer);
    if (got <= 0) return;
    bytes.append(buffer, static_cast<std::size_t>(got));
    const std::size_t end = bytes.find("\r\n\r\n");
    if (body_at != std::string::npos || end == std::string::npos) continue;
    body_at = end + 4;
    for (std::size_t line = bytes.find("\r\n") + 2; line < end + 2; line = bytes.find("\r\n", line) + 2) {
      const std::size_t colon = bytes.find(": ", line), line_end = bytes.find("\r\n", line);
      std::string name = bytes.substr(line, colon - line);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      posted.headers[name] = bytes.substr(colon + 2, line_end - colon - 2);
    }
    body_size = std::strtoul(posted.headers["content-length"].c_str(), nullptr, 10);
    if (posted.headers.count("expect") > 0 && write(connection, "HTTP/1.1 100 Continue\r\n\r\n", 25) != 25) return;
  }
  posted.body = bytes.substr(body_at);
  posted.answered = http_status_;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    posted_.push_back(posted);
  }
  while (http_status_ == 0 && !stopped_) usleep(10'000);
  const std::string answer = "HTTP/1.1 " + std::to_string(posted.answered) + " Told\r\nlocation: " + url() +
                             "2\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";
  if (write(connection, answer.data(), answer.size()) < 0) return;
}

std::vector<std::string> TakenSubjects(const HttpReceiver& receiver) {
  std::vector<std::string> subjects;
  for (const HttpReceiver::Posted& posted : receiver.posted())
    if (posted.answered < 300)
      for (const auto& event : nlohmann::json::parse(posted.body)) subjects.push_back(event["subject"]);
  return subjects;
}

}  // namespace sixpoint::testing
