#include "tests/storage/ledger_under_test.h"

#include <gtest/gtest.h>

#include <utility>

#include "storage/blobs.h"
#include "storage/record.h"
#include "tests/support/fake_ledger.h"
#include "tests/support/registered.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeLedger;
using sixpoint::testing::Soon;

constexpr char kMarchId[] = "019cbb4b-4c00-7000-8000-000000000001";

class FakeLedgerUnderTest final : public LedgerUnderTest {
 public:
  LedgerStore& store() override { return fake_; }
  void Record(const std::vector<std::string>& names, const std::string& blade) override {
    for (const std::string& name : names) fake_.Record(name, blade);
  }
  void RecordInMarch(const std::string& name, const std::string& blade) override {
    fake_.Record(name, blade, kMarchId);
  }
  void DetachMarch() override { fake_.DetachMonth("2026_03"); }
  void ChangeRow(const std::string& name) override {
    fake_.Tamper(name, [](FakeLedger::Entry& entry) { entry.rows["record_entries"][0] += " "; });
  }
  void DropRow(const std::string& name) override {
    fake_.Tamper(name, [](FakeLedger::Entry& entry) { entry.rows["record_roots"].clear(); });
  }
  void AddRow(const std::string& name) override {
    fake_.Tamper(name, [](FakeLedger::Entry& entry) { entry.rows["record_inputs"] = {"{}"}; });
  }
  void ChangeName(const std::string& name) override {
    fake_.Tamper(name, [](FakeLedger::Entry& entry) { entry.recorded_at = "then"; });
  }
  void DropName(const std::string& name) override {
    fake_.Tamper(name, [](FakeLedger::Entry& entry) { entry.is_named = false; });
  }
  void SwapNames(const std::string& one, const std::string& other) override {
    std::int64_t of_one = 0, of_other = 0;
    fake_.Tamper(one, [&](const FakeLedger::Entry& entry) { of_one = entry.sequence; });
    fake_.Tamper(other, [&](FakeLedger::Entry& entry) { of_other = std::exchange(entry.sequence, of_one); });
    fake_.Tamper(one, [&](FakeLedger::Entry& entry) { entry.sequence = of_other; });
  }
  void DropLeaf(std::int64_t index) override { fake_.DropLeaf(index); }
  void SpoilNodes() override { fake_.SpoilNodes(); }
  void MakeBlobsUnplain() override { fake_.MakeUnplain("blobs"); }
  void PutBytes(const std::string& bytes) override { fake_.PutBlob(bytes); }
  void SpoilBytes(const std::string& sha256) override { fake_.SpoilBlob(sha256); }
  std::string NameLostSurface() override {
    const std::string sha256 = Sha256Hex("surface of p1");
    for (int i = 0; i < 2; ++i) fake_.NameBlob(sha256, "tessellations");
    return sha256;
  }

 private:
  FakeLedger fake_;
};

