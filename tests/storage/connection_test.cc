#include "storage/connection.h"

#include <absl/strings/cord.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// PostgreSQL's documentation, appendix A, against the contract of database.h.
TEST(StatusOfSqlstate, MapsEveryClassThatTheContractNames) {
  const std::pair<const char*, absl::StatusCode> expected[] = {
      {"", absl::StatusCode::kUnavailable},              // the connection broke without a word
      {"08006", absl::StatusCode::kUnavailable},         // connection_failure
      {"57P01", absl::StatusCode::kUnavailable},         // admin_shutdown
      {"57P02", absl::StatusCode::kUnavailable},         // crash_shutdown
      {"57P03", absl::StatusCode::kUnavailable},         // cannot_connect_now
      {"55P03", absl::StatusCode::kUnavailable},         // lock_not_available
      {"25006", absl::StatusCode::kUnavailable},         // read_only_sql_transaction: a standby
      {"57014", absl::StatusCode::kDeadlineExceeded},    // query_canceled
      {"23505", absl::StatusCode::kAlreadyExists},       // unique_violation
      {"23503", absl::StatusCode::kFailedPrecondition},  // foreign_key_violation
      {"23514", absl::StatusCode::kFailedPrecondition},  // check_violation
      {"23502", absl::StatusCode::kFailedPrecondition},  // not_null_violation
      {"23001", absl::StatusCode::kFailedPrecondition},  // restrict_violation: append-only
      {"40001", absl::StatusCode::kAborted},             // serialization_failure
      {"40P01", absl::StatusCode::kAborted},             // deadlock_detected
      {"53100", absl::StatusCode::kResourceExhausted},   // disk_full
      {"53200", absl::StatusCode::kResourceExhausted},   // out_of_memory
      {"53300", absl::StatusCode::kResourceExhausted},   // too_many_connections
      {"22003", absl::StatusCode::kInvalidArgument},     // numeric_value_out_of_range
      {"22021", absl::StatusCode::kInvalidArgument},     // character_not_in_repertoire
      {"42601", absl::StatusCode::kInternal},            // syntax_error
      {"42P01", absl::StatusCode::kInternal},            // undefined_table
      {"XX000", absl::StatusCode::kInternal},            // internal_error
      {"XX001", absl::StatusCode::kDataLoss},            // data_corrupted
      {"XX002", absl::StatusCode::kDataLoss},            // index_corrupted
  };
  for (const auto& [sqlstate, code] : expected) {
    EXPECT_EQ(StatusOfSqlstate(sqlstate, "why").code(), code) << sqlstate;
  }
}

TEST(StatusOfSqlstate, GivesAReasonWhereAProgramWouldAct) {
  const auto reason = [](const char* sqlstate) {
    return std::string(StatusOfSqlstate(sqlstate, "why").GetPayload(kReasonPayload).value_or(absl::Cord()));
  };
  EXPECT_EQ(reason("40001"), kTransactionConflict);
  EXPECT_EQ(reason("XX002"), kDatabaseDamaged);
  EXPECT_EQ(reason("23505"), "");
}

TEST(Connect, SaysUnavailableWhereNobodyListens) {
  const absl::StatusOr<Connection> connection =
      Connect("host=/nowhere-at-all dbname=x", steady_clock::now() + std::chrono::seconds(5));
  EXPECT_EQ(connection.status().code(), absl::StatusCode::kUnavailable) << connection.status();
}

TEST(Connect, EndsAtItsDeadlineWhenTheServerNeverAnswers) {
  std::string folder = (std::filesystem::temp_directory_path() / "sixpoint-mute-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const int listening = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::snprintf(address.sun_path, sizeof address.sun_path, "%s/.s.PGSQL.5432", folder.c_str());
  ASSERT_EQ(bind(listening, reinterpret_cast<sockaddr*>(&address), sizeof address), 0) << std::strerror(errno);
  ASSERT_EQ(listen(listening, 4), 0);

  const auto begin = std::chrono::steady_clock::now();
  const absl::StatusOr<Connection> connection =
      Connect("host=" + folder + " dbname=x user=x", steady_clock::now() + milliseconds(300));
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(connection.status().code(), absl::StatusCode::kDeadlineExceeded) << connection.status();
  EXPECT_LT(took, milliseconds(1300));  // "within the deadline + 1 s"
  close(listening);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace sixpoint::storage
