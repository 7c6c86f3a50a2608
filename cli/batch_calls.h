// A batch of registrations, over as many calls as it takes, with a line on stderr that tells how far it is.
#pragma once

#include <absl/status/status.h>

#include <functional>
#include <map>
#include <string>

#include "cli/progress.h"
#include "cli/session.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

class BatchCalls {
 public:
  // Hears of each result when it is there. Where it gives anything but OK the call ends so, and the result counts as not there.
  using Finished =
      std::function<absl::Status(const std::string& blade, const registration::v1::FinishedRegistration& finished)>;

  // The request has a request_id.
  BatchCalls(Session* session, registration::v1::RegisterBatchRequest request, Finished finished);

  // A call that broke off after it had brought something is made again and goes on.
  absl::Status Run();
  // By index, also where the batch did not come to its end.
  const std::map<int, registration::v1::FinishedRegistration>& results() const { return results_; }
  int total_count() const { return request_.requests_size(); }
  // blades/{serial}; empty for an index that is not the batch's.
  std::string BladeOf(int index) const;

 private:
  absl::Status CallOnce();
  absl::Status Take(registration::v1::RegisterBatchResponse response);
  std::string HowFar() const;

  Session* const session_;
  registration::v1::RegisterBatchRequest request_;
  const Finished finished_;
  std::map<int, registration::v1::FinishedRegistration> results_;
  std::map<int, std::string> working_;  // what is being done to each
  ProgressLine line_;
};

}  // namespace sixpoint::cli
