#include "services/plant/event_service.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "services/plant/event_filter.h"
#include "services/plant/messages.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/pages.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;
using Clock = std::chrono::steady_clock;
using Entries = std::vector<EventTail::Entry>;

constexpr int kMostAnswerEvents = 200;  // of one answer
constexpr std::size_t kMostAnswerBytes =
    1'000'000;  // of one answer, but for its last event: clients take 4 MB unless they are told otherwise
constexpr std::chrono::seconds kListPatience{10};
// gRPC tells nobody that a call was cancelled: it has to be asked.
constexpr std::chrono::milliseconds kBetweenQuestions{100};

// What is asked for; the reader's own eyes see it.
absl::StatusOr<storage::EventQuery> QueryOf(const grpc::ServerContext& context, std::int64_t after_sequence,
                                            const v1::EventFilter& given, const storage::JournalNow& now) {
  absl::StatusOr<storage::EventFilter> filter = EventFilterOf(given, now);
  const absl::Status checked =
      runtime::Refusals().Add(CheckAfterSequence(after_sequence, now)).Add(filter.status()).status();
  if (!checked.ok()) return checked;
  return storage::EventQuery{*std::move(filter), after_sequence, kMostAnswerEvents, runtime::ReaderOf(context)};
}

std::string SourceOf(const storage::JournalNow& now) { return "urn:uuid:" + now.plant_id; }

std::string WatcherOf(const grpc::ServerContext& context) {
  const auto identity = runtime::CallingIdentity(context);
  return identity ? identity->Text() : "";
}

absl::Status WentAway() { return absl::CancelledError("events: the client went away or reads nothing"); }

}  // namespace

EventService::EventService(std::shared_ptr<const storage::EventReader> tail,
                           std::shared_ptr<const storage::EventReader> pages, const EventServiceOptions& options)
    : options_(options),
      pages_(std::move(pages)),
      places_(options.watches),
      tail_(std::make_shared<EventTail>(std::move(tail), options.tail)),
      watching_("sixpoint_event_watches", "Calls that watch events now."),
      told_("sixpoint_events_told_total", "Events that were sent to those who watch."),
      cut_off_("sixpoint_event_watches_cut_off_total", "Watches that were ended because nobody read what was sent.") {}

grpc::Status EventService::WatchEvents(grpc::ServerContext* context, const v1::WatchEventsRequest* request,
                                       grpc::ServerWriter<v1::WatchEventsResponse>* writer) {
  const auto place = places_.Take(WatcherOf(*context));
  if (!place) {
    const WatchLimits& limits = places_.limits();
    return ToGrpc(runtime::Failure(errors::v1::CALLS_FULL,
                                   "watches: as many as may be, want at most " + std::to_string(limits.per_identity) +
                                       " of one identity and " + std::to_string(limits.in_all) + " in all; try again"));
  }
  const absl::StatusOr<storage::JournalNow> now = pages_->Now(runtime::DeadlineOf(*context));
  if (!now.ok()) return ToGrpc(now.status());
  const std::int64_t after_sequence = request->from_now() ? now->newest_sequence : request->after_sequence();
  absl::StatusOr<storage::EventQuery> query = QueryOf(*context, after_sequence, request->filter(), *now);
  if (!query.ok()) return ToGrpc(query.status());
  const EventTail::Listener listener(tail_.get());
  Watch watch{context, writer, *std::move(query), SourceOf(*now), {}};
  watching_.Add(1);
  const absl::Status ended = Tell(&watch);
  watching_.Add(-1);
  return ToGrpc(ended);
}

absl::Status EventService::Tell(Watch* watch) {
  absl::Status status = Say(watch, {}, watch->query.after_sequence);
  while (status.ok()) status = watch->context->IsCancelled() ? WentAway() : TellNext(watch);
  return status;
}

// What the journal's end has for it, or else a page of what lies before that; nothing, where nothing comes for a moment.
absl::Status EventService::TellNext(Watch* watch) {
  const Clock::time_point heartbeat = watch->said_at + options_.heartbeat;
  absl::StatusOr<EventTail::After> after = tail_->Wait(watch->query.after_sequence, kMostAnswerEvents,
                                                       std::min(heartbeat, Clock::now() + kBetweenQuestions));
  if (!after.ok()) return after.status();
  if (after->is_kept) {
    absl::StatusOr<Entries> wanted = Wanted(*watch, std::move(after->entries));
    if (!wanted.ok()) return wanted.status();
    after->entries = *std::move(wanted);
  } else {
    absl::StatusOr<storage::EventPage> page = pages_->Events(watch->query, Clock::now() + kListPatience);
    if (!page.ok()) return page.status();
    for (storage::EventRow& row : page->rows)
      after->entries.push_back(std::make_shared<const storage::EventRow>(std::move(row)));
    after->looked_at_sequence = page->looked_at_sequence;
  }
  if (after->entries.empty() && Clock::now() < heartbeat) {
    watch->query.after_sequence = after->looked_at_sequence;
    return absl::OkStatus();
  }
  return Say(watch, after->entries, after->looked_at_sequence);
}