class PostgresLedgerUnderTest final : public LedgerUnderTest {
 public:
  LedgerStore& store() override { return *store_; }
  void Record(const std::vector<std::string>& names, const std::string& blade) override {
    Transaction transaction = Begin();
    for (const std::string& name : names) Append(transaction, NewUuid(), name, blade);
    testing::Must(transaction.Commit());
  }
  void RecordInMarch(const std::string& name, const std::string& blade) override {
    Keep("SELECT make_partition(held_by, name, by_uuid, '2026-03-01') FROM partitioned_tables ORDER BY depth, name");
    Transaction transaction = Begin();
    Append(transaction, kMarchId, name, blade);
    testing::Must(transaction.Commit());
  }
  void DetachMarch() override { Keep("SELECT detach_month('2026-03-01')"); }
  void ChangeRow(const std::string& name) override {
    Do("UPDATE record_entries SET requested_by = 'another' WHERE record_id = " + IdOf(name));
  }
  void DropRow(const std::string& name) override { Do("DELETE FROM record_roots WHERE record_id = " + IdOf(name)); }
  void AddRow(const std::string& name) override {
    Do("INSERT INTO record_inputs (record_id, position_index, input_id) VALUES (" + IdOf(name) + ", 0, " + IdOf(name) +
       ")");
  }
  void ChangeName(const std::string& name) override {
    Do("UPDATE record_names SET recorded_at = recorded_at - interval '1 second' WHERE record_id = " + IdOf(name));
  }
  void DropName(const std::string& name) override { Do("DELETE FROM record_names WHERE name = '" + name + "'"); }
  void SwapNames(const std::string& one, const std::string& other) override {
    const std::string two = "('" + one + "', '" + other + "')";
    // By way of numbers that nothing has: each stands once at any time.
    Do("UPDATE record_names SET record_sequence = record_sequence + 1000000 WHERE name IN " + two);
    Do("UPDATE record_names n SET record_sequence = o.record_sequence - 1000000 FROM (SELECT name, record_sequence "
       "FROM "
       "record_names WHERE name IN " +
       two + ") o WHERE n.name IN " + two + " AND o.name <> n.name");
  }
  void DropLeaf(std::int64_t index) override {
    Do("DELETE FROM ledger_leaves WHERE leaf_index = " + std::to_string(index));
  }
  void SpoilNodes() override { Do("UPDATE ledger_nodes SET hash = sha256('')"); }
  void MakeBlobsUnplain() override { Do("ALTER TABLE blobs ENABLE ROW LEVEL SECURITY"); }
  void PutBytes(const std::string& bytes) override {
    Transaction transaction = Begin();
    testing::Must(PutBlob(transaction, bytes));
    testing::Must(transaction.Commit());
  }
  void SpoilBytes(const std::string& sha256) override {
    Do("UPDATE blobs SET bytes = set_byte(bytes, 0, 255 - get_byte(bytes, 0)) WHERE sha256 = '\\x" + sha256 + "'");
  }
  std::string NameLostSurface() override {
    Transaction transaction = Begin();
    sixpoint::testing::RegisterPart(transaction, "p1");
    testing::Must(transaction.Commit());
    const std::string sha256 = Sha256Hex("surface of p1");
    Do("DELETE FROM blobs WHERE sha256 = '\\x" + sha256 + "'");
    return sha256;
  }

 private:
  Transaction Begin() { return testing::Must(database_.database()->Begin(Soon(60))); }
  static void Append(Transaction& transaction, const std::string& record_id, const std::string& name,
                     const std::string& blade) {
    RecordEntry entry;
    entry.kind = "scan";
    entry.name = name;
    entry.software_version = "test";
    if (!blade.empty()) entry.blade = blade;
    testing::Must(AppendRecord(transaction, record_id, entry));
  }
  static std::string IdOf(const std::string& name) {
    return "(SELECT record_id FROM record_names WHERE name = '" + name + "')";
  }
  // As a superuser: no trigger and no foreign key is in the way.
  void Do(const std::string& sql) {
    Transaction transaction = Begin();
    testing::Must(transaction.Execute("SET LOCAL session_replication_role = replica"));
    testing::Must(transaction.Execute(sql));
    testing::Must(transaction.Commit());
  }
  // As the months' keeper.
  void Keep(const std::string& sql) {
    Transaction transaction = Begin();
    testing::Must(transaction.Execute(sql));
    testing::Must(transaction.Commit());
  }

  sixpoint::testing::ThrowawayDatabase database_;
  const std::shared_ptr<LedgerStore> store_ = LedgerIn(database_.database());
};

}  // namespace

void OnBothLedgers(const std::function<void(LedgerUnderTest& ledger)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakeLedgerUnderTest fake;
    test(fake);
  }
  SCOPED_TRACE("PostgreSQL");
  PostgresLedgerUnderTest postgres;
  test(postgres);
}

}  // namespace sixpoint::storage
