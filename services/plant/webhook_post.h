// One batch of events to an address that somebody named: bounded in time and in what comes back, and to nowhere inside that nobody meant.
#pragma once

#include <atomic>
#include <chrono>
#include <string>
#include <vector>

namespace sixpoint::plant {

struct WebhookPostOptions {
  std::chrono::milliseconds patience{15'000};         // from the look-up of its name to the end of its answer
  std::chrono::milliseconds connect_patience{5'000};  // of it, until it is connected
  // Calls addresses of the link too (169.254.0.0/16, fe80::/10), and others at which clouds tell computers their secrets.
  bool calls_link_local = false;
};

struct WebhookAnswer {
  int http_status = 0;  // 0: none came
  std::string failure;  // empty: it was taken
  bool is_taken() const { return failure.empty(); }
};

// Empty where the address may be one; else what was wanted.
std::string WrongUrl(const std::string& url);
// The headers that say which message it is, when it was sent and by whom (Standard Webhooks): webhook-id, webhook-timestamp and
// webhook-signature, "v1," and the HMAC-SHA256 of id.timestamp.body in base64.
std::vector<std::string> SignatureHeaders(const std::string& key, const std::string& id, std::int64_t timestamp_s,
                                          const std::string& body);
// "whsec_" and the key in base64, as receivers' libraries take it.
std::string SecretText(const std::string& key);
// A CloudEvents batch. Follows no redirect, asks no proxy, and ends soon after `is_stopped` says so.
WebhookAnswer PostEvents(const std::string& url, const std::vector<std::string>& headers, const std::string& body,
                         const WebhookPostOptions& options, const std::atomic<bool>& is_stopped);

}  // namespace sixpoint::plant
