// Sends the journal to the webhooks: a thread each, so that one that does not answer holds up no other. What is to be sent is read from the
// journal, and how far that has come is kept with it: nothing else has to survive a crash.
#pragma once

#include <absl/status/status.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "services/plant/event_tail.h"
#include "services/plant/webhook_post.h"
#include "services/runtime/metrics.h"
#include "storage/webhooks.h"

namespace sixpoint::plant {

struct WebhookSenderOptions {
  WebhookPostOptions post;
  std::chrono::milliseconds first_pause{1'000},
      longest_pause{3'600'000};                    // doubled at each failure, less up to half by chance
  std::chrono::milliseconds between_looks{2'000};  // for webhooks that were made or withdrawn
};

// Thread-safe. Ends its threads at its end, within a second or so.
class WebhookSender {
 public:
  // Sends to all of the webhooks that hold, and keeps in deliveries how far each has come.
  WebhookSender(std::shared_ptr<const storage::WebhookReader> webhooks,
                std::shared_ptr<storage::WebhookDeliveries> deliveries,
                std::shared_ptr<const storage::EventReader> pages, std::shared_ptr<EventTail> tail,
                const WebhookSenderOptions& options = {});
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;
  WebhookSender& operator=(const WebhookSender&) = delete;

  void Stop();
  // One event of type sixpoint.webhook.test, now.
  WebhookAnswer Test(const storage::WebhookRow& webhook, const std::string& event_id, const std::string& source) const;

 private:
  struct Receiver {
    storage::WebhookRow webhook;
    std::atomic<bool> is_stopped{false};
    std::chrono::milliseconds pause{0};
    std::chrono::steady_clock::time_point saved_at{};
    std::chrono::steady_clock::time_point compared_at{};  // its number with the journal's last
    absl::StatusCode told = absl::StatusCode::kOk;        // how the database failed, last
    std::thread thread{};
  };
  void Run();
  void Compare(const std::vector<storage::WebhookRow>& webhooks);
  void Send(Receiver* receiver);
  absl::Status SendNext(Receiver* receiver);
  absl::Status GoBack(Receiver* receiver);
  void Deliver(Receiver* receiver, const storage::EventPage& page, const std::string& source);
  void Failed(Receiver* receiver, const std::string& why);
  absl::Status Save(Receiver* receiver);
  void Tell(const absl::Status& status, Receiver* receiver);
  void Sleep(const Receiver& receiver, std::chrono::milliseconds time);

  const std::shared_ptr<const storage::WebhookReader> webhooks_;
  const std::shared_ptr<storage::WebhookDeliveries> deliveries_;
  const std::shared_ptr<const storage::EventReader> pages_;
  const std::shared_ptr<EventTail> tail_;
  const WebhookSenderOptions options_;
  runtime::Counter sent_, failed_;
  std::mutex mutex_;
  std::condition_variable stopping_;
  std::atomic<bool> stopped_{false};
  std::map<std::string, std::unique_ptr<Receiver>> receivers_;  // by name; the looking thread's alone
  std::thread thread_;
};

}  // namespace sixpoint::plant
