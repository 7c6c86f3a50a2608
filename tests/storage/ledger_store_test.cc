// What every LedgerStore does, PostgreSQL's and the fake that handlers are tested on. All else that may be done to a ledger is
// PostgreSQL's alone (ledger_test.cc).
#include "storage/ledger_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "storage/blobs.h"
#include "tests/storage/ledger_under_test.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// "CHANGED record_entries scans/s1: 1 rows, sealed 1"
std::vector<std::string> Sentences(const std::vector<LedgerDamage>& damages) {
  const char* const kinds[] = {"CHANGED", "MISSING", "EXTRA", "SWAPPED"};  // in DamageKind's order
  std::vector<std::string> sentences;
  for (const LedgerDamage& damage : damages)
    sentences.push_back(std::string(kinds[static_cast<int>(damage.kind)]) + " " + damage.table + " " + damage.name +
                        ": " + damage.detail);
  return sentences;
}

std::vector<std::string> ManyNames(int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back("scans/m" + std::to_string(i));
  return names;
}

std::vector<std::string> NamesIn(const ProofPage& page) {
  std::vector<std::string> names;
  for (const EntryProof& proof : page.entries) names.push_back(proof.named.name);
  return names;
}

// As a stranger checks it (docs/ledger.md).
void ExpectProves(const EntryProof& proof, std::int64_t size, const ledger::Hash& root) {
  const ledger::Leaf& leaf = proof.sealed.leaf;
  EXPECT_EQ(ledger::Sha256(proof.named.text), leaf.name_sha256);
  EXPECT_EQ(ledger::Sha256(proof.sealed.content), leaf.content_sha256);
  const Content content = ContentOf(proof.sealed.content);
  EXPECT_EQ(content.count("record_entries"), 1u);
  EXPECT_EQ(content.count("record_roots"), 1u);
  for (const auto& [table, digest] : content) {
    const std::vector<std::string>& rows = proof.row_texts.at(table);
    EXPECT_EQ(static_cast<std::int64_t>(rows.size()), digest.count) << table;
    std::string digests;
    for (const std::string& row : rows) digests += ledger::Sha256(row);
    EXPECT_EQ(ledger::HexOf(ledger::Sha256(digests)), digest.sha256) << table;
  }
  EXPECT_TRUE(ledger::PathProves(ledger::LeafHash(LeafText(leaf)), leaf.index, size, proof.audit_path, root));
}

TEST(LedgerStore, NothingIsSealedOfNothing) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    EXPECT_GT(testing::Must(ledger.store().SchemaVersion(Soon())), 0);
    EXPECT_TRUE(IsUuid(testing::Must(ledger.store().PlantId(Soon()))));
    EXPECT_EQ(ledger.SealAll(), 0);
    EXPECT_EQ(ledger.End().size, 0);
    EXPECT_EQ(testing::Must(ledger.store().Root(0, Soon())), ledger::EmptyRoot());
    EXPECT_EQ(ledger.store().Root(1, Soon()).status().code(), absl::StatusCode::kOutOfRange);
    EXPECT_FALSE(testing::Must(ledger.store().NewestHead(Soon())).has_value());
    EXPECT_THAT(ledger.Proof({"SN-1", 0, 0, 10, 1000, 1000}).entries, IsEmpty());
  });
}

