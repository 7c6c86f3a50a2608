// An HTTP server of a test's own, as a receiver of webhooks has one: it keeps what was posted, and answers as it is told.
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace sixpoint::testing {

class HttpReceiver {
 public:
  struct Posted {
    std::map<std::string, std::string> headers;  // names in small letters
    std::string body;
    int answered = 0;
  };
  HttpReceiver();
  ~HttpReceiver();
  HttpReceiver(const HttpReceiver&) = delete;
  HttpReceiver& operator=(const HttpReceiver&) = delete;

  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/events"; }
  // Of each answer from now on; 302 names another address of this server's, 0: it never answers.
  void Answer(int http_status) { http_status_ = http_status; }
  std::vector<Posted> posted() const;

 private:
  void Serve();
  void Take(int connection);

  int listening_ = -1, port_ = 0;
  std::atomic<int> http_status_{204};
  std::atomic<bool> stopped_{false};
  mutable std::mutex mutex_;
  std::vector<Posted> posted_;
  std::thread thread_;
};

// Of the events that it took (an answer below 300): what each is about, message by message.
std::vector<std::string> TakenSubjects(const HttpReceiver& receiver);

}  // namespace sixpoint::testing
