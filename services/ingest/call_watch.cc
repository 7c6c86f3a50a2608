#include "services/ingest/call_watch.h"

#include <mutex>

namespace sixpoint::ingest {

// The alarm may go off while the handler returns: whoever comes second finds no context.
struct CallWatch::Watched {
  std::mutex mutex;
  grpc::ServerContext* context;
};

CallWatch::CallWatch(grpc::ServerContext* context, std::chrono::system_clock::time_point deadline)
    : watched_(std::make_shared<Watched>()) {
  watched_->context = context;
  alarm_.Set(deadline, [watched = watched_](bool due) {
    if (!due) return;
    std::lock_guard lock(watched->mutex);
    if (watched->context != nullptr) watched->context->TryCancel();
  });
}

CallWatch::~CallWatch() {
  {
    std::lock_guard lock(watched_->mutex);
    watched_->context = nullptr;
  }
  alarm_.Cancel();
}

}  // namespace sixpoint::ingest