TEST(LedgerStore, WhatIsRecordedIsSealedOnceInItsOrder) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    ledger.Record({"scans/s1", "scans/s2", "scans/s3", "scans/s4", "scans/s5"});
    EXPECT_EQ(testing::Must(ledger.store().CountUnsealed(0, Soon())), 5);
    const Sealed some = testing::Must(ledger.store().Seal(3, Soon()));
    EXPECT_EQ(some.count, 3);
    EXPECT_TRUE(some.more);
    const LedgerEnd then = ledger.End();
    EXPECT_EQ(then.size, 3);
    EXPECT_EQ(testing::Must(ledger.store().CountUnsealed(then.record_sequence, Soon())), 2);
    const ledger::Hash root = testing::Must(ledger.store().Root(3, Soon()));
    const Sealed rest = testing::Must(ledger.store().Seal(3, Soon()));
    EXPECT_EQ(rest.count, 2);
    EXPECT_FALSE(rest.more);
    EXPECT_EQ(ledger.SealAll(), 0);
    EXPECT_EQ(ledger.End().size, 5);
    EXPECT_GT(ledger.End().record_sequence, then.record_sequence);
    EXPECT_EQ(testing::Must(ledger.store().Root(3, Soon())), root) << "what was sealed stays";

    const CheckedLeaves checked = ledger.Checked({0, 5});
    EXPECT_THAT(Sentences(checked.slice.damages), IsEmpty());
    EXPECT_THAT(checked.slice.not_here, IsEmpty());
    EXPECT_EQ(checked.slice.last_sequence, ledger.End().record_sequence);
    ledger::CompactRange range;
    for (const ledger::Hash& leaf : checked.slice.leaf_hashes) range.Append(leaf);
    EXPECT_EQ(range.size(), 5);
    EXPECT_EQ(range.Root(), testing::Must(ledger.store().Root(5, Soon())));
  });
}

TEST(LedgerStore, AHeadIsKeptAsItWasSigned) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    const ledger::SigningKey key =
        testing::Must(ledger::SigningKey::OfPem(testing::Must(ledger::SigningKey::NewPem())));
    const auto keep = [&](const std::string& signed_at) {
      ledger::Head head;
      head.plant_id = testing::Must(ledger.store().PlantId(Soon()));
      head.tree_size = ledger.End().size;
      head.root = testing::Must(ledger.store().Root(head.tree_size, Soon()));
      head.record_sequence = ledger.End().record_sequence;
      head.signed_at = signed_at;
      testing::Must(ledger.store().KeepHead({testing::Must(key.Sign(head)), key.public_pem()}, Soon()));
    };
    for (const char* name : {"scans/s1", "scans/s2"}) {
      ledger.Record({name});
      ledger.SealAll();
      keep("2026-11-25T01:02:03Z");
    }
    keep("2026-11-25T04:05:06Z");  // one of that size stays as it is
    const std::optional<KeptHead> newest = testing::Must(ledger.store().NewestHead(Soon()));
    ASSERT_TRUE(newest.has_value());
    EXPECT_EQ(newest->head.tree_size, 2);
    EXPECT_EQ(newest->head.signed_at, "2026-11-25T01:02:03Z");
    EXPECT_EQ(newest->head.key_id, key.key_id());
    EXPECT_EQ(newest->public_key, key.public_pem());
    EXPECT_TRUE(ledger::IsSignedBy(newest->head, key.public_pem()));
    ASSERT_THAT(ledger.Checked({0, 1}).heads, SizeIs(1));
    EXPECT_EQ(ledger.Checked({0, 1}).heads[0].head.tree_size, 1);
    EXPECT_THAT(ledger.Checked({0, 2}).heads, SizeIs(2));
  });
}

