#include "storage/blobs.h"

#include <gtest/gtest.h>

#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;

TEST(Sha256Hex, AgreesWithThePublishedVectors) {  // FIPS 180-2, B.1 and the empty message
  EXPECT_EQ(Sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Sha256OfDigests, IsTheDigestOfTheirBytes) {
  // sha256(sha256("abc")), as widely published for the double hash.
  EXPECT_EQ(Sha256OfDigests({Sha256Hex("abc")}), "4f8b42c22dd3729b519ba6f68d2da7cc5b2d606d05daed5ad5128cc03e6c6358");
  EXPECT_EQ(Sha256OfDigests({}), Sha256Hex(""));
  EXPECT_NE(Sha256OfDigests({Sha256Hex("a"), Sha256Hex("b")}), Sha256OfDigests({Sha256Hex("b"), Sha256Hex("a")}));
}

TEST(Blobs, TheSameBytesTwiceAreOneBlob) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const std::string bytes("a cloud\0of points\xff", 18);
  const absl::StatusOr<std::string> first = PutBlob(*transaction, bytes);
  const absl::StatusOr<std::string> second = PutBlob(*transaction, bytes);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_EQ(*first, Sha256Hex(bytes));
  EXPECT_EQ(*second, *first);
  EXPECT_EQ(transaction->Execute("SELECT count(*) FROM blobs")->Int(0, 0), 1);
  EXPECT_EQ(*GetBlob(*transaction, *first), bytes);
  EXPECT_EQ(GetBlob(*transaction, std::string(64, '0')).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(PutBlob(*transaction, "").ok());
}

TEST(Blobs, AFlippedBitIsDataLossNotAWrongCloud) {
  ThrowawayDatabase database;
  absl::StatusOr<Transaction> transaction = database.database()->Begin(Soon());
  const std::string sha256 = *PutBlob(*transaction, "a cloud");
  ASSERT_TRUE(transaction->Execute("ALTER TABLE blobs DISABLE TRIGGER USER").ok());  // as a failing disk would
  ASSERT_TRUE(transaction->Execute("UPDATE blobs SET bytes = set_bit(bytes, 3, 1 - get_bit(bytes, 3))").ok());
  EXPECT_EQ(GetBlob(*transaction, sha256).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace sixpoint::storage