// Who may see what is asked where somebody may not, and of what is to be told alone.
absl::StatusOr<Entries> EventService::Wanted(const Watch& watch, Entries entries) const {
  const auto erase = [&](const auto& is_left_out) {
    entries.erase(std::remove_if(entries.begin(), entries.end(), is_left_out), entries.end());
  };
  erase([&](const EventTail::Entry& entry) { return !storage::LetsThrough(watch.query.filter, *entry); });
  const bool some_restricted =
      std::any_of(entries.begin(), entries.end(), [](const EventTail::Entry& entry) { return entry->is_restricted; });
  if (!some_restricted || watch.query.reader.sees_all) return entries;
  const auto hidden = pages_->HiddenParts(watch.query.reader, Clock::now() + kListPatience);
  if (!hidden.ok()) return hidden.status();
  erase([&](const EventTail::Entry& entry) { return !storage::IsSeen(*entry, *hidden); });
  return entries;
}

absl::Status EventService::Say(Watch* watch, const Entries& entries, std::int64_t looked_at_sequence) {
  v1::WatchEventsResponse response;
  response.set_source(watch->source);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    v1::Event* const event = response.add_events();
    *event = ToProto(*entries[i]);
    bytes += event->ByteSizeLong();
    if (bytes < kMostAnswerBytes || i + 1 == entries.size()) continue;
    response.set_looked_at_sequence(event->entry().record_sequence());
    if (absl::Status written = Write(watch, response); !written.ok()) return written;
    response.clear_events();
    bytes = 0;
  }
  response.set_looked_at_sequence(looked_at_sequence);
  return Write(watch, response);
}

absl::Status EventService::Write(Watch* watch, const v1::WatchEventsResponse& response) {
  const Clock::time_point began = Clock::now();
  bool is_written = false;
  {
    const runtime::CallWatch bounded(&watchdog_, watch->context, Clock::time_point::max(), options_.write_patience);
    is_written = watch->writer->Write(response);
  }
  watch->said_at = Clock::now();
  if (is_written) {
    told_.Add(response.events_size());
    watch->query.after_sequence = response.looked_at_sequence();
    return absl::OkStatus();
  }
  if (watch->said_at - began >= options_.write_patience) {
    cut_off_.Add();
    runtime::Log(runtime::LogLevel::kWarning, "events: a watch was cut off, for nobody read what was sent",
                 {{"looked_at_sequence", watch->query.after_sequence}});
  }
  return WentAway();
}

grpc::Status EventService::ListEvents(grpc::ServerContext* context, const v1::ListEventsRequest* request,
                                      v1::ListEventsResponse* response) {
  const absl::StatusOr<runtime::Page> size = runtime::PageOf("", request->page_size(), "");
  if (!size.ok()) return ToGrpc(size.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<storage::JournalNow> now = pages_->Now(deadline);
  if (!now.ok()) return ToGrpc(now.status());
  absl::StatusOr<storage::EventQuery> query = QueryOf(*context, request->after_sequence(), request->filter(), *now);
  if (!query.ok()) return ToGrpc(query.status());
  query->limit = std::min(size->size, kMostAnswerEvents);
  const absl::StatusOr<storage::EventPage> page = pages_->Events(*query, deadline);
  if (!page.ok()) return ToGrpc(page.status());
  response->set_looked_at_sequence(page->looked_at_sequence);
  response->set_is_newest(page->is_newest);
  response->set_source(SourceOf(*now));
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < page->rows.size() && bytes < kMostAnswerBytes; ++i) {
    v1::Event* const event = response->add_events();
    *event = ToProto(page->rows[i]);
    bytes += event->ByteSizeLong();
    if (bytes < kMostAnswerBytes || i + 1 == page->rows.size()) continue;
    response->set_looked_at_sequence(event->entry().record_sequence());
    response->set_is_newest(false);
  }
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant
