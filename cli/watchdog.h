// Finds services that look alive and answer nobody: descriptors exhausted, a deadlock, a process that was stopped. Their supervisor sees
// only that they have not ended.
#pragma once

#include <string>

namespace sixpoint::cli {

// Of one service; told each answer (ServiceHealth) in turn.
class Watch {
 public:
  // True where the service is to be ended, so that the supervisor starts it anew. Any answer will do: NOT_SERVING says that the
  // database is away, NOT_TRUSTED that its certificate ended, which no restart brings back.
  bool IsStuckAfter(const std::string& health);

 private:
  int silent_count_ = 0, unanswered_count_ = 0;  // in a row
};

}  // namespace sixpoint::cli
