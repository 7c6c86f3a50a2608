// Where a process is seen from outside, over TLS: GET /metrics for whoever may read (a certificate that counts now, with a role that a
// person or an MES has), /health/live and /health/ready for anybody.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "identity/identity.h"
#include "services/runtime/https_listener.h"

namespace sixpoint::runtime {

class MetricsListener {
 public:
  // Called in the listener's thread.
  struct Ask {
    std::function<absl::StatusOr<identity::Identity>(const std::string& certificate_pem)> believe;
    std::function<bool()> is_ready;
    // Who was refused; caller: "users/jane", empty where nobody of ours is named.
    std::function<void(const HttpRequest& request, const std::string& caller, const absl::Status& why)> denied;
  };
  // certificates: the folder of the process's own (identity/credentials.h). Answers until it goes.
  static absl::StatusOr<std::unique_ptr<MetricsListener>> Open(const std::string& address,
                                                               const std::filesystem::path& certificates, Ask ask);

 private:
  explicit MetricsListener(Ask ask) : ask_(std::move(ask)) {}
  HttpAnswer AnswerOf(const HttpRequest& request) const;
  HttpAnswer Metrics(const HttpRequest& request) const;

  const Ask ask_;
  std::unique_ptr<HttpsListener> listener_;  // the last: it asks the others until it is gone
};

}  // namespace sixpoint::runtime
