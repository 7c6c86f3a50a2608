// Why two ends of a connection did not come to terms: gRPC has no code for it, only the words of its UNAVAILABLE.
#pragma once

#include <string>

namespace sixpoint::cli {

enum class TlsFailure {
  kNone,        // or none that is known by its words
  kNotTrusted,  // the server's certificate: of another authority, or not valid any more
  kOtherHost,   // it names others than the one by which the server was called
  kNoTls,       // what listens there speaks no TLS
  kOther,
};
TlsFailure TlsFailureOf(const std::string& message);

}  // namespace sixpoint::cli
