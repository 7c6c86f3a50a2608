// sixpoint.plant.v1.EventService.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "services/plant/event_tail.h"
#include "services/plant/watch_places.h"
#include "services/runtime/call_watch.h"
#include "services/runtime/metrics.h"
#include "sixpoint/plant/v1/event.grpc.pb.h"
#include "storage/events.h"

namespace sixpoint::plant {

struct EventServiceOptions {
  WatchLimits watches;
  EventTailOptions tail;
  std::chrono::milliseconds heartbeat{5000};
  // Whoever has not read what was sent for so long is cut off.
  std::chrono::milliseconds write_patience{10'000};
};

class EventService final : public v1::EventService::Service {
 public:
  // tail: for the journal's end alone; pages: for who is behind, and for questions. So neither waits for the other, nor for calls.
  EventService(std::shared_ptr<const storage::EventReader> tail, std::shared_ptr<const storage::EventReader> pages,
               const EventServiceOptions& options = {});

  grpc::Status WatchEvents(grpc::ServerContext* context, const v1::WatchEventsRequest* request,
                           grpc::ServerWriter<v1::WatchEventsResponse>* writer) override;
  grpc::Status ListEvents(grpc::ServerContext* context, const v1::ListEventsRequest* request,
                          v1::ListEventsResponse* response) override;
  // Ends every watch, for ever.
  void Stop() { tail_->Stop(); }
  // For others who listen.
  std::shared_ptr<EventTail> tail() const { return tail_; }

 private:
  // What a watch is about, and how far it has come. No more of the journal is held than one answer.
  struct Watch {
    grpc::ServerContext* context;
    grpc::ServerWriter<v1::WatchEventsResponse>* writer;
    storage::EventQuery query;
    std::string source;
    std::chrono::steady_clock::time_point said_at;
  };
  absl::Status Tell(Watch* watch);
  absl::Status TellNext(Watch* watch);
  absl::StatusOr<std::vector<EventTail::Entry>> Wanted(const Watch& watch, std::vector<EventTail::Entry> entries) const;
  absl::Status Say(Watch* watch, const std::vector<EventTail::Entry>& entries, std::int64_t looked_at_sequence);
  absl::Status Write(Watch* watch, const v1::WatchEventsResponse& response);

  const EventServiceOptions options_;
  const std::shared_ptr<const storage::EventReader> pages_;
  WatchPlaces places_;
  const std::shared_ptr<EventTail> tail_;
  runtime::CallWatchdog watchdog_;
  runtime::Gauge watching_;
  runtime::Counter told_, cut_off_;
};

}  // namespace sixpoint::plant
