// Files as a stream of messages: each with the file's name and a piece of its content.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace sixpoint::inspection {

constexpr std::size_t kMostOfPiece = std::size_t{1} << 20;

// In pieces of a megabyte at most; an empty one tells of an empty file.
template <typename Response>
absl::Status WriteInPieces(const std::string& file, std::string content, grpc::ServerWriter<Response>* writer) {
  const std::size_t size = content.size();
  for (std::size_t at = 0; at == 0 || at < size; at += kMostOfPiece) {
    Response response;
    response.set_file(file);
    response.set_content(size <= kMostOfPiece ? std::move(content) : content.substr(at, kMostOfPiece));
    if (!writer->Write(response)) return absl::CancelledError(file + ": the client went away");
  }
  return absl::OkStatus();
}

// Many files: the next is made while those before it are on their way, which for a small one is as long. What follows in the same
// file leaves together.
template <typename Response>
class FilesOnTheirWay {
 public:
  explicit FilesOnTheirWay(grpc::ServerWriter<Response>* writer) : thread_([this, writer] { Send(writer); }) {}
  ~FilesOnTheirWay() { Finish().IgnoreError(); }

  // Waits while too much is on its way. What went wrong before is told by the next.
  absl::Status Write(const std::string& file, std::string content) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return bytes_ < kMostBytes || !status_.ok(); });
    if (!status_.ok()) return status_;
    bytes_ += content.size();
    if (!queue_.empty() && queue_.back().file == file)
      queue_.back().content += content;
    else
      queue_.push_back({file, std::move(content)});
    changed_.notify_all();
    return absl::OkStatus();
  }
  // Once all is sent. No file may follow.
  absl::Status Finish() {
    {
      const std::lock_guard lock(mutex_);
      finished_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    return status_;
  }

 private:
  struct File {
    std::string file, content;
  };
  static constexpr std::size_t kMostBytes = std::size_t{4} << 20;

  void Send(grpc::ServerWriter<Response>* writer) {
    std::unique_lock lock(mutex_);
    while (status_.ok()) {
      changed_.wait(lock, [this] { return !queue_.empty() || finished_; });
      if (queue_.empty()) return;
      File next = std::move(queue_.front());
      queue_.pop_front();
      bytes_ -= next.content.size();
      lock.unlock();
      changed_.notify_all();
      const absl::Status sent = WriteInPieces(next.file, std::move(next.content), writer);
      lock.lock();
      status_ = sent;
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<File> queue_;
  std::size_t bytes_ = 0;  // in the queue
  bool finished_ = false;
  absl::Status status_;
  std::thread thread_;  // the last: it uses all of them
};

}  // namespace sixpoint::inspection