TEST(LedgerStore, ABladesEntriesAreProvenByPages) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    for (const char* name : {"scans/s1", "scans/s2", "scans/s3"}) {
      ledger.Record({name}, "SN-1");
      ledger.Record({std::string(name) + "-other"}, "SN-2");
    }
    ledger.SealAll();
    const std::int64_t size = ledger.End().size;
    const ledger::Hash root = testing::Must(ledger.store().Root(size, Soon()));
    ledger.Record({"scans/s4"}, "SN-1");
    ledger.SealAll();  // beyond the size that is asked for
    ledger.Record({"scans/s5"}, "SN-1");

    ProofQuery query{"SN-1", size, 0, 2, 10'000, 1'000'000};
    const ProofPage first = ledger.Proof(query);
    EXPECT_THAT(NamesIn(first), ElementsAre("scans/s1", "scans/s2"));
    EXPECT_TRUE(first.more);
    EXPECT_EQ(first.unsealed_count, 2);
    query.after_sequence = first.entries.back().sealed.leaf.record_sequence;
    const ProofPage second = ledger.Proof(query);
    EXPECT_THAT(NamesIn(second), ElementsAre("scans/s3"));
    EXPECT_FALSE(second.more);
    for (const ProofPage& page : {first, second})
      for (const EntryProof& proof : page.entries) ExpectProves(proof, size, root);
    query.after_sequence = second.entries.back().sealed.leaf.record_sequence;
    EXPECT_THAT(ledger.Proof(query).entries, IsEmpty());

    // Where a page would be too large, it has at least one entry; of a table that is too large no row is told.
    const ProofPage small = ledger.Proof({"SN-1", size, 0, 10, 10'000, 0});
    EXPECT_THAT(NamesIn(small), ElementsAre("scans/s1"));
    EXPECT_TRUE(small.more);
    EXPECT_THAT(ledger.Proof({"SN-1", size, 0, 1, 10, 1'000'000}).entries.at(0).row_texts, IsEmpty());
    EXPECT_THAT(ledger.Proof({"SN-3", size, 0, 10, 10'000, 1'000'000}).entries, IsEmpty());
  });
}

TEST(LedgerStore, WhatIsNotAsItWasSealedIsTold) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    ledger.Record({"scans/s0", "scans/s1", "scans/s2", "scans/s3", "scans/s4", "scans/s5", "scans/s6", "scans/s7"});
    ledger.SealAll();
    ASSERT_THAT(Sentences(ledger.Damages()), IsEmpty());
    ledger.ChangeRow("scans/s1");
    ledger.DropRow("scans/s2");
    ledger.AddRow("scans/s3");
    ledger.ChangeName("scans/s4");
    ledger.DropName("scans/s5");
    ledger.SwapNames("scans/s6", "scans/s7");
    const std::vector<LedgerDamage> damages = ledger.Damages();
    ASSERT_THAT(damages, SizeIs(7));
    const auto stands_as = [&](std::size_t i) { return std::to_string(damages[i].record_sequence); };
    EXPECT_THAT(
        Sentences(damages),
        ElementsAre("CHANGED record_entries scans/s1: 1 rows, sealed 1",
                    "MISSING record_roots scans/s2: 0 rows, sealed 1", "EXTRA record_inputs scans/s3: 1 rows, sealed 0",
                    "CHANGED record_names scans/s4: name or time", "MISSING record_names : the entry",
                    "SWAPPED record_names scans/s6: stands as entry " + stands_as(6),
                    "SWAPPED record_names scans/s7: stands as entry " + stands_as(5)));
    for (const LedgerDamage& damage : damages) EXPECT_TRUE(IsUuid(damage.record_id)) << damage.record_id;

    std::vector<LedgerDamage> orphans;
    for (std::size_t i = 0; i < LedgerTables().size(); ++i)
      for (const LedgerDamage& damage : testing::Must(ledger.store().CheckOrphans(i, Soon())))
        orphans.push_back(damage);
    const std::string lost = damages[4].record_id + ": belongs to nothing recorded";
    EXPECT_THAT(Sentences(orphans), ElementsAre("EXTRA record_entries : " + lost, "EXTRA record_roots : " + lost));
  });
}

TEST(LedgerStore, WhoseNameIsGoneIsNotProven) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    ledger.Record({"scans/s1"}, "SN-1");
    ledger.SealAll();
    ledger.DropName("scans/s1");
    EXPECT_EQ(ledger.store().ProofOfBlade({"SN-1", 1, 0, 10, 10'000, 1'000'000}, Soon()).status().code(),
              absl::StatusCode::kNotFound);
  });
}

TEST(LedgerStore, ALeafThatIsGoneIsToldAndItsEntryIsOneTooMany) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    ledger.Record({"scans/s1", "scans/s2", "scans/s3"});
    ledger.SealAll();
    const LedgerSlice before = ledger.Checked({0, 3}).slice;
    ledger.DropLeaf(1);
    const LedgerSlice after = ledger.Checked({0, 3}).slice;
    EXPECT_THAT(after.leaf_hashes, ElementsAre(before.leaf_hashes[0], ledger::Hash(32, '\0'), before.leaf_hashes[2]));
    EXPECT_THAT(Sentences(after.damages),
                ElementsAre("MISSING ledger_leaves : leaf 1",
                            "EXTRA record_names scans/s2: entered before others that were sealed"));
    EXPECT_EQ(ledger.store().Root(3, Soon()).status().code(), absl::StatusCode::kOutOfRange);
  });
}

