// How many watch at once: each holds a thread for as long as it likes.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace sixpoint::plant {

struct WatchLimits {
  int in_all = 32;       // a third of the calls that a server answers at once (call_gate.h)
  int per_identity = 8;  // one reader with a few screens
};

// Thread-safe; outlives its places.
class WatchPlaces {
 public:
  explicit WatchPlaces(const WatchLimits& limits) : limits_(limits) {}

  // Given back at its end.
  class Place {
   public:
    Place(WatchPlaces* places, std::string identity) : places_(places), identity_(std::move(identity)) {}
    Place(Place&& other) noexcept
        : places_(std::exchange(other.places_, nullptr)), identity_(std::move(other.identity_)) {}
    Place& operator=(Place&&) = delete;
    ~Place() {
      if (places_ != nullptr) places_->GiveBack(identity_);
    }

   private:
    WatchPlaces* places_;
    std::string identity_;
  };
  // None where as many watch as may.
  std::optional<Place> Take(const std::string& identity);
  const WatchLimits& limits() const { return limits_; }

 private:
  void GiveBack(const std::string& identity);

  const WatchLimits limits_;
  std::mutex mutex_;
  int in_all_ = 0;
  std::map<std::string, int> of_identity_;  // of those who hold any
};

}  // namespace sixpoint::plant
