#include "ledger/head.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace sixpoint::ledger {
namespace {

using ::testing::HasSubstr;

class HeadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "sixpoint-heads-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  static SigningKey NewKey() { return *SigningKey::OfPem(*SigningKey::NewPem()); }
  static Head HeadOf(std::int64_t size) {
    Head head;
    head.plant_id = "0198a3c0-0000-7000-8000-000000000001";
    head.tree_size = size;
    head.root = Sha256(std::to_string(size));
    head.record_sequence = 10 * size;
    head.signed_at = "2026-11-25T01:02:03Z";
    return head;
  }
  std::filesystem::path folder_;
};

TEST_F(HeadTest, ASignatureHoldsForItsHeadAndKeyOnly) {
  const SigningKey key = NewKey(), other = NewKey();
  const Head head = *key.Sign(HeadOf(7));
  EXPECT_TRUE(IsSignedBy(head, key.public_pem()));
  EXPECT_FALSE(IsSignedBy(head, other.public_pem()));
  EXPECT_EQ(head.key_id, *KeyIdOf(key.public_pem()));
  EXPECT_NE(head.key_id, other.key_id());
  for (const auto& change : std::vector<std::function<void(Head*)>>{
           [](Head* h) { h->tree_size = 6; }, [](Head* h) { h->root[0] ^= 1; }, [](Head* h) { ++h->record_sequence; },
           [](Head* h) { h->signed_at[0] = '3'; }, [](Head* h) { h->plant_id[0] = '1'; },
           [](Head* h) { h->signature[63] ^= 1; }, [](Head* h) { h->signature.clear(); }}) {
    Head changed = head;
    change(&changed);
    EXPECT_FALSE(IsSignedBy(changed, key.public_pem())) << JsonLineOf(changed);
  }
}

TEST_F(HeadTest, AHeadComesBackFromItsLine) {
  const Head head = *NewKey().Sign(HeadOf(7));
  const Head back = *HeadOfJson(JsonLineOf(head));
  EXPECT_EQ(SignedText(back), SignedText(head));
  EXPECT_EQ(back.signature, head.signature);
  EXPECT_EQ(back.key_id, head.key_id);
  for (const char* line : {"", "{}", "[]", "7", "{\"tree_size\":7}", "not json"})
    EXPECT_FALSE(HeadOfJson(line).ok()) << line;
}

TEST_F(HeadTest, WhatWasNotWrittenWholeIsNoHead) {
  const SigningKey key = NewKey();
  const std::string file = In("heads");
  EXPECT_EQ(LastHead(file)->tree_size, 0);
  EXPECT_THAT(std::string(ReadHeads(file).status().message()), HasSubstr(file));
  for (std::int64_t size = 1; size <= 30; ++size) ASSERT_TRUE(AppendHead(file, *key.Sign(HeadOf(size))).ok());
  EXPECT_EQ(LastHead(file)->tree_size, 30);
  std::ofstream(file, std::ios::app) << JsonLineOf(*key.Sign(HeadOf(31))).substr(0, 60);
  EXPECT_EQ(LastHead(file)->tree_size, 30);
  EXPECT_EQ(ReadHeads(file)->size(), 30u);
  ASSERT_TRUE(AppendHead(file, *key.Sign(HeadOf(32))).ok());
  const auto heads = ReadHeads(file);
  ASSERT_TRUE(heads.ok()) << heads.status();
  EXPECT_EQ(heads->size(), 31u);
  EXPECT_EQ(heads->back().tree_size, 32);
  ASSERT_TRUE(AppendHead(file, *key.Sign(HeadOf(32))).ok());
  ASSERT_TRUE(AppendHead(file, *key.Sign(HeadOf(31))).ok());
  EXPECT_EQ(ReadHeads(file)->size(), 31u) << "none that the last one covers";
  std::ofstream(file, std::ios::app) << JsonLineOf(*key.Sign(HeadOf(33)));
  EXPECT_EQ(ReadHeads(file)->back().tree_size, 33) << "the end of its line alone is missing";
  EXPECT_EQ(LastHead(file)->tree_size, 33);
  ASSERT_TRUE(AppendHead(file, *key.Sign(HeadOf(34))).ok());
  EXPECT_EQ(ReadHeads(file)->size(), 33u);
  std::ofstream(file, std::ios::app) << "something else\n";
  EXPECT_THAT(std::string(ReadHeads(file).status().message()), HasSubstr(file + ":34"));
}

TEST_F(HeadTest, AKeyThatOthersReadIsRefused) {
  const std::string file = In("key.pem");
  std::ofstream(file) << *SigningKey::NewPem();
  ASSERT_EQ(chmod(file.c_str(), 0640), 0);
  EXPECT_THAT(std::string(SigningKey::Read(file).status().message()), HasSubstr("mode 0600"));
  ASSERT_EQ(chmod(file.c_str(), 0600), 0);
  EXPECT_TRUE(SigningKey::Read(file).ok());
  std::ofstream(file) << "no key";
  EXPECT_THAT(std::string(SigningKey::Read(file).status().message()), HasSubstr("Ed25519 private key"));
  EXPECT_FALSE(SigningKey::Read(In("none")).ok());
  EXPECT_FALSE(KeyIdOf("no key").ok());
}

TEST_F(HeadTest, AKeyIsMadeOnce) {
  const std::string file = In("made.pem");
  ASSERT_TRUE(SigningKey::MakeFile(file).ok());
  const std::string id = SigningKey::Read(file)->key_id();
  ASSERT_TRUE(SigningKey::MakeFile(file).ok());
  EXPECT_EQ(SigningKey::Read(file)->key_id(), id);
  std::ifstream shown(In("public.pem"));
  EXPECT_EQ(*KeyIdOf({std::istreambuf_iterator<char>(shown), {}}), id);
  EXPECT_FALSE(SigningKey::MakeFile(In("none") + "/key.pem").ok());
}

}  // namespace
}  // namespace sixpoint::ledger
