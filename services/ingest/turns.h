// Lets so many at once; the others wait for their turn.
#pragma once

#include <condition_variable>
#include <mutex>

namespace sixpoint::ingest {

// Encoding takes a core. More encodings at once than cores would only make every stream wait longer, and cost the caches.
class Turns {
 public:
  explicit Turns(int at_once) : free_(at_once < 1 ? 1 : at_once) {}

  class Turn {
   public:
    explicit Turn(Turns* turns) : turns_(turns) {
      std::unique_lock lock(turns_->mutex_);
      turns_->freed_.wait(lock, [this] { return turns_->free_ > 0; });
      --turns_->free_;
    }
    ~Turn() {
      {
        std::lock_guard lock(turns_->mutex_);
        ++turns_->free_;
      }
      turns_->freed_.notify_one();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Turns* const turns_;
  };

 private:
  std::mutex mutex_;
  std::condition_variable freed_;
  int free_;
};

}  // namespace sixpoint::ingest
