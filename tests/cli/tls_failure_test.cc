#include "cli/tls_failure.h"

#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

TEST(TlsFailure, IsKnownByItsWords) {
  const std::string before = "failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:7400: ";
  EXPECT_EQ(
      TlsFailureOf(before + "Tls handshake failed: SSL_ERROR_SSL: error:0A000086:SSL routines::certificate verify "
                            "failed"),
      TlsFailure::kNotTrusted);
  EXPECT_EQ(TlsFailureOf(before + "Custom verification check failed with error: UNAUTHENTICATED: Hostname Verification "
                                  "Check failed."),
            TlsFailure::kOtherHost);
  EXPECT_EQ(TlsFailureOf(before + "Tls handshake failed: SSL_ERROR_SSL: error:0A00010B:SSL routines::wrong version "
                                  "number"),
            TlsFailure::kNoTls);
  EXPECT_EQ(TlsFailureOf(before + "Tls handshake failed: TSI_PROTOCOL_FAILURE"), TlsFailure::kOther);
  EXPECT_EQ(TlsFailureOf(before + "Failed to connect to remote host: Connection refused"), TlsFailure::kNone);
  EXPECT_EQ(TlsFailureOf(""), TlsFailure::kNone);
}

}  // namespace
}  // namespace sixpoint::cli
