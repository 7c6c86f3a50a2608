// GET over TLS, as whoever watches a service asks.
#pragma once

#include <filesystem>
#include <string>

namespace sixpoint::testing {

struct HttpsAnswer {
  long code = 0;  // of HTTP; 0: there was no answer
  std::string body;
  std::string error;   // why there was no answer
  std::string serial;  // of the server's certificate
};

// `credentials`: a folder with authority.pem, by which the server is believed, and identity.pem where one is shown.
HttpsAnswer HttpsGet(const std::string& url, const std::filesystem::path& credentials, double seconds = 20);

}  // namespace sixpoint::testing
