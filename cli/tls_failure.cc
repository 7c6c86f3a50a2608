#include "cli/tls_failure.h"

#include <algorithm>
#include <cctype>
#include <utility>

namespace sixpoint::cli {

// As gRPC 1.51 and OpenSSL 3 say it; the last ones are for others of their releases.
TlsFailure TlsFailureOf(const std::string& message) {
  std::string text = message;
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const auto& [words, failure] :
       {std::pair{"certificate verify failed", TlsFailure::kNotTrusted},
        std::pair{"hostname verification", TlsFailure::kOtherHost},
        std::pair{"wrong version number", TlsFailure::kNoTls}, std::pair{"handshake", TlsFailure::kOther},
        std::pair{"certificate", TlsFailure::kOther}})
    if (text.find(words) != std::string::npos) return failure;
  return TlsFailure::kNone;
}

}  // namespace sixpoint::cli
