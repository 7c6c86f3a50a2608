// Params and Rows against a real server: what goes in comes out to the last bit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "storage/database.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;

class Values : public ::testing::Test {
 protected:
  // One row of one statement, in a transaction that is rolled back.
  Rows Select(const std::string& sql, const Params& params) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    EXPECT_TRUE(transaction.ok()) << transaction.status();
    absl::StatusOr<Rows> rows = transaction->Execute(sql, params);
    EXPECT_TRUE(rows.ok()) << rows.status();
    return rows.ok() ? *rows : Rows();
  }
  ThrowawayDatabase database_{ThrowawayDatabase::Schema::kEmpty};
};

std::uint64_t BitsOf(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

TEST_F(Values, DoublesKeepEveryBit) {
  std::vector<double> values = {0.0,
                                -0.0,
                                0.1,
                                1.0 / 3.0,
                                1e300,
                                std::numeric_limits<double>::denorm_min(),
                                std::numeric_limits<double>::max(),
                                std::numeric_limits<double>::lowest(),
                                std::numeric_limits<double>::infinity(),
                                -std::numeric_limits<double>::infinity()};
  std::mt19937_64 random(20261121);
  for (int i = 0; i < 2000; ++i) {
    const std::uint64_t bits = random();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    if (std::isfinite(value)) values.push_back(value);
  }
  const Rows rows = Select("SELECT $1::double precision[]", Params().Reals(values));
  const std::vector<double> back = rows.Reals(0, 0);
  ASSERT_EQ(back.size(), values.size());
  for (size_t i = 0; i < values.size(); ++i) EXPECT_EQ(BitsOf(back[i]), BitsOf(values[i])) << values[i];
  for (size_t i = 0; i < 20; ++i) {
    const double one = Select("SELECT $1::double precision", Params().Real(values[i])).Real(0, 0);
    EXPECT_EQ(BitsOf(one), BitsOf(values[i])) << values[i];
  }
  EXPECT_TRUE(std::isnan(Select("SELECT $1::double precision", Params().Real(std::nan(""))).Real(0, 0)));
  EXPECT_THAT(Select("SELECT $1::double precision[]", Params().Reals({})).Reals(0, 0), ::testing::IsEmpty());
  const Rows some = Select("SELECT a[1], a[2] FROM (SELECT $1::double precision[] AS a) AS given",
                           Params().OptionalReals({0.0, std::nullopt}));
  EXPECT_EQ(some.Real(0, 0), 0);
  EXPECT_TRUE(some.IsNull(0, 1));
}

TEST_F(Values, TimesKeepEveryMicrosecond) {
  using std::chrono::microseconds;
  // 2026-11-21T03:27:26Z is 1795231646 s after the epoch (date -u +%s).
  for (const std::int64_t since_epoch_us :
       {std::int64_t{0}, std::int64_t{1}, std::int64_t{-1}, std::int64_t{999999}, std::int64_t{1795231646123456},
        std::int64_t{1795231646000001}, std::int64_t{1795231646100000}, std::int64_t{-1795231646123456},
        std::int64_t{7258118400000000}}) {
    const Instant time{microseconds(since_epoch_us)};
    const Rows rows =
        Select("SELECT $1::timestamptz, (extract(epoch FROM $1::timestamptz) * 1000000)::bigint", Params().Time(time));
    EXPECT_EQ(rows.Time(0, 0), time) << since_epoch_us;
    EXPECT_EQ(rows.Int(0, 1), since_epoch_us);  // the server's own arithmetic
  }
}

TEST_F(Values, TimesDoNotDependOnTheDatabasesTimeZone) {
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok());
  ASSERT_TRUE(transaction->Execute("ALTER ROLE sixpoint SET timezone = 'Asia/Kolkata'").ok());
  ASSERT_TRUE(transaction->Execute("ALTER ROLE sixpoint SET datestyle = 'SQL, DMY'").ok());
  ASSERT_TRUE(transaction->Execute("ALTER ROLE sixpoint SET extra_float_digits = 0").ok());
  ASSERT_TRUE(transaction->Commit().ok());
  const std::unique_ptr<Database> fresh = database_.Open(1);
  absl::StatusOr<Transaction> other = fresh->Begin(Soon());
  ASSERT_TRUE(other.ok());
  const Instant time{std::chrono::microseconds(1795231646123456)};
  const absl::StatusOr<Rows> rows =
      other->Execute("SELECT $1::timestamptz, 0.1::double precision + 0.2", Params().Time(time));
  ASSERT_TRUE(rows.ok());
  EXPECT_EQ(rows->Time(0, 0), time);
  EXPECT_EQ(rows->Real(0, 1), 0.1 + 0.2);
  ASSERT_TRUE(other->Execute("ALTER ROLE sixpoint RESET ALL").ok());
  ASSERT_TRUE(other->Commit().ok());
}

TEST_F(Values, BytesAreAnyBytes) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
  for (int i = 0; i < 12; ++i) bytes += bytes;  // 1 MiB
  const Rows rows = Select("SELECT $1::bytea, octet_length($1::bytea)", Params().Bytes(bytes));
  EXPECT_EQ(rows.Int(0, 1), 256 << 12);
  EXPECT_TRUE(rows.Bytes(0, 0) == bytes);
  EXPECT_EQ(Select("SELECT $1::bytea", Params().Bytes("")).Bytes(0, 0), "");
}