TEST(LedgerStore, SubtreesAreKeptFrom256LeavesOn) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    ledger.Record(ManyNames(300));
    ASSERT_EQ(ledger.SealAll(), 300);
    ledger::CompactRange range;
    std::vector<ledger::Hash> wanted;
    for (const ledger::Hash& leaf : ledger.Checked({0, 300}).slice.leaf_hashes)
      range.Append(leaf, [&](int level, std::int64_t, const ledger::Hash& hash) {
        if (level >= kLeastKeptLevel) wanted.push_back(hash);
      });
    ASSERT_THAT(wanted, SizeIs(1));
    EXPECT_THAT(ledger.Checked({0, 255}).nodes, IsEmpty());
    const std::vector<LedgerNode> kept = ledger.Checked({255, 300}).nodes;
    ASSERT_THAT(kept, SizeIs(1));
    EXPECT_EQ(kept[0].level, kLeastKeptLevel);
    EXPECT_EQ(kept[0].index, 0);
    EXPECT_EQ(kept[0].hash, wanted[0]);
    EXPECT_EQ(testing::Must(ledger.store().Root(300, Soon())), range.Root());
    ledger.SpoilNodes();
    EXPECT_NE(ledger.Checked({0, 300}).nodes.at(0).hash, wanted[0]);
    EXPECT_THAT(Sentences(ledger.Damages()), IsEmpty()) << "who asks compares them";
  });
}

TEST(LedgerStore, ADetachedMonthIsNotHere) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    ledger.RecordInMarch("scans/march", "SN-1");
    ledger.Record({"scans/now"}, "SN-1");
    ledger.SealAll();
    ASSERT_THAT(ledger.Checked({0, 2}).slice.not_here, IsEmpty());
    ledger.DetachMarch();
    const LedgerSlice slice = ledger.Checked({0, 2}).slice;
    EXPECT_THAT(Sentences(slice.damages), IsEmpty());
    EXPECT_THAT(slice.not_here, ElementsAre(std::pair("2026_03", 1)));
    EXPECT_THAT(NamesIn(ledger.Proof({"SN-1", 2, 0, 10, 10'000, 1'000'000})), ElementsAre("scans/now"));
  });
}

TEST(LedgerStore, BytesAreCheckedByPages) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    std::vector<std::string> digests = {Sha256Hex("one"), Sha256Hex("another")};
    std::sort(digests.begin(), digests.end());
    for (const char* bytes : {"one", "another"}) ledger.PutBytes(bytes);
    ledger.SpoilBytes(digests[1]);
    const BlobSlice first = testing::Must(ledger.store().CheckBlobSlice("", 1, Soon()));
    EXPECT_EQ(first.count, 1);
    EXPECT_EQ(first.last_sha256, digests[0]);
    EXPECT_THAT(Sentences(first.damages), IsEmpty());
    const BlobSlice second = testing::Must(ledger.store().CheckBlobSlice(first.last_sha256, 10, Soon()));
    EXPECT_EQ(second.count, 1);
    EXPECT_THAT(Sentences(second.damages), ElementsAre("CHANGED blobs : " + digests[1] + ": other bytes"));
    EXPECT_EQ(testing::Must(ledger.store().CheckBlobSlice(second.last_sha256, 10, Soon())).count, 0);
    EXPECT_THAT(Sentences(testing::Must(ledger.store().CheckBlobsAreThere(Soon()))), IsEmpty());
    const std::string lost = "MISSING blobs : " + ledger.NameLostSurface() + ": named by tessellations";
    EXPECT_THAT(Sentences(testing::Must(ledger.store().CheckBlobsAreThere(Soon()))), ElementsAre(lost, lost));
  });
}

TEST(LedgerStore, ATableThatIsNoPlainOneIsTold) {
  OnBothLedgers([](LedgerUnderTest& ledger) {
    EXPECT_THAT(Sentences(testing::Must(ledger.store().CheckTablesArePlain(Soon()))), IsEmpty());
    ledger.MakeBlobsUnplain();
    EXPECT_THAT(Sentences(testing::Must(ledger.store().CheckTablesArePlain(Soon()))),
                ElementsAre("CHANGED blobs : not a plain table: kind r, want r or p, without rules and policies"));
  });
}

}  // namespace
}  // namespace sixpoint::storage
