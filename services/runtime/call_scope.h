// What the log says of a call beside each message that is written while it is worked for. The thread of the handler has it; whoever
// hands work to another thread hands it on (CurrentCall, CallScope), and what a thread of gRPC or of a library writes has none.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace sixpoint::runtime {

// Thread-safe.
class CallFacts {
 public:
  // Of the call's own span; `rpc` empty: no server's call, but what a program does.
  explicit CallFacts(std::string traceparent, std::string rpc = "")
      : traceparent_(std::move(traceparent)), rpc_(std::move(rpc)) {}
  const std::string& traceparent() const { return traceparent_; }
  void SetCaller(const std::string& caller);
  std::string caller() const;  // empty: not known, or nobody
  // The first machine, blade and scan that it is about, by resource name; another kind of name is left out.
  void Concerns(const std::string& name);
  // trace_id, span_id, rpc, and of the rest what is known.
  std::vector<std::pair<std::string, std::string>> Known() const;

 private:
  const std::string traceparent_, rpc_;
  mutable std::mutex mutex_;
  std::string caller_;
  std::map<std::string, std::string> concerns_;
};

// Of this thread; none outside a call.
std::shared_ptr<CallFacts> CurrentCall();

// While one lives, this thread works for that call (or for none). Not moved to another thread.
class CallScope {
 public:
  explicit CallScope(std::shared_ptr<CallFacts> call);
  ~CallScope();
  CallScope(const CallScope&) = delete;
  CallScope& operator=(const CallScope&) = delete;

 private:
  std::shared_ptr<CallFacts> before_;
};

// What a call that is made here and now is part of: the call that this thread works for, else the program's own trace; of a service
// that has neither, a new one.
std::string CurrentTraceparent();
// Of a program (cli): one trace for all that it does. From $TRACEPARENT where that is well-formed, so that who starts it finds his
// own again. Gives the trace's id.
std::string BeginOwnTrace();

}  // namespace sixpoint::runtime
