#include "services/runtime/call_scope.h"

#include <cstdlib>

#include "refusal/message_text.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

constexpr std::size_t kLongestNameShown = 100;

thread_local std::shared_ptr<CallFacts> current_call;

std::string& OwnTraceparent() {
  static std::string* const traceparent = new std::string();
  return *traceparent;
}

}  // namespace

void CallFacts::SetCaller(const std::string& caller) {
  const std::lock_guard<std::mutex> lock(mutex_);
  caller_ = Tame(caller, kLongestNameShown);
}

std::string CallFacts::caller() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return caller_;
}

void CallFacts::Concerns(const std::string& name) {
  for (const auto& [kind, collection] :
       {std::pair("machine", "machines/"), std::pair("blade", "blades/"), std::pair("scan", "scans/")}) {
    if (name.rfind(collection, 0) != 0) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    concerns_.emplace(kind, Tame(name, kLongestNameShown));
  }
}

std::vector<std::pair<std::string, std::string>> CallFacts::Known() const {
  std::vector<std::pair<std::string, std::string>> known = {{"trace_id", TraceIdOf(traceparent_)},
                                                            {"span_id", SpanIdOf(traceparent_)}};
  if (!rpc_.empty()) known.emplace_back("rpc", rpc_);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!caller_.empty()) known.emplace_back("caller", caller_);
  known.insert(known.end(), concerns_.begin(), concerns_.end());
  return known;
}

std::shared_ptr<CallFacts> CurrentCall() { return current_call; }

CallScope::CallScope(std::shared_ptr<CallFacts> call) : before_(std::move(current_call)) {
  current_call = std::move(call);
}
CallScope::~CallScope() { current_call = std::move(before_); }

std::string CurrentTraceparent() {
  if (current_call != nullptr) return current_call->traceparent();
  return OwnTraceparent().empty() ? NewTraceparent() : OwnTraceparent();
}

std::string BeginOwnTrace() {
  const char* const given = std::getenv("TRACEPARENT");
  OwnTraceparent() = ChildOf(given == nullptr ? "" : given);
  return TraceIdOf(OwnTraceparent());
}

}  // namespace sixpoint::runtime