TEST_F(Values, TextsKeepQuotesBracesAndWordsThatLookLikeNull) {
  const std::vector<std::string> texts = {
      "", "NULL", "a,b", "{x}", "\"quoted\"", "back\\slash", " spaces ", "naïve", "'; DROP TABLE blobs; --"};
  const Rows rows = Select("SELECT $1::text[], cardinality($1::text[]), $2::text", Params().Texts(texts).Text("'\"\\"));
  EXPECT_EQ(rows.Texts(0, 0), texts);
  EXPECT_EQ(rows.Int(0, 1), static_cast<std::int64_t>(texts.size()));
  EXPECT_EQ(rows.Text(0, 2), "'\"\\");
}

TEST_F(Values, IntegersBooleansAndNull) {
  const Rows rows = Select("SELECT $1::bigint, $2::bigint, $3::boolean, $4::text, $5::jsonb ->> 'k'",
                           Params()
                               .Int(std::numeric_limits<std::int64_t>::min())
                               .Int(std::numeric_limits<std::int64_t>::max())
                               .Bool(true)
                               .Null()
                               .Json(R"({"k": "v"})"));
  EXPECT_EQ(rows.Int(0, 0), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(rows.Int(0, 1), std::numeric_limits<std::int64_t>::max());
  EXPECT_TRUE(rows.Bool(0, 2));
  EXPECT_TRUE(rows.IsNull(0, 3));
  EXPECT_EQ(rows.Text(0, 4), "v");
}

TEST_F(Values, ATextWithANulIsRefusedNotCut) {
  absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok());
  const absl::StatusOr<Rows> rows = transaction->Execute("SELECT $1::text", Params().Text(std::string_view("a\0b", 3)));
  EXPECT_EQ(rows.status().code(), absl::StatusCode::kInvalidArgument);
}

// No value is invented, and the process lives on: whoever reads on learns it from the status.
TEST_F(Values, WhatAColumnDoesNotHoldMakesTheStatusSaySo) {
  const auto status = [&](const std::function<void(const Rows&)>& read) {
    const Rows rows = Select("SELECT 'x'::text AS grade, NULL::text AS depth_mm, '{1,NULL}'::float8[] AS offsets", {});
    EXPECT_TRUE(rows.status().ok());
    read(rows);
    EXPECT_EQ(rows.status().code(), absl::StatusCode::kInternal);
    EXPECT_EQ(rows.Checked(7).status(), rows.status());
    return std::string(rows.status().message());
  };
  EXPECT_EQ(status([](const Rows& rows) { rows.Int(0, 0); }),
            "database: column 0 (grade) of row 0 holds x, want an integer");
  EXPECT_EQ(status([](const Rows& rows) { EXPECT_EQ(rows.Text(0, 1), ""); }),
            "database: column 1 (depth_mm) of row 0 holds NULL, want a text");
  EXPECT_EQ(status([](const Rows& rows) { EXPECT_TRUE(std::isnan(rows.Real(0, 1))); }),
            "database: column 1 (depth_mm) of row 0 holds NULL, want a number");
  EXPECT_THAT(status([](const Rows& rows) { rows.Reals(0, 2); }), ::testing::HasSubstr("want an array of numbers"));
  EXPECT_THAT(status([](const Rows& rows) { rows.Time(0, 0); }), ::testing::HasSubstr("want a time"));
  EXPECT_THAT(status([](const Rows& rows) { rows.Bool(0, 0); }), ::testing::HasSubstr("want a boolean"));
  EXPECT_THAT(status([](const Rows& rows) { rows.Bytes(0, 0); }), ::testing::HasSubstr("want bytes"));
  EXPECT_THAT(status([](const Rows& rows) { rows.Text(1, 0); }), ::testing::HasSubstr("of row 1 holds nothing"));
  EXPECT_THAT(status([](const Rows& rows) { rows.Text(0, 9); }), ::testing::HasSubstr("column 9 of row 0"));
}

TEST_F(Values, TheFirstThatCannotBeReadIsNamed) {
  const Rows rows = Select("SELECT NULL::text AS first, NULL::text AS second", {});
  rows.Text(0, 0);
  rows.Text(0, 1);
  EXPECT_THAT(std::string(rows.status().message()), ::testing::HasSubstr("(first)"));
}

TEST(NewUuid, IsAVersion7UuidAndSortsByTime) {
  std::string before;
  for (int i = 0; i < 200; ++i) {
    const std::string uuid = NewUuid();
    ASSERT_THAT(uuid, ::testing::MatchesRegex("[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"));
    EXPECT_NE(uuid, before);
    // The first 60 bits are the time; two in one microsecond may fall in any order.
    EXPECT_LE(before.substr(0, std::min<size_t>(before.size(), 18)), uuid.substr(0, 18));
    before = uuid;
  }
}

}  // namespace
}  // namespace sixpoint::storage
