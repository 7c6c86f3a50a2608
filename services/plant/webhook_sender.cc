#include "services/plant/webhook_sender.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>

#include "services/plant/messages.h"
#include "services/runtime/cloud_event.h"
#include "services/runtime/log.h"

namespace sixpoint::plant {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostMessageEvents = 100;               // of one message
constexpr std::size_t kMostMessageBytes = 1'000'000;  // of one message, but for its last event
constexpr std::chrono::seconds kDatabasePatience{10};
constexpr std::chrono::seconds kBetweenSaves{30};  // of a number that moved by what is not for it
constexpr std::size_t kLongestFailure = 400;

std::int64_t Now_s() { return std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()); }

// Some of it, so that receivers that went away together are not called again together.
std::chrono::milliseconds ByChance(std::chrono::milliseconds pause) {
  static thread_local std::minstd_rand random{std::random_device{}()};
  return std::chrono::milliseconds(
      std::uniform_int_distribution<std::int64_t>(pause.count() / 2, pause.count())(random));
}

std::string Text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

WebhookSender::WebhookSender(std::shared_ptr<const storage::WebhookReader> webhooks,
                             std::shared_ptr<storage::WebhookDeliveries> deliveries,
                             std::shared_ptr<const storage::EventReader> pages, std::shared_ptr<EventTail> tail,
                             const WebhookSenderOptions& options)
    : webhooks_(std::move(webhooks)),
      deliveries_(std::move(deliveries)),
      pages_(std::move(pages)),
      tail_(std::move(tail)),
      options_(options),
      sent_("sixpoint_webhook_events_sent_total", "Events that receivers of webhooks took."),
      failed_("sixpoint_webhook_failures_total", "Messages to receivers of webhooks that were not taken."),
      thread_([this] { Run(); }) {}

WebhookSender::~WebhookSender() {
  Stop();
  thread_.join();
}

void WebhookSender::Stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  stopping_.notify_all();
}

void WebhookSender::Run() {
  while (!stopped_) {
    const auto webhooks = webhooks_->List(/*withdrawn_too=*/false, "", storage::kMostWebhooks,
                                          storage::Reader::Everything(), Clock::now() + kDatabasePatience);
    if (webhooks.ok()) Compare(*webhooks);
    std::unique_lock<std::mutex> lock(mutex_);
    stopping_.wait_for(lock, options_.between_looks, [this] { return stopped_.load(); });
  }
  Compare({});
}

// Those that are new begin, those that are gone end.
void WebhookSender::Compare(const std::vector<storage::WebhookRow>& webhooks) {
  const auto holds = [&](const std::string& id) {
    return std::any_of(webhooks.begin(), webhooks.end(), [&](const auto& one) { return one.webhook_id == id; });
  };
  {
    // Or one that has just asked whether it is stopped would sleep through its waking.
    const std::lock_guard<std::mutex> lock(mutex_);
    for (auto& [id, receiver] : receivers_)
      if (!holds(id)) receiver->is_stopped = true;
  }
  stopping_.notify_all();
  for (auto one = receivers_.begin(); one != receivers_.end();) {
    if (holds(one->first)) {
      ++one;
      continue;
    }
    one->second->thread.join();
    one = receivers_.erase(one);
  }
  for (const storage::WebhookRow& webhook : webhooks) {
    std::unique_ptr<Receiver>& receiver = receivers_[webhook.webhook_id];
    if (receiver != nullptr) continue;
    receiver = std::make_unique<Receiver>();
    receiver->webhook = webhook;
    receiver->pause = options_.first_pause;
    receiver->saved_at = Clock::now();
    receiver->thread = std::thread([this, one = receiver.get()] { Send(one); });
  }
}

void WebhookSender::Sleep(const Receiver& receiver, std::chrono::milliseconds time) {
  std::unique_lock<std::mutex> lock(mutex_);
  stopping_.wait_for(lock, time, [&] { return stopped_ || receiver.is_stopped; });
}

void WebhookSender::Send(Receiver* receiver) {
  const EventTail::Listener listener(tail_.get());
  while (!stopped_ && !receiver->is_stopped) {
    const absl::Status sent = SendNext(receiver);
    Tell(sent, receiver);
    if (!sent.ok()) Sleep(*receiver, options_.first_pause);
  }
}

// Once: what is tried again each moment would fill the log.
void WebhookSender::Tell(const absl::Status& status, Receiver* receiver) {
  if (!status.ok() && status.code() != receiver->told)
    runtime::Log(runtime::LogLevel::kWarning, "webhook " + receiver->webhook.webhook_id +
                                                  " waits for the database: " + std::string(status.message()));
  receiver->told = status.code();
}

// How the database failed; what a receiver does not take is no failure here.
absl::Status WebhookSender::SendNext(Receiver* receiver) {
  storage::WebhookRow& webhook = receiver->webhook;
  const storage::EventQuery query{webhook.filter, webhook.delivery.looked_at_sequence, kMostMessageEvents,
                                  webhook.reader};
  const absl::StatusOr<storage::EventPage> page = pages_->Events(query, Clock::now() + kDatabasePatience);
  if (!page.ok()) return page.status();
  if (!page->rows.empty()) {
    const absl::StatusOr<storage::JournalNow> now = pages_->Now(Clock::now() + kDatabasePatience);
    if (!now.ok()) return now.status();
    Deliver(receiver, *page, "urn:uuid:" + now->plant_id);
    return absl::OkStatus();
  }
  const bool has_moved = webhook.delivery.looked_at_sequence != page->looked_at_sequence;
  webhook.delivery.looked_at_sequence = page->looked_at_sequence;
  if (has_moved && Clock::now() > receiver->saved_at + kBetweenSaves)
    if (absl::Status saved = Save(receiver); !saved.ok()) return saved;
  if (!page->is_newest) return absl::OkStatus();
  if (absl::Status status = GoBack(receiver); !status.ok()) return status;
  return tail_->Wait(page->looked_at_sequence, 1, Clock::now() + std::chrono::milliseconds(500)).status();
}

// A database that was put back to an older state gives again the numbers that were passed here: what gets them would never be sent.
absl::Status WebhookSender::GoBack(Receiver* receiver) {
  storage::WebhookRow& webhook = receiver->webhook;
  if (Clock::now() < receiver->compared_at + options_.between_looks) return absl::OkStatus();
  const absl::StatusOr<storage::JournalNow> now = pages_->Now(Clock::now() + kDatabasePatience);
  if (!now.ok()) return now.status();
  receiver->compared_at = Clock::now();
  if (now->newest_sequence >= webhook.delivery.looked_at_sequence) return absl::OkStatus();
  const auto row = webhooks_->Find(webhook.webhook_id, storage::Reader::Everything(), Clock::now() + kDatabasePatience);
  if (!row.ok()) return row.status();
  // One that is gone with the older state ends with the next look.
  if (!row->has_value() || (*row)->delivery.looked_at_sequence >= webhook.delivery.looked_at_sequence)
    return absl::OkStatus();
  runtime::Log(runtime::LogLevel::kWarning, "webhook " + webhook.webhook_id + ": the journal ends at " +
                                                std::to_string(now->newest_sequence) + ", before " +
                                                std::to_string(webhook.delivery.looked_at_sequence) +
                                                ", up to which it was sent: an older database; goes on from " +
                                                std::to_string((*row)->delivery.looked_at_sequence));
  webhook.delivery = (*row)->delivery;
  return absl::OkStatus();
}

// The page's events or, where they are large, the first of them. With no connection held.
void WebhookSender::Deliver(Receiver* receiver, const storage::EventPage& page, const std::string& source) {
  storage::WebhookRow& webhook = receiver->webhook;
  std::string body = "[";
  std::size_t count = 0;
  while (count < page.rows.size() && body.size() < kMostMessageBytes)
    body += (count == 0 ? "" : ",\n") + Text(runtime::CloudEventOf(ToProto(page.rows[count]), source)), ++count;
  body += "]";
  const std::int64_t first = page.rows.front().entry.recorded.sequence,
                     last = page.rows[count - 1].entry.recorded.sequence;
  const std::string id = webhook.webhook_id + "/" + std::to_string(first) + "-" + std::to_string(last);
  const WebhookAnswer answer = PostEvents(webhook.url, SignatureHeaders(webhook.secret, id, Now_s(), body), body,
                                          options_.post, receiver->is_stopped);
  if (stopped_ || (receiver->is_stopped && !answer.is_taken())) return;
  if (!answer.is_taken()) return Failed(receiver, answer.failure);
  storage::WebhookDelivery& delivery = webhook.delivery;
  delivery.looked_at_sequence = count == page.rows.size() ? page.looked_at_sequence : last;
  delivery.delivered_sequence = last;
  delivery.delivered_at = std::chrono::system_clock::now();
  delivery.failing_since.reset();
  delivery.failure_count = 0;
  receiver->pause = options_.first_pause;
  sent_.Add(static_cast<double>(count));
  // What was taken is not sent again by this process; by the next it may be.
  for (absl::Status saved = Save(receiver); !saved.ok() && !stopped_ && !receiver->is_stopped; saved = Save(receiver)) {
    Tell(saved, receiver);
    Sleep(*receiver, options_.first_pause);
  }
}

void WebhookSender::Failed(Receiver* receiver, const std::string& why) {
  storage::WebhookDelivery& delivery = receiver->webhook.delivery;
  if (!delivery.failing_since) {
    delivery.failing_since = std::chrono::system_clock::now();
    runtime::Log(runtime::LogLevel::kWarning, "webhook " + receiver->webhook.webhook_id + ": not taken: " + why);
  }
  ++delivery.failure_count;
  delivery.last_failure = why.substr(0, kLongestFailure);
  failed_.Add();
  Tell(Save(receiver), receiver);  // the next may be saved
  Sleep(*receiver, ByChance(receiver->pause));
  receiver->pause = std::min(2 * receiver->pause, options_.longest_pause);
}

absl::Status WebhookSender::Save(Receiver* receiver) {
  const storage::WebhookRow& webhook = receiver->webhook;
  const absl::Status saved = deliveries_->Save(webhook.webhook_id, webhook.delivery, Clock::now() + kDatabasePatience);
  if (saved.ok()) receiver->saved_at = Clock::now();
  return saved;
}

WebhookAnswer WebhookSender::Test(const storage::WebhookRow& webhook, const std::string& event_id,
                                  const std::string& source) const {
  const std::string body = Text({{{"specversion", "1.0"},
                                  {"id", event_id},
                                  {"source", source},
                                  {"type", "sixpoint.webhook.test"},
                                  {"subject", "webhooks/" + webhook.webhook_id}}});
  return PostEvents(webhook.url, SignatureHeaders(webhook.secret, event_id, Now_s(), body), body, options_.post,
                    stopped_);
}

}  // namespace sixpoint::plant
