// Calls that go out of the plant by HTTP: to an identity provider, to a webhook's receiver. libcurl's handle, bound before anybody can forget
// a bound: certificates and names verified, TLS 1.2 or newer, no redirect, no proxy of the environment, no signal, a time that ends.
#pragma once

#include <chrono>
#include <memory>
#include <string>

struct curl_slist;

namespace sixpoint::runtime {

struct FreeCurl {
  void operator()(void* call) const;
  void operator()(curl_slist* list) const;
};
// A CURL, which libcurl has as void.
using OutwardCall = std::unique_ptr<void, FreeCurl>;
using OutwardHeaders = std::unique_ptr<curl_slist, FreeCurl>;

// protocols: "https", or "http,https". ca_file: PEM of who may sign for it; empty: whom the system believes. The patience is of the whole
// call. Null where curl does not start.
OutwardCall NewOutwardCall(const std::string& url, const char* protocols, const std::string& ca_file,
                           std::chrono::milliseconds patience);
// False: out of memory, and the headers are as they were.
bool AddHeader(const std::string& header, OutwardHeaders* headers);

}  // namespace sixpoint::runtime
